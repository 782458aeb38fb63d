use super::*;

fn decode(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

#[test]
fn a_picture_decodes_to_its_panels() {
    let mut frame = EventFrame::default();
    frame.set(10, 20);
    let events =
        [Event { t_us: 1, y: 2, x: 1, on: true }, Event { t_us: 2, y: 3, x: 1, on: false }];
    let view = Panel::of_shades(&[77; PIXELS]).with_events(&events);
    let bytes = png_of_panels(&[view, Panel::of_frame(&frame)]).unwrap();
    let (width, height, pixels) = decode(&bytes);
    assert_eq!((width, height), (3 * (128 + 2 + 128), 3 * 128));
    let at = |x: usize, y: usize| {
        let first = 3 * (3 * y * width as usize + 3 * x);
        [pixels[first], pixels[first + 1], pixels[first + 2]]
    };
    assert_eq!((at(0, 0), at(1, 2), at(1, 3)), ([77; 3], ON_RGB, OFF_RGB));
    assert_eq!((at(128, 5), at(130 + 10, 20), at(130 + 11, 20)), (GAP_RGB, [255; 3], [0; 3]));
}
