use proptest::prelude::*;

use super::*;
use crate::cost::{Ops, Row, Shape, closed_form};
use crate::net::eem_san::FRAMES_PER_TICK;
use crate::net::{Branch, ConvLayer, EncoderKind, EventEncoder, Layer, PopulationCode, Readout};
use crate::policy::{EventFrame, Policy};
use crate::reference::event_encoder::FloatEncoder;
use crate::reference::{EemSanPolicy, eem_san::FloatDecision};
use crate::rng::Draw;

/// Sizes of a network: convolutions by channels, then branches, fused group, hidden layers.
#[derive(Debug, Clone)]
struct Sizes {
    side: usize,
    channels: Vec<usize>,
    latent: usize,
    dimensions: [usize; 2],
    population: usize,
    fused: usize,
    hidden: Vec<usize>,
}

impl Sizes {
    fn eem_san() -> Self {
        Self {
            side: 128,
            channels: vec![16, 32, 16, 1],
            latent: 64,
            dimensions: [22, 64],
            population: 10,
            fused: 20,
            hidden: vec![256; 3],
        }
    }
}

/// Numbers around 0, none of which is 0.
fn numbers(draw: &mut Draw, n: usize, scale: f64) -> Vec<f32> {
    let number = |_| {
        let size = draw.uniform_in(0.01, 1.0) * scale;
        (if draw.bernoulli(0.45) { -size } else { size }) as f32
    };
    (0..n).map(number).collect()
}

fn layer(draw: &mut Draw, name: String, inputs: usize, neurons: usize) -> Layer {
    let weights = numbers(draw, inputs * neurons, 1.5 / (inputs as f64).sqrt());
    let bias = numbers(draw, neurons, 0.1);
    Layer {
        name,
        inputs,
        neurons,
        weights,
        bias,
        keep_current: 0.5,
        keep_voltage: 0.75,
        threshold: 0.4,
    }
}

fn network(sizes: &Sizes, draw: &mut Draw) -> EemSan {
    let (mut convs, mut inputs, mut side) = (Vec::new(), 1, sizes.side);
    for (index, outputs) in sizes.channels.iter().enumerate() {
        convs.push(ConvLayer {
            name: format!("encoder.{}", index + 1),
            inputs,
            outputs: *outputs,
            side,
            weights: numbers(draw, inputs * outputs * 16, 1.0 / (inputs as f64).sqrt()),
            bias: numbers(draw, *outputs, 0.05),
        });
        (inputs, side) = (*outputs, side / 2);
    }
    let last = inputs * side * side;
    let readout = Readout {
        weights: numbers(draw, last * sizes.latent, 0.3),
        bias: numbers(draw, sizes.latent, 0.3),
    };
    let branch = |draw: &mut Draw, name: &str, dimensions: usize| {
        let n = dimensions * sizes.population;
        let (neurons, mean) = (sizes.population, numbers(draw, n, 1.0));
        let code = PopulationCode { neurons, mean, deviation: vec![0.5; n] };
        let layer = Some(layer(draw, format!("fuse.{name}"), n, sizes.fused));
        Branch { code: StateCode::Population(code), layer }
    };
    let laser = branch(draw, "laser", sizes.dimensions[0]);
    let dvs = branch(draw, "dvs", sizes.dimensions[1]);
    let (mut decision, mut inputs) = (Vec::new(), sizes.fused);
    for (index, neurons) in sizes.hidden.iter().chain(&[2]).enumerate() {
        decision.push(layer(draw, format!("decision.{}", index + 1), inputs, *neurons));
        inputs = *neurons;
    }
    let encoder = EventEncoder {
        kind: EncoderKind::Hsvae,
        layers: convs,
        threshold: 0.5,
        keep_current: 0.5,
        keep_voltage: 0.75,
        readout,
    };
    EemSan {
        told: false,
        name: "random".into(),
        steps: 5,
        encoder: Some(encoder),
        laser,
        dvs: Some(dvs),
        decision,
        dynamic: None,
    }
}

fn frames(draw: &mut Draw, side: usize, share: f64) -> Vec<Vec<usize>> {
    let mut frame = |_| (0..side * side).filter(|_| draw.bernoulli(share)).collect();
    (0..FRAMES_PER_TICK).map(&mut frame).collect()
}

fn spikes(draw: &mut Draw, lines: usize, share: f64) -> InputSpikes {
    (0..5).map(|_| (0..lines).map(|_| draw.bernoulli(share)).collect()).collect()
}

