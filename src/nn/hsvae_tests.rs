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
        encoder_lean: 1.0,
        aligned_latent: true,
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

/// The small shape as AVAE and as FSVAE.
fn peers() -> [HsvaeShape; 2] {
    [
        HsvaeShape { encoder: EncoderKind::Artificial, ..small() },
        HsvaeShape {
            encoder: EncoderKind::PerTick,
            decoder: DecoderKind::Spiking,
            decoder_gain: 4.0,
            ..small()
        },
    ]
}

#[test]
fn gradients_equal_finite_differences() {
    gradients_equal_those_of(&small());
}

#[test]
fn gradients_of_avae_equal_finite_differences() {
    gradients_equal_those_of(&peers()[0]);
}

#[test]
fn gradients_of_fsvae_equal_finite_differences() {
    gradients_equal_those_of(&peers()[1]);
}

fn gradients_equal_those_of(shape: &HsvaeShape) {
    let hsvae = Hsvae::new(shape);
    let mut values = hsvae.initial(&Streams::new(2, 0)).values;
    values.iter_mut().for_each(|value| *value *= 2.0);
    let mut set = |name: &str, biases: &[f32]| {
        let slot = hsvae.layout().find(name).unwrap().slot;
        slot.of_mut(&mut values).copy_from_slice(biases);
    };
    // Keep artificial units away from the kink of the ReLU, some on, some off.
    if shape.decoder == DecoderKind::Artificial {
        set("decoder.1.bias", &[2.5, -2.5, 2.5]);
    }
    if shape.encoder == EncoderKind::Artificial {
        set("encoder.1.bias", &[4.0, -9.0, 6.0]);
        // Outputs have no upper bound: without this the latent vector outweighs the decoder's bias.
        let mu = hsvae.layout().find("mu.weight").unwrap().slot;
        mu.of_mut(&mut values).iter_mut().for_each(|weight| *weight *= 0.05);
    }
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

#[test]
fn an_artificial_encoder_reads_the_mean_of_a_tick_and_nothing_goes_on() {
    let hsvae = Hsvae::new(&peers()[0]);
    let values = hsvae.initial(&Streams::new(2, 0)).values;
    let frames = frames(4, 3, 16);
    let mut state = hsvae.rest(3);
    let both = hsvae.encode::<Rectangular>(&values, &frames, &mut state);
    assert_eq!(state, hsvae.rest(3));
    assert_eq!(both.mean.len(), 2 * 3 * hsvae.shape().latent());
    let outputs = both.outputs.last().unwrap();
    let n = 3 * hsvae.shape().latent();
    for (index, read) in both.readout.iter().enumerate() {
        let (tick, at) = (index / n, index % n);
        let mean = (outputs[2 * tick * n + at] + outputs[(2 * tick + 1) * n + at]) / 2.0;
        assert!((read - mean).abs() < 1e-6, "{read} {mean}");
    }
    assert!(outputs.iter().any(|output| *output < 0.0), "no ReLU after the last layer");
    let rates = both.rates();
    assert!(rates.iter().all(|rate| (0.0..=1.0).contains(rate)), "{rates:?}");
    // The order of the frames of a tick does not matter, that of the ticks does not either.
    let turned: Vec<f32> = frames.chunks(3 * 256).rev().flatten().copied().collect();
    let turned = hsvae.encode::<Rectangular>(&values, &turned, &mut state);
    let ticks = turned.mean.chunks(n).rev().flatten();
    for (found, expected) in ticks.zip(&both.mean) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn an_encoder_that_forgets_sees_every_tick_as_if_it_were_the_first() {
    let hsvae = Hsvae::new(&peers()[1]);
    let values = hsvae.initial(&Streams::new(2, 0)).values;
    let frames = frames(6, 3, 16);
    let mut state = hsvae.rest(3);
    let all = hsvae.encode::<Rectangular>(&values, &frames, &mut state);
    assert_eq!(state, hsvae.rest(3));
    let carries = Hsvae::new(&small());
    for (tick, frames) in frames.chunks(2 * 3 * 256).enumerate() {
        let first = carries.encode::<Rectangular>(&values, frames, &mut carries.rest(3));
        let n = first.mean.len();
        assert_eq!(first.mean, all.mean[tick * n..(tick + 1) * n]);
    }
    let going_on = carries.encode::<Rectangular>(&values, &frames, &mut carries.rest(3));
    assert_ne!(going_on.mean, all.mean);
}

#[test]
fn a_spiking_decoder_spikes_at_the_start() {
    let hsvae = Hsvae::new(&HsvaeShape { side: 128, ..peers()[1].clone() });
    let values = hsvae.initial(&Streams::new(2, 0)).values;
    let n = hsvae.shape().latent();
    let [dark, bright] = [0.0, 1.0].map(|level| hsvae.decode(&values, &vec![level; n]));
    assert_eq!(dark.len(), 128 * 128);
    assert_ne!(dark, bright);
    assert!(bright.iter().all(|pixel| (0.0..=1.0).contains(pixel)));
}

fn trainer(count: usize, threads: usize) -> HsvaeTrainer {
    trainer_of(&small(), count, threads)
}

fn trainer_of(shape: &HsvaeShape, count: usize, threads: usize) -> HsvaeTrainer {
    let shards = Shards { count, threads };
    let settings = HsvaeSettings { adam: AdamSettings::with_rate(5e-3), shards };
    HsvaeTrainer::new(&settings, shape, &Streams::new(4, 0))
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
    let [avae, fsvae] = peers();
    for shape in [small(), avae, fsvae] {
        loss_falls_and_goes_on(&shape);
    }
}

fn loss_falls_and_goes_on(shape: &HsvaeShape) {
    let frames = frames(4, 4, 16);
    let targets: Vec<f32> = frames.chunks(4 * 256).skip(1).step_by(2).flatten().copied().collect();
    let batch = Sequences { samples: 4, frames: &frames, targets: &targets };
    let mut trainer = trainer_of(shape, 2, 2);
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
    let mut resumed = trainer_of(shape, 2, 1);
    resumed.read(&StateReader::new("run", &bytes).unwrap()).unwrap();
    assert_eq!(resumed.updates(), 150);
    assert_eq!(step(&mut resumed), step(&mut trainer));
    assert_eq!(resumed.parameters, trainer.parameters);
}
