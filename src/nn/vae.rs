//! Latent vectors and the loss of a variational auto-encoder (eq. 5).

use crate::rng::{Streams, stream};

/// Gaussian draws for rows `rows` of a batch in update number `update`; row `r` depends on the
/// seed, `update` and `r` alone.
///
/// Shapes: result [rows, latent].
pub fn latent_noise(
    streams: &Streams,
    update: u64,
    rows: impl Iterator<Item = usize>,
    latent: usize,
) -> Vec<f32> {
    let mut noise = Vec::new();
    for row in rows {
        let mut draw = streams.at(stream::LATENT_NOISE, (update << 24) + row as u64);
        noise.extend((0..latent).map(|_| draw.gaussian() as f32));
    }
    noise
}

/// `z = mu + sigma noise` with `sigma = exp(log_variance / 2)`.
pub fn reparameterise(mean: &[f32], log_variance: &[f32], noise: &[f32]) -> Vec<f32> {
    let both = mean.iter().zip(log_variance).zip(noise);
    both.map(|((mean, log_variance), noise)| mean + (0.5 * log_variance).exp() * noise).collect()
}

/// Gradients of mean and log variance from that of `z`.
pub fn reparameterise_backward(
    log_variance: &[f32],
    noise: &[f32],
    d_latent: &[f32],
) -> (Vec<f32>, Vec<f32>) {
    let spread = log_variance.iter().zip(noise).zip(d_latent);
    let d_log =
        spread.map(|((log_variance, noise), d)| d * 0.5 * (0.5 * log_variance).exp() * noise);
    (d_latent.to_vec(), d_log.collect())
}

/// Mean over all elements of the squared difference, times `scale`; its gradient is added.
pub fn mean_square(output: &[f32], target: &[f32], scale: f32, d_output: &mut [f32]) -> f64 {
    assert_eq!(output.len(), target.len(), "elements of reconstruction and frame");
    let factor = 2.0 * scale / output.len() as f32;
    let mut sum = 0.0f64;
    for ((value, target), d) in output.iter().zip(target).zip(d_output) {
        let difference = value - target;
        sum += f64::from(difference * difference);
        *d += factor * difference;
    }
    sum * f64::from(scale) / output.len().max(1) as f64
}

/// Divergence of `N(mean, sigma^2)` from a unit Gaussian, summed over the latent elements, times
/// `scale`: `(mean^2 + sigma^2 - 1 - ln sigma^2) / 2`. Its gradients are added.
pub fn divergence(
    mean: &[f32],
    log_variance: &[f32],
    scale: f32,
    d_mean: &mut [f32],
    d_log_variance: &mut [f32],
) -> f64 {
    let mut sum = 0.0f64;
    let gradients = d_mean.iter_mut().zip(d_log_variance);
    for ((mean, log_variance), (d_mean, d_log)) in mean.iter().zip(log_variance).zip(gradients) {
        let variance = log_variance.exp();
        sum += 0.5 * f64::from(mean * mean + variance - 1.0 - log_variance);
        *d_mean += scale * mean;
        *d_log += scale * 0.5 * (variance - 1.0);
    }
    sum * f64::from(scale)
}

#[cfg(test)]
#[path = "vae_tests.rs"]
mod tests;