/// Runs some ticks of everything and compares with the closed form; gives the counts.
fn check(sizes: &Sizes, seed: u64, ticks: u64, share: f64) -> Modules<Counts> {
    let mut draw = Streams::new(seed, 0).at(stream::STIMULUS, 0);
    let network = network(sizes, &mut draw);
    let shape = Shape::of(&network).expect("there is an encoder");
    let mut counted = CountedEemSan::new(&network).expect("there is an encoder");
    let mut counts = Modules::<Counts>::default();
    let mut activity = Modules::<Activity>::default();
    for _ in 0..ticks {
        let frames = frames(&mut draw, sizes.side, share);
        let inputs = [0, 1]
            .map(|branch| spikes(&mut draw, sizes.dimensions[branch] * sizes.population, share));
        let encoded = counted.spiking_encoder.tick(&frames);
        counts.spiking_encoder += encoded.counts;
        activity.spiking_encoder += &encoded.activity;
        let encoded = counted.artificial_encoder.tick(&frames);
        counts.artificial_encoder += encoded.counts;
        activity.artificial_encoder += &encoded.activity;
        let decided = counted.spiking_decision.tick(&inputs);
        counts.spiking_decision += decided.counts;
        activity.spiking_decision += &decided.activity;
        let decided = counted.artificial_decision.tick(&inputs);
        counts.artificial_decision += decided.counts;
        activity.artificial_decision += &decided.activity;
        assert!(decided.output.iter().all(|a| (0.0..=1.0).contains(a)), "{:?}", decided.output);
    }
    let formula = closed_form(&shape, &activity, ticks);
    for row in Row::ALL {
        let (ours, closed) = (row.counts(&counts), row.counts(&formula));
        assert_eq!(ours, closed, "row {}, seed {seed}, {sizes:?}", row.number());
    }
    assert_eq!(counts, formula, "seed {seed}, {sizes:?}");
    counts
}

