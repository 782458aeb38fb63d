use super::*;

#[test]
fn taps_are_those_of_the_definition_for_every_pixel() {
    for (size, kernel, stride, pad) in [(9, 4, 2, 1), (8, 3, 1, 1), (7, 5, 3, 0), (6, 2, 3, 1)] {
        let input = Shape { channels: 1, height: size, width: size };
        let conv = Conv2d::new(input, 1, [kernel, kernel], stride, pad).unwrap();
        let outputs = conv.output().height;
        for range in [0..outputs, 0..1, 1..outputs, outputs - 1..outputs] {
            for y in 0..size {
                let expected: Vec<(usize, usize)> = range
                    .clone()
                    .flat_map(|oy| (0..kernel).map(move |k| (oy, k)))
                    .filter(|(oy, k)| oy * stride + k == y + pad)
                    .collect();
                let taps = conv.row_taps(y, &range);
                assert_eq!(taps, conv.column_taps(y, &range));
                let found: Vec<(usize, usize)> = taps.map_or_else(Vec::new, |t| {
                    (0..t.len).map(|i| (t.first + i, t.first_tap - i * stride)).collect()
                });
                assert_eq!(found, expected, "pixel {y} of {size}, outputs {range:?}");
                assert!(found.is_empty() || conv.input_rows(&range).contains(&y));
            }
        }
    }
}

#[test]
fn sizes_that_do_not_go_together_are_refused() {
    let new = |height, channels, kernel, stride, pad| {
        let input = Shape { channels: 1, height, width: 8 };
        Conv2d::new(input, channels, [kernel, kernel], stride, pad).map(|c| c.output().to_string())
    };
    assert_eq!(new(8, 3, 4, 2, 1).unwrap(), "3x4x4");
    let refused =
        |result: Result<String, String>, text: &str| assert_eq!(result.unwrap_err(), text);
    refused(new(0, 3, 4, 2, 1), "a size is 0, must be 1..=16777216");
    refused(new(8, 3, 4, 0, 1), "a size is 0, must be 1..=16777216");
    refused(new(8, 3, 4, 2, 4), "pad = 4, must be below the kernel of [4, 4]");
    refused(new(2, 3, 6, 2, 1), "kernel 6 is larger than 2 pixels with pad 1");
    refused(new(8, 1 << 23, 4, 2, 1), "[8388608, 4, 4] is more than 16777216 in all");
}
