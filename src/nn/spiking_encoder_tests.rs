use super::*;
use crate::nn::actor::{Actor, ActorShape, ActorTrace};
use crate::nn::conv::{Conv, HALVING};
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::init::uniform_by_fan_in;
use crate::nn::lif::{LifState, LifTrace};
use crate::nn::parameters::Parameters;
use crate::nn::population::SpikeDraws;
use crate::nn::spike::{Rectangular, Smooth};
use crate::rng::{Streams, stream};

fn shape(channels: &[usize]) -> SpikingEncoderShape {
    let side = 16;
    let last = side >> channels.len();
    SpikingEncoderShape {
        side,
        channels: channels.to_vec(),
        latent: last * last * channels.last().unwrap(),
        lif: LifShape::default(),
        threshold: 0.5,
    }
}

/// Weights that lean to the positive, so that spikes reach the last layer.
fn values(encoder: &SpikingEncoder, gain: f32) -> Vec<f32> {
    let mut parameters = Parameters::zeros(encoder.layout());
    uniform_by_fan_in(&mut parameters, &Streams::new(3, 0));
    for entry in encoder.layout().entries().iter().filter(|e| e.name.starts_with("encoder.")) {
        let fan_in: usize = entry.shape[1..].iter().product();
        let lean = if entry.name.ends_with("weight") { gain / fan_in as f32 } else { 0.0 };
        entry.slot.of_mut(&mut parameters.values).iter_mut().for_each(|w| *w = gain * *w + lean);
    }
    parameters.values
}

/// Active pixels of some frames.
fn frames(count: usize, side: usize) -> Vec<Vec<usize>> {
    let mut draw = Streams::new(5, 0).at(stream::STIMULUS, 7);
    (0..count)
        .map(|_| (0..side * side).filter(|_| draw.bernoulli(0.2)).collect::<Vec<_>>())
        .collect()
}

fn run<S: Spike>(encoder: &SpikingEncoder, values: &[f32], frames: &[Vec<usize>]) -> Tape {
    let (weights, mut tape) = (encoder.lay_out(values), encoder.tape(true));
    frames.iter().for_each(|f| encoder.step::<S>(&weights, &mut tape, f.iter().copied()));
    tape
}

/// The same network by dense convolutions: layers, and what each left.
struct Dense {
    layout: Layout,
    convs: Vec<Conv>,
    traces: Vec<LifTrace<Rectangular>>,
    input: Vec<f32>,
}

impl Dense {
    fn new(encoder: &SpikingEncoder, values: &[f32], frames: &[Vec<usize>]) -> Self {
        let (mut layout, mut convs, mut inputs) = (Layout::default(), Vec::new(), 1);
        let mut side = encoder.shape.side;
        for (index, outputs) in encoder.shape.channels.iter().enumerate() {
            let name = format!("encoder.{}", index + 1);
            convs.push(Conv::new(&mut layout, &name, (inputs, *outputs), side, HALVING));
            (inputs, side) = (*outputs, side / 2);
        }
        let mut input = vec![0.0; frames.len() * encoder.shape.side * encoder.shape.side];
        let pixels = encoder.shape.side * encoder.shape.side;
        for (step, frame) in frames.iter().enumerate() {
            frame.iter().for_each(|pixel| input[step * pixels + pixel] = 1.0);
        }
        let mut traces: Vec<LifTrace<Rectangular>> = Vec::new();
        for conv in &convs {
            let below = traces.last().map_or(&input, |trace| &trace.spikes);
            let drive = conv.forward(values, below);
            let mut state = LifState::rest(conv.output_size());
            traces.push(encoder.shape.lif.forward(0.5, &drive, &mut state));
        }
        Self { layout, convs, traces, input }
    }

    /// Gradient of the convolutions, given that of the last voltages of all steps.
    fn backward(&self, encoder: &SpikingEncoder, values: &[f32], d_voltage: &[f32]) -> Vec<f32> {
        let mut gradient = self.layout.zeros();
        let mut d_spikes: Option<Vec<f32>> = None;
        for (index, conv) in self.convs.iter().enumerate().rev() {
            let read = (index + 1 == self.convs.len()).then_some(d_voltage);
            let d = encoder.shape.lif.backward(&self.traces[index], d_spikes.as_deref(), read);
            let below =
                index.checked_sub(1).map_or(&self.input, |below| &self.traces[below].spikes);
            conv.backward(&mut gradient, below, &d.drive);
            d_spikes = Some(conv.backward_input(values, &d.drive));
        }
        gradient
    }
}

