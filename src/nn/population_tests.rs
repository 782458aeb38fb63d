use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::spike::{Rectangular, Smooth};
use crate::rng::stream;

fn population() -> (Population, Parameters) {
    let mut layout = Layout::default();
    let population = Population::new(&mut layout, "p", &[(-1.0, 1.0), (0.0, 1.0)], 5);
    let mut parameters = Parameters::zeros(&layout);
    population.initialise(&mut parameters);
    (population, parameters)
}

#[test]
fn means_cover_the_range_and_a_neuron_at_its_mean_is_fully_active() {
    let (population, parameters) = population();
    let means = parameters.tensor("p.mean").unwrap();
    assert_eq!(means, [-1.0, -0.5, 0.0, 0.5, 1.0, 0.0, 0.25, 0.5, 0.75, 1.0]);
    let activity = population.activity(&parameters.values, &[-0.5, 1.0]);
    assert_eq!((activity[1], activity[9]), (1.0, 1.0));
    // One mean away: exp(-1 / (2 * 0.5809475^2)) = 0.2273
    assert!((activity[0] - 0.2273).abs() < 1e-4, "{}", activity[0]);
}

#[test]
fn gradients_equal_finite_differences() {
    let (population, parameters) = population();
    let (observations, weights) = (gaussians(8, 6), gaussians(9, 2 * 3 * 10));
    let loss = |values: &[f32], observations: &[f32]| {
        let activity = population.activity(values, observations);
        let mut draws: Vec<Draw> =
            (0..3).map(|i| Streams::new(1, 0).at(stream::POPULATION_SPIKES, i)).collect();
        weighted(&population.spikes::<Smooth>(&activity, 2, &mut draws), &weights)
    };
    let activity = population.activity(&parameters.values, &observations);
    let mut gradient = parameters.layout().zeros();
    let values = &parameters.values;
    let d_activity = sum_of_steps(&weights, activity.len());
    let d = population.backward(values, &mut gradient, &observations, &activity, &d_activity);
    check("fields", values, &gradient, |v| loss(v, &observations));
    check("observations", &observations, &d, |x| loss(values, x));
}

#[test]
fn spikes_come_with_the_probability_of_the_activity() {
    let (population, _) = population();
    let activity = [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 0.2, 0.4, 0.6];
    let steps = 20_000;
    let mut draws = vec![Streams::new(5, 0).at(stream::POPULATION_SPIKES, 0)];
    let spikes = population.spikes::<Rectangular>(&activity, steps, &mut draws);
    for (rate, expected) in sum_of_steps(&spikes, 10).iter().zip(activity) {
        assert!((rate / steps as f32 - expected).abs() < 0.015, "{rate} of {steps}, {expected}");
    }
    assert_eq!(sum_of_steps(&spikes, 10)[6], steps as f32);
}

#[test]
fn projection_keeps_deviations_positive() {
    let (population, mut parameters) = population();
    parameters.values.fill(-1.0);
    population.project(&mut parameters.values);
    assert!(parameters.tensor("p.deviation").unwrap().iter().all(|d| *d == DEVIATION_MIN));
    assert!(parameters.tensor("p.mean").unwrap().iter().all(|m| *m == -1.0));
}
