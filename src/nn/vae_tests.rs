use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};

#[test]
fn gradients_equal_finite_differences() {
    let (mean, log_variance) = (gaussians(1, 12), gaussians(2, 12));
    let (noise, weights) = (gaussians(3, 12), gaussians(4, 12));
    let loss = |mean: &[f32], log_variance: &[f32]| {
        let (mut a, mut b) = (vec![0.0; 12], vec![0.0; 12]);
        weighted(&reparameterise(mean, log_variance, &noise), &weights)
            + divergence(mean, log_variance, 0.3, &mut a, &mut b)
    };
    let (mut d_mean, mut d_log) = reparameterise_backward(&log_variance, &noise, &weights);
    divergence(&mean, &log_variance, 0.3, &mut d_mean, &mut d_log);
    check("mean", &mean, &d_mean, |x| loss(x, &log_variance));
    check("log variance", &log_variance, &d_log, |x| loss(&mean, x));
    let mut d_output = vec![0.0; 12];
    mean_square(&mean, &noise, 2.0, &mut d_output);
    check("frame", &mean, &d_output, |x| mean_square(x, &noise, 2.0, &mut [0.0; 12]));
}

#[test]
fn a_unit_gaussian_has_no_divergence() {
    let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
    assert_eq!(divergence(&[0.0; 2], &[0.0; 2], 1.0, &mut a, &mut b), 0.0);
    assert_eq!((a, b), ([0.0; 2], [0.0; 2]));
    // (1 + 4 - 1 - ln 4) / 2
    let log = [4.0f32.ln(), 0.0];
    let found = divergence(&[1.0, 0.0], &log, 1.0, &mut a, &mut b);
    assert!((found - (4.0 - 4.0f64.ln()) / 2.0).abs() < 1e-6, "{found}");
}

#[test]
fn noise_of_a_row_does_not_depend_on_the_others() {
    let streams = Streams::new(1, 0);
    let all = latent_noise(&streams, 3, 0..4, 5);
    assert_eq!(all[10..15], latent_noise(&streams, 3, [2].into_iter(), 5));
    assert_ne!(all[0..5], latent_noise(&streams, 4, 0..1, 5));
}