fn sizes() -> impl Strategy<Value = Sizes> {
    let convs = (1usize..4)
        .prop_flat_map(|n| (Just(n), 0usize..2, proptest::collection::vec(1usize..5, n)));
    let rest = (1usize..6, [1usize..4, 1usize..4], 1usize..4, 1usize..8);
    (convs, rest, proptest::collection::vec(1usize..9, 0..3)).prop_map(
        |((n, more, channels), (latent, dimensions, population, fused), hidden)| Sizes {
            side: 1 << (n + more),
            channels,
            latent,
            dimensions,
            population,
            fused,
            hidden,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn counted_equals_closed_form_for_small_networks(
        sizes in sizes(),
        seed in any::<u64>(),
        ticks in 1u64..4,
        share in 0.0f64..0.6,
    ) {
        check(&sizes, seed, ticks, share);
    }
}

#[test]
fn counted_equals_closed_form_for_eem_san() {
    let counts = check(&Sizes::eem_san(), 1, 1, 0.02);
    let paper = |row: Row| row.counts(&counts).paper;
    assert_eq!(paper(Row::SpikingSpiking).multiplications, 5_242_880);
    assert_eq!(paper(Row::ArtificialSpiking).multiplications, 57_794_560);
    assert_eq!(paper(Row::SpikingArtificial).multiplications, 8_517_920);
    assert_eq!(paper(Row::ArtificialArtificial).multiplications, 61_069_600);
    assert_eq!(paper(Row::ArtificialArtificial).additions, 61_586_610);
}

#[test]
fn counted_encoder_has_the_state_and_spikes_of_the_float_encoder() {
    let mut draw = Streams::new(2, 0).at(stream::STIMULUS, 0);
    let sizes = Sizes { channels: vec![4, 3, 1], latent: 5, ..Sizes::eem_san() };
    let network = network(&Sizes { dimensions: [22, 5], ..sizes }, &mut draw);
    let encoder = network.encoder.as_ref().expect("it was made with one");
    let (mut counted, mut float) = (SpikingEncoder::new(encoder), FloatEncoder::new(encoder));
    let mut fired = vec![0; 3];
    for _ in 0..3 {
        let frames = frames(&mut draw, 128, 0.02);
        let done = counted.tick(&frames);
        frames.iter().for_each(|frame| float.step(&event_frame(frame)));
        fired.iter_mut().zip(&done.activity.fired).for_each(|(sum, n)| *sum += n);
        for (ours, theirs) in done.output.iter().zip(float.state()) {
            assert!((ours - theirs).abs() < 1e-4, "{ours} {theirs}");
        }
    }
    assert!(fired.iter().all(|n| *n > 100), "the test needs spikes: {fired:?}");
    assert_eq!(fired, float.spikes());
}

#[test]
fn counted_decision_spikes_as_the_float_decision() {
    let mut draw = Streams::new(3, 0).at(stream::STIMULUS, 0);
    let network = network(&Sizes { channels: vec![1], side: 2, ..Sizes::eem_san() }, &mut draw);
    let (mut counted, mut float) = (SpikingDecision::new(&network), FloatDecision::new(&network));
    for _ in 0..5 {
        let inputs = [spikes(&mut draw, 220, 0.2), spikes(&mut draw, 640, 0.2)];
        let (done, wanted) = (counted.tick(&inputs), float.decide(&inputs));
        let sum = |steps: &Vec<u32>| steps.iter().map(|n| u64::from(*n)).sum::<u64>();
        let spikes: Vec<u64> = wanted.layer_counts.iter().map(sum).collect();
        assert!(spikes.iter().take(5).all(|n| *n > 0), "the test needs spikes: {spikes:?}");
        assert_eq!(done.activity.fired, spikes);
        assert_eq!(done.output, wanted.output_counts);
    }
}

#[test]
fn zero_weights_are_no_effective_operations() {
    let mut draw = Streams::new(4, 0).at(stream::STIMULUS, 0);
    let mut network = network(&Sizes { channels: vec![1], side: 2, ..Sizes::eem_san() }, &mut draw);
    network.decision.iter_mut().for_each(|layer| layer.weights.fill(0.0));
    let inputs = [spikes(&mut draw, 220, 1.0), spikes(&mut draw, 640, 1.0)];
    let counts = SpikingDecision::new(&network).tick(&inputs).counts.neurobench;
    assert_eq!(counts.dense, 769_520);
    assert_eq!((counts.effective_acs, counts.effective_macs), (5 * 860 * 20, 0));
}

#[test]
fn first_layer_on_pictures_and_on_events_has_the_same_drive() {
    let mut draw = Streams::new(5, 0).at(stream::STIMULUS, 0);
    let network = network(&Sizes { channels: vec![3], side: 16, ..Sizes::eem_san() }, &mut draw);
    let conv = conv::Conv::new(&network.encoder.expect("it was made with one").layers[0]);
    let events = frames(&mut draw, 16, 0.3).remove(0);
    let mut counts = Counts::default();
    let picture = spiking::picture(&conv, &events);
    assert_eq!(conv.multiply(&picture, &mut counts), conv.receive(&events, &mut counts));
}

#[test]
fn whole_network_acts_as_the_policy() {
    let mut draw = Streams::new(6, 0).at(stream::STIMULUS, 0);
    let sizes = Sizes { channels: vec![2, 1], latent: 64, ..Sizes::eem_san() };
    let network = network(&sizes, &mut draw);
    let streams = Streams::new(7, 3);
    let (mut counted, mut policy) =
        (CountedEemSan::new(&network).expect("it has an encoder"), EemSanPolicy::new(&network));
    policy.start_trial(streams);
    for tick in 0..4 {
        let frames = frames(&mut draw, 128, 0.02);
        let observation = observation(&frames);
        let action = policy.act(&observation, tick);
        let done = counted.tick(&observation, streams, tick);
        assert_eq!(crate::coding::decode(&done.output_counts, 5), action, "tick {tick}");
    }
}

/// The networks that EEM-SAN is compared with, from one with all parts.
fn others(draw: &mut Draw) -> Vec<EemSan> {
    let sizes = Sizes { channels: vec![2, 1], latent: 64, ..Sizes::eem_san() };
    let whole = network(&sizes, draw);
    let kind = |kind: EncoderKind| {
        let mut network = whole.clone();
        network.name = kind.name().into();
        let encoder = network.encoder.as_mut().expect("it has one");
        encoder.kind = kind;
        network
    };
    let mut addition = kind(EncoderKind::Hsvae);
    addition.name = "addition".into();
    addition.laser.layer = None;
    addition.dvs.as_mut().expect("it has one").layer = None;
    addition.decision[0] = layer(draw, "decision.1".into(), 220 + 640, 256);
    let mut rate = addition.clone();
    rate.name = "rate".into();
    (rate.encoder, rate.dvs) = (None, None);
    rate.laser.code = StateCode::Rate;
    rate.decision[0] = layer(draw, "decision.1".into(), 24, 256);
    let mut moving = rate.clone();
    moving.name = "moving".into();
    moving.dynamic = Some(crate::net::Bdett {
        initial: 0.5,
        temporal_scale: 3.0,
        energy_share: 0.5,
        spread: 0.2,
        energy_slope: 0.01,
        energy_scale: 4.0,
    });
    vec![kind(EncoderKind::Hsvae), kind(EncoderKind::Fsvae), addition, rate, moving]
}

#[test]
fn every_network_acts_as_its_policy_and_does_what_its_spikes_ask_for() {
    let mut draw = Streams::new(8, 0).at(stream::STIMULUS, 0);
    for network in others(&mut draw) {
        let streams = Streams::new(9, 1);
        let mut counted = CountedNetwork::new(&network);
        let mut policy = EemSanPolicy::new(&network);
        // The second trial begins as the first one did.
        for trial in 0..2 {
            policy.start_trial(streams);
            counted.reset();
            for tick in 0..3 {
                let frames = frames(&mut draw, 128, 0.02);
                let observation = observation(&frames);
                let (action, spikes) = policy.act_watched(&observation, tick);
                let (output, counts) = counted.tick(&observation, streams, tick);
                let name = &network.name;
                let said = format!("{name}, trial {trial}, tick {tick}");
                assert_eq!(crate::coding::decode(&output, 5), action, "{said}");
                if network.encoder.is_some() {
                    continue;
                }
                // Inputs are drawn anew from the same stream.
                let activity = network.laser.code.activity(&robot_state(&observation));
                let mut draw = streams.at(stream::LASER_POPULATION, tick);
                let inputs = population_spikes(&activity, 5, &mut draw);
                let n =
                    |spikes: usize, layer: usize| (spikes * network.decision[layer].neurons) as u64;
                let into = inputs.iter().flatten().filter(|spike| **spike).count();
                let mut sums = n(into, 0);
                for (index, layer) in spikes.iter().enumerate().take(network.decision.len() - 1) {
                    sums += n(layer.iter().map(Vec::len).sum(), index + 1);
                }
                let layers = network.decision.len() as u64;
                let neurons: u64 = network.decision.iter().map(|l| l.neurons as u64).sum();
                let [per_neuron, per_layer] = match network.dynamic {
                    None => [[2, 2], [0, 0]],
                    Some(_) => [[2 + 8, 2 + 5], [4, 4]],
                };
                sums += 5 * (neurons * per_neuron[0] + layers * per_layer[0]);
                let products = 5 * (neurons * per_neuron[1] + layers * per_layer[1]);
                let exact = Ops { additions: sums, multiplications: products };
                assert_eq!(counts.exact, exact, "{said}");
            }
        }
    }
}

#[test]
fn artificial_encoder_of_the_comparison_has_the_state_of_the_float_encoder() {
    let mut draw = Streams::new(10, 0).at(stream::STIMULUS, 0);
    let sizes = Sizes { channels: vec![4, 3, 2], latent: 5, ..Sizes::eem_san() };
    let mut network = network(&Sizes { dimensions: [22, 5], ..sizes }, &mut draw);
    let encoder = network.encoder.as_mut().expect("it was made with one");
    encoder.kind = EncoderKind::Avae;
    let (mut counted, mut float) = (AvaeEncoder::new(encoder), FloatEncoder::new(encoder));
    for _ in 0..2 {
        let frames = frames(&mut draw, 128, 0.02);
        let done = counted.tick(&frames);
        frames.iter().for_each(|frame| float.step(&event_frame(frame)));
        for (ours, theirs) in done.output.iter().zip(float.state()) {
            assert!((ours - theirs).abs() < 1e-3, "{ours} {theirs}");
        }
        // Taps inside of the picture, by sizes; mu once.
        let products: u64 = encoder
            .layers
            .iter()
            .map(|layer| {
                let taps = 2 * layer.side as u64 - 2;
                5 * (layer.inputs * layer.outputs) as u64 * taps * taps
            })
            .sum::<u64>()
            + encoder.readout.weights.len() as u64;
        assert_eq!(done.counts.exact, Ops { additions: products, multiplications: products });
    }
}

fn observation(frames: &[Vec<usize>]) -> Observation {
    Observation {
        told: Vec::new(),
        goal_direction_rad: 0.4,
        goal_distance_m: 5.0,
        linear_m_per_s: 0.3,
        angular_rad_per_s: -0.2,
        laser_m: [1.5; crate::policy::LASER_SECTORS],
        wheel_speed_m_per_s_max: 1.0,
        frames: frames.iter().map(|frame| event_frame(frame)).collect(),
    }
}

fn event_frame(active: &[usize]) -> EventFrame {
    let mut frame = EventFrame::default();
    active.iter().for_each(|pixel| frame.set(pixel % 128, pixel / 128));
    frame
}
