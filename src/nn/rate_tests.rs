use super::*;

#[test]
fn numbers_with_a_sign_have_two_lines() {
    let code = RateCode::new(&[(-1.0, 1.0), (0.0, 1.0), (-1.0, 1.0)]);
    assert_eq!((code.dimensions(), code.outputs()), (3, 5));
    let seen = [0.25, 0.5, -0.75, -1.0, 0.0, 0.125];
    let lines = [0.25, 0.0, 0.5, 0.0, 0.75, 0.0, 1.0, 0.0, 0.125, 0.0];
    assert_eq!(code.activity(&seen), lines);
}

#[test]
fn gradients_go_to_the_line_that_is_open() {
    let code = RateCode::new(&[(-1.0, 1.0), (0.0, 1.0)]);
    let d = code.backward(&[0.5, 0.5, -0.5, 0.5, 0.0, 0.0], &[1., 2., 3., 4., 5., 6., 7., 8., 9.]);
    assert_eq!(d, [1.0, 3.0, -5.0, 6.0, 0.0, 0.0]);
}