#[test]
fn voltages_and_gradients_equal_those_of_dense_convolutions() {
    for channels in [&[16, 32, 16, 1][..], &[3, 2]] {
        let encoder = SpikingEncoder::new(&shape(channels));
        let (values, frames) = (values(&encoder, 1.5), frames(6, 16));
        let tape = run::<Rectangular>(&encoder, &values, &frames);
        let dense = Dense::new(&encoder, &values, &frames);
        let last = dense.traces.last().unwrap();
        let n = last.neurons();
        let found: Vec<f32> = (1..=6).flat_map(|at| encoder.read(&tape, at)).collect();
        assert!(last.spikes.iter().any(|s| *s > 0.0), "no spike reaches the last layer");
        for (found, expected) in found.iter().zip(&last.voltage) {
            assert!((found - expected).abs() < 1e-4, "{channels:?}: {found} {expected}");
        }
        let d_state = gaussians(9, encoder.shape.latent);
        let mut gradient = encoder.layout().zeros();
        let weights = encoder.lay_out(&values);
        let d_states = [(3, &d_state[..]), (6, &d_state[..])];
        encoder.backward::<Rectangular>(&weights, &tape, &d_states, 0.0, &mut gradient);
        let d_read = encoder.readout.backward_input(&values, &d_state);
        let mut d_voltage = vec![0.0; 6 * n];
        d_voltage[2 * n..3 * n].copy_from_slice(&d_read);
        d_voltage[5 * n..].copy_from_slice(&d_read);
        let expected = dense.backward(&encoder, &values, &d_voltage);
        let largest = expected.iter().fold(0.0f32, |most, d| most.max(d.abs()));
        assert!(largest > 1e-2, "nothing to compare");
        for (at, (found, expected)) in gradient.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < 1e-4 * largest.max(1.0), "{at}: {found} {expected}");
        }
    }
}

#[test]
fn gradients_equal_finite_differences_across_the_start_of_an_episode() {
    let encoder = SpikingEncoder::new(&shape(&[16, 2]));
    let (values, frames) = (values(&encoder, 2.0), frames(7, 16));
    let weights: Vec<f32> = gaussians(4, 2 * encoder.shape.latent);
    let parts: Vec<&[f32]> = weights.chunks(encoder.shape.latent).collect();
    let fly = |values: &[f32]| {
        let (laid, mut tape) = (encoder.lay_out(values), encoder.tape(true));
        let mut states = Vec::new();
        for (number, frame) in frames.iter().enumerate() {
            if number == 4 {
                tape.reset();
            }
            encoder.step::<Smooth>(&laid, &mut tape, frame.iter().copied());
            if number == 3 || number == 6 {
                states.push((tape.newest(), encoder.state(&laid, &tape)));
            }
        }
        (laid, tape, states)
    };
    let (laid, tape, states) = fly(&values);
    let d_states: Vec<(usize, &[f32])> =
        states.iter().zip(&parts).map(|((at, _), d)| (*at, *d)).collect();
    let mut gradient = encoder.layout().zeros();
    encoder.backward::<Smooth>(&laid, &tape, &d_states, 0.7, &mut gradient);
    let loss = |values: &[f32]| {
        let (_, tape, states) = fly(values);
        let seen: f64 = states.iter().zip(&parts).map(|((_, s), d)| weighted(s, d)).sum();
        // What is sent, in place of spikes counted.
        let frames = tape.frames.iter().skip(1).filter(|frame| !frame.rest);
        let sent = frames.flat_map(|frame| frame.spikes.iter().zip(encoder.neurons()));
        let sent = sent.map(|(all, n)| all.iter().map(|s| f64::from(s.1)).sum::<f64>() / n as f64);
        seen + 0.7 * sent.sum::<f64>() / (7.0 * 2.0)
    };
    for entry in encoder.layout().entries() {
        let moved = |part: &[f32]| {
            let mut moved = values.clone();
            entry.slot.of_mut(&mut moved).copy_from_slice(part);
            loss(&moved)
        };
        check(&entry.name, entry.slot.of(&values), entry.slot.of(&gradient), moved);
    }
}

