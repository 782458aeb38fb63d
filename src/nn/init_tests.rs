use super::*;
use crate::nn::parameters::Layout;

#[test]
fn weights_and_biases_fill_their_bounds_and_other_tensors_stay() {
    let mut layout = Layout::default();
    layout.add("fc.weight", &[40, 25]);
    layout.add("fc.bias", &[40]);
    layout.add("up.weight", &[8, 16, 4, 4]);
    layout.add("fc.r", &[1]);
    let mut parameters = Parameters::zeros(&layout);
    uniform_by_fan_in(&mut parameters, &Streams::new(1, 0));
    for (name, bound) in [("fc.weight", 0.2), ("fc.bias", 0.2), ("up.weight", 1.0 / 16.0)] {
        let values = parameters.tensor(name).unwrap();
        let largest = values.iter().fold(0.0f32, |largest, v| largest.max(v.abs()));
        assert!(largest <= bound && largest > 0.9 * bound, "{name}: {largest} of {bound}");
    }
    assert_eq!(parameters.tensor("fc.r"), Some(&[0.0][..]));
    let mut again = Parameters::zeros(&layout);
    uniform_by_fan_in(&mut again, &Streams::new(1, 0));
    assert_eq!(parameters, again);
}
