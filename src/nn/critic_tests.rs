use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};

#[test]
fn gradients_equal_finite_differences() {
    let shape = CriticShape { observations: 6, actions: 2, hidden: vec![9, 8, 7] };
    let critic = Critic::new(&shape);
    let values = gaussians(1, critic.layout().length());
    let values: Vec<f32> = values.iter().map(|v| 0.4 * v).collect();
    let (observations, actions) = (gaussians(2, 4 * 6), gaussians(3, 4 * 2));
    let weights = gaussians(4, 4);
    let loss = |values: &[f32], actions: &[f32]| {
        weighted(&critic.forward(values, &observations, actions).value, &weights)
    };
    let trace = critic.forward(&values, &observations, &actions);
    let mut gradient = critic.layout().zeros();
    critic.backward(&values, &mut gradient, &trace, &weights);
    check("critic", &values, &gradient, |v| loss(v, &actions));
    let d_action = critic.backward_action(&values, &trace, &weights);
    check("action", &actions, &d_action, |a| loss(&values, a));
}

#[test]
fn action_joins_at_the_second_layer() {
    let critic = Critic::new(&CriticShape::eem_san(86));
    let shapes: Vec<_> =
        critic.layout().entries().iter().map(|e| (e.name.as_str(), e.shape.clone())).collect();
    assert_eq!(shapes[0], ("1.weight", vec![512, 86]));
    assert_eq!(shapes[2], ("2.weight", vec![512, 514]));
    assert_eq!(shapes[6], ("4.weight", vec![1, 512]));
}