#[test]
fn state_goes_on_when_frames_are_forgotten_and_starts_anew_after_a_reset() {
    let encoder = SpikingEncoder::new(&shape(&[16, 1]));
    let (values, frames) = (values(&encoder, 1.5), frames(6, 16));
    let weights = encoder.lay_out(&values);
    let whole = run::<Rectangular>(&encoder, &values, &frames);
    let mut cut = run::<Rectangular>(&encoder, &values, &frames[..3]);
    cut.forget();
    assert_eq!(cut.newest(), 0);
    let mut bare = encoder.tape(false);
    for frame in &frames {
        encoder.step::<Rectangular>(&weights, &mut bare, frame.iter().copied());
    }
    frames[3..]
        .iter()
        .for_each(|f| encoder.step::<Rectangular>(&weights, &mut cut, f.iter().copied()));
    let expected = encoder.state(&weights, &whole);
    assert_eq!(encoder.state(&weights, &cut), expected);
    assert_eq!(encoder.state(&weights, &bare), expected);
    assert_eq!((cut.newest(), bare.newest(), whole.newest()), (3, 0, 6));
    cut.reset();
    frames.iter().for_each(|f| encoder.step::<Rectangular>(&weights, &mut cut, f.iter().copied()));
    assert_eq!(encoder.state(&weights, &cut), expected);
}

/// What an actor does with robot state and the DVS states of two ticks.
fn acted(
    (encoder, actor): (&SpikingEncoder, &Actor),
    values: &[f32],
    frames: &[Vec<usize>],
) -> (Tape, Vec<usize>, ActorTrace<Smooth>) {
    let (laid, mut tape) = (encoder.lay_out(values), encoder.tape(true));
    let (mut seen, mut read) = (Vec::new(), Vec::new());
    for tick in frames.chunks(3) {
        tick.iter().for_each(|f| encoder.step::<Smooth>(&laid, &mut tape, f.iter().copied()));
        seen.extend([0.3, -0.4]);
        seen.extend(encoder.state(&laid, &tape));
        read.push(tape.newest());
    }
    let streams = Streams::new(7, 0);
    let draws =
        SpikeDraws { streams: &streams, name: stream::POPULATION_SPIKES, update: 0, first: 0 };
    let actor_values = actor.initial(&streams).values;
    (tape, read, actor.forward(&actor_values, &seen, &draws))
}

#[test]
fn gradients_through_the_actor_equal_finite_differences() {
    let encoder = SpikingEncoder::new(&shape(&[4, 3, 1]));
    let latent = encoder.shape.latent;
    let actor = Actor::new(&ActorShape {
        laser: vec![(-1.0, 1.0); 2],
        dvs: vec![(-2.0, 2.0); latent],
        population: 4,
        fused: 8,
        hidden: vec![8],
        steps: 4,
        ..ActorShape::eem_san()
    });
    let (values, frames) = (values(&encoder, 2.0), frames(6, 16));
    let weights = [300.0, -200.0, 100.0, 250.0];
    let parts = (&encoder, &actor);
    let (tape, read, trace) = acted(parts, &values, &frames);
    let actor_values = actor.initial(&Streams::new(7, 0)).values;
    let d = actor.backward(&actor_values, &mut actor.layout().zeros(), &trace, &weights);
    let d_states: Vec<(usize, &[f32])> =
        read.iter().zip(d.chunks(2 + latent)).map(|(at, d)| (*at, &d[2..])).collect();
    let mut gradient = encoder.layout().zeros();
    let laid = encoder.lay_out(&values);
    encoder.backward::<Smooth>(&laid, &tape, &d_states, 0.0, &mut gradient);
    for entry in encoder.layout().entries() {
        let loss = |part: &[f32]| {
            let mut moved = values.clone();
            entry.slot.of_mut(&mut moved).copy_from_slice(part);
            weighted(&acted(parts, &moved, &frames).2.action, &weights)
        };
        check(&entry.name, entry.slot.of(&values), entry.slot.of(&gradient), loss);
    }
}
