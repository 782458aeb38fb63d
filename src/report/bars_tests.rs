use super::*;

fn bar(label: &str, values: &[f64], dots: &[f64]) -> Bar {
    Bar {
        label: label.to_owned(),
        values: values.to_vec(),
        dots: dots.to_vec(),
        said: "said".to_owned(),
    }
}

#[test]
fn parts_follow_each_other_and_the_longest_bar_fills_the_picture() {
    let rows = [bar("a<b", &[1.0, 3.0], &[]), bar("c", &[1.0, 0.0], &[2.0])];
    let svg = bars("t", &["x", "y"], &rows, None);
    for part in [
        r#"<rect x="250.0" y="55" width="115.0""#,
        r#"<rect x="365.0" y="55" width="345.0""#,
        r#"<rect x="250.0" y="79" width="115.0""#,
        r#"<circle cx="480.0""#,
        "a&lt;b",
    ] {
        assert!(svg.contains(part), "{part}: {svg}");
    }
    // Background, two of the legend, three parts: one of length 0 is not drawn.
    assert_eq!(svg.matches("<rect").count(), 6);
}

#[test]
fn a_given_full_length_is_the_scale_and_no_bar_is_longer() {
    let rows =
        [bar("a", &[50.0], &[]), bar("b", &[500.0], &[f64::NAN]), bar("c", &[f64::NAN], &[])];
    let svg = bars("t", &["x"], &rows, Some(100.0));
    assert!(svg.contains(r#"width="230.0""#) && svg.contains(r#"width="460.0""#), "{svg}");
    assert!(!svg.contains("NaN"), "{svg}");
}
