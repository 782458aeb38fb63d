use super::*;
use crate::nn::adam::AdamSettings;
use crate::nn::gradient_check::{check, gaussians};
use crate::nn::shards::Shards;
use crate::nn::spike::{Rectangular, Smooth};
use crate::nn::state::{StateReader, StateWriter};

fn small() -> HsvaeShape {
    HsvaeShape {
        side: 16,
        channels: vec![3, 1],
        frames: 2,
        divergence_weight: 0.1,
        rate_weight: 0.3,
        encoder_gain: 1.0,
        ..HsvaeShape::eem_san()
    }
}

/// Frames with a bar that moves: [steps, samples, pixels].
fn frames(steps: usize, samples: usize, side: usize) -> Vec<f32> {
    let mut all = Vec::new();
    for step in 0..steps {
        for sample in 0..samples {
            let bar = (3 * sample + step) % side;
            let pixel = |at: usize| f32::from(at % side / 3 == bar / 3);
            all.extend((0..side * side).map(pixel));
        }
    }
    all
}

#[test]
fn sizes_are_those_of_table_1() {
    let hsvae = Hsvae::new(&HsvaeShape::eem_san());
    let neurons: Vec<usize> = hsvae.encoder.neurons().collect();
    assert_eq!(neurons, [65_536, 32_768, 4096, 64]);
    assert_eq!(hsvae.shape().latent(), 64);
    let shape = |name: &str| hsvae.layout().find(name).unwrap().shape.clone();
    assert_eq!(shape("encoder.2.weight"), [32, 16, 4, 4]);
    assert_eq!(shape("mu.weight"), [64, 64]);
    assert_eq!(shape("decoder.1.weight"), [1, 16, 4, 4]);
    assert_eq!(shape("decoder.4.weight"), [16, 1, 4, 4]);
    let values = hsvae.initial(&Streams::new(1, 0)).values;
    let made = hsvae.decode(&values, &[0.5; 64]);
    assert_eq!(made.len(), 128 * 128);
    assert!(made.iter().all(|pixel| (0.0..=1.0).contains(pixel)));
}

#[test]
fn gradients_equal_finite_differences() {
    let hsvae = Hsvae::new(&small());
    let mut values = hsvae.initial(&Streams::new(2, 0)).values;
    values.iter_mut().for_each(|value| *value *= 2.0);
    // Keep the decoder's units away from the kink of the ReLU, some on, some off.
    let bias = hsvae.layout().find("decoder.1.bias").unwrap().slot;
    bias.of_mut(&mut values).copy_from_slice(&[2.5, -2.5, 2.5]);
    // Two ticks of two frames, two samples; the state is not zero at the start.
    let (frames, noise) = (frames(4, 2, 16), gaussians(4, 2 * 2 * 16));
    let targets = frames[..2 * 2 * 256].to_vec();
    let batch = HsvaeBatch { frames: &frames, targets: &targets, noise: &noise, share: 20.0 };
    let mut start = hsvae.rest(2);
    hsvae.encode::<Smooth>(&values, &frames, &mut start);
    let loss = |values: &[f32], gradient: &mut [f32]| {
        let loss = hsvae.loss::<Smooth>(values, gradient, &batch, &mut start.clone());
        loss.reconstruction + loss.divergence + loss.rate
    };
    let mut gradient = hsvae.layout().zeros();
    loss(&values, &mut gradient);
    for entry in hsvae.layout().entries() {
        let moved = |part: &[f32]| {
            let mut moved = values.clone();
            entry.slot.of_mut(&mut moved).copy_from_slice(part);
            loss(&moved, &mut hsvae.layout().zeros())
        };
        check(&entry.name, entry.slot.of(&values), entry.slot.of(&gradient), moved);
    }
}

#[test]
fn readout_sees_the_last_frame_of_a_tick_and_state_goes_on() {
    let hsvae = Hsvae::new(&small());
    let values = hsvae.initial(&Streams::new(2, 0)).values;
    let frames = frames(6, 3, 16);
    let mut state = hsvae.rest(3);
    let whole = hsvae.encode::<Rectangular>(&values, &frames, &mut state);
    let mut cut = hsvae.rest(3);
    let parts = frames.chunks(2 * 3 * 256);
    let parts = parts.map(|part| hsvae.encode::<Rectangular>(&values, part, &mut cut).mean);
    let parts: Vec<f32> = parts.flatten().collect();
    assert_eq!(cut, state);
    for (whole, part) in whole.mean.iter().zip(&parts) {
        assert!((whole - part).abs() < 1e-5, "{whole} {part}");
    }
    let last = &whole.layers[1].voltage[5 * 48..];
    assert_eq!(last, &whole.readout[2 * 48..]);
}

fn trainer(count: usize, threads: usize) -> HsvaeTrainer {
    let shards = Shards { count, threads };
    let settings = HsvaeSettings { adam: AdamSettings::with_rate(5e-3), shards };
    HsvaeTrainer::new(&settings, &small(), &Streams::new(4, 0))
}

#[test]
fn results_depend_on_shards_only_by_rounding_and_not_on_threads() {
    let frames = frames(4, 5, 16);
    let targets = frames[..2 * 5 * 256].to_vec();
    let batch = Sequences { samples: 5, frames: &frames, targets: &targets };
    let [one, two, threads] = [(1, 1), (2, 1), (2, 2)].map(|(count, threads)| {
        let trainer = trainer(count, threads);
        let mut state = trainer.layers().rest(5);
        let (gradient, loss) = trainer.gradient(&batch, &mut state, &Streams::new(1, 0));
        (gradient, loss, state)
    });
    assert_eq!(two, threads);
    assert!((one.1.reconstruction - two.1.reconstruction).abs() < 1e-6);
    assert!((one.1.divergence - two.1.divergence).abs() < 1e-6);
    assert_eq!(one.2.layers[0].spikes, two.2.layers[0].spikes);
    for (one, two) in one.0.iter().zip(&two.0) {
        assert!((one - two).abs() < 1e-5, "{one} {two}");
    }
}

#[test]
fn loss_falls_and_a_saved_run_goes_on_byte_for_byte() {
    let frames = frames(4, 4, 16);
    let targets: Vec<f32> = frames.chunks(4 * 256).skip(1).step_by(2).flatten().copied().collect();
    let batch = Sequences { samples: 4, frames: &frames, targets: &targets };
    let mut trainer = trainer(2, 2);
    let step = |trainer: &mut HsvaeTrainer| {
        let mut state = trainer.layers().rest(4);
        let loss = trainer.update(&batch, &mut state, &Streams::new(1, 0));
        loss.reconstruction + loss.divergence + loss.rate
    };
    let losses: Vec<f64> = (0..150).map(|_| step(&mut trainer)).collect();
    assert!(losses[149] < 0.7 * losses[0], "loss went from {} to {}", losses[0], losses[149]);
    let mut state = StateWriter::default();
    trainer.write(&mut state);
    let bytes = state.bytes();
    let mut resumed = super::tests::trainer(2, 1);
    resumed.read(&StateReader::new("run", &bytes).unwrap()).unwrap();
    assert_eq!(resumed.updates(), 150);
    assert_eq!(step(&mut resumed), step(&mut trainer));
    assert_eq!(resumed.parameters, trainer.parameters);
}
