//! EEM-SAN on the chip: against the fixed-point reference spike for spike, against the float
//! network, and through the command line.

use std::sync::Arc;

use hw_model::{ChipSpec, DenseEngine, Engine, EventEngine};
use spikeloop::coding::{InputSpikes, LayerSpikes, population_spikes};
use spikeloop::compile::policy::POLICIES;
use spikeloop::compile::{Policy, Split, quantize_eem_san};
use spikeloop::evaluate::{Agreement, Comparison};
use spikeloop::host::{Deployment, EemSanChipPolicy, Schedule};
use spikeloop::net::EemSan;
use spikeloop::nn::{Actor, ActorShape, Hsvae, HsvaeShape, StateWriter, Variant};
use spikeloop::policy::{Action, EventFrame, Observation, Policy as _};
use spikeloop::reference::{EemSanPolicy, FixedEemSan};
use spikeloop::rng::{Streams, stream};

use crate::bad_input::refused;
use crate::cli::Folder;
use crate::fixtures::{Change, eem_san, network};

/// Weights at which every layer spikes and no layer always does.
fn lively(name: &str, values: &mut [f32]) {
    let (scale, shift) = match name {
        _ if name.starts_with("hsvae.encoder.1.") => (1.0, 0.05),
        _ if name.starts_with("hsvae.encoder.") && name.ends_with(".bias") => (0.2, 0.005),
        _ if name.starts_with("hsvae.encoder.") => (0.4, 0.01),
        "hsvae.mu.weight" => (4.0, 0.0),
        _ if name.starts_with("actor.fuse.") && name.ends_with(".weight") => (3.0, 0.05),
        "actor.decision.1.weight" if values.len() > 7 * 5 => (3.0, 0.05),
        _ if name.starts_with("actor.decision.") && name.ends_with(".weight") => (2.0, 0.02),
        _ => (1.0, 0.0),
    };
    values.iter_mut().for_each(|value| *value = scale * *value + shift);
}

const LIVELY: Change = &|name, _, values| lively(name, values);

fn small(frames: bool) -> EemSan {
    EemSan::from_bytes("small", "small", &eem_san(frames, LIVELY)).unwrap()
}

/// A small network of the table.
fn of_table(name: &str) -> EemSan {
    let variant = Variant::named(name).unwrap();
    let livelier: Change = &|name, _, values| {
        lively(name, values);
        if name == "actor.decision.2.weight" {
            values.iter_mut().for_each(|value| *value += 0.25);
        }
    };
    EemSan::from_bytes(name, name, &network(variant.form, variant.events, livelier)).unwrap()
}

/// EEM-SAN's sizes with random weights.
fn full() -> EemSan {
    let mut state = StateWriter::default();
    let shape = HsvaeShape::eem_san();
    let mut hsvae = Hsvae::new(&shape).initial(&Streams::new(1, 0));
    hsvae.values.iter_mut().for_each(|value| *value = 1.5 * *value + 0.002);
    state.parameters("hsvae.", &hsvae);
    state.floats("hsvae.threshold", &[1], &[shape.threshold]);
    state.floats("hsvae.latent.mean", &[shape.latent()], &vec![0.0; shape.latent()]);
    state.floats("hsvae.latent.deviation", &[shape.latent()], &vec![1.0; shape.latent()]);
    let actor = Actor::new(&ActorShape::eem_san()).initial(&Streams::new(1, 1));
    state.parameters("actor.", &actor);
    EemSan::from_bytes("full", "full", &state.bytes()).unwrap()
}

/// Frames of a tick: a bar of noise that moves on.
fn frames(tick: u64) -> Vec<EventFrame> {
    let mut draw = Streams::new(3, 0).at(stream::STIMULUS, tick);
    let frame = |step: usize| {
        let mut frame = EventFrame::default();
        let first = (8 * (5 * tick as usize + step)) % 96;
        (0..600).for_each(|_| frame.set(first + draw.below(32) as usize, draw.below(128) as usize));
        frame
    };
    (0..5).map(frame).collect()
}

/// Random codes for every branch.
fn codes(network: &EemSan, tick: u64) -> Vec<InputSpikes> {
    let mut draw = Streams::new(4, 0).at(stream::STIMULUS, tick);
    let code = |lines: usize| population_spikes(&vec![0.4; lines], network.steps, &mut draw);
    network.branches().map(|branch| branch.code.lines()).map(code).collect()
}

fn spikes_of(layers: &LayerSpikes) -> Vec<usize> {
    layers.iter().map(|steps| steps.iter().map(Vec::len).sum()).collect()
}

/// Chip and fixed-point reference side by side; spikes of every layer over all ticks.
fn compare(
    network: &EemSan,
    policy: &Policy,
    ticks: u64,
    engine: impl Fn(&Deployment) -> Box<dyn Engine>,
) -> Vec<usize> {
    let chip = ChipSpec::loihi1();
    let quantized = quantize_eem_san(network, policy, &chip).unwrap();
    let mut fixed = FixedEemSan::new(network, &quantized, &chip);
    let deployment =
        Deployment::compile_eem_san(network, policy, &chip, Split::Fewest, Schedule::Held).unwrap();
    let mut on_chip = EemSanChipPolicy::new(&deployment, engine(&deployment)).unwrap();
    on_chip.watch(true);
    let mut sums = vec![0; network.layers().len()];
    for episode in 0..2 {
        on_chip.start_trial(Streams::new(1, episode));
        fixed.reset();
        for tick in 0..ticks {
            let (frames, codes) = (frames(tick + 10 * episode), codes(network, tick));
            let voltages = on_chip.encode(&frames);
            let mut expected = fixed.encode(&frames);
            assert_eq!(voltages, fixed.latent_voltages(), "{} tick {tick}", policy.name);
            let counts = on_chip.decide(&codes);
            let (decision, spikes) = fixed.decide(&codes);
            assert_eq!(counts, decision.output_counts, "{} tick {tick}", policy.name);
            expected.extend(spikes);
            let seen = on_chip.take_spikes();
            assert!(seen == expected, "{}: spikes differ at tick {tick}", policy.name);
            sums.iter_mut().zip(spikes_of(&seen)).for_each(|(sum, n)| *sum += n);
        }
    }
    let used = on_chip.chip_use();
    assert_eq!(used.counts.deliveries_while_held, 0);
    assert_eq!(used.decisions, 2 * ticks);
    sums
}

fn event(deployment: &Deployment) -> Box<dyn Engine> {
    Box::new(EventEngine::new(Arc::clone(&deployment.map)))
}

fn on_two_threads(deployment: &Deployment) -> Box<dyn Engine> {
    Box::new(EventEngine::with_threads(Arc::clone(&deployment.map), 2))
}

fn dense(deployment: &Deployment) -> Box<dyn Engine> {
    Box::new(DenseEngine::new(Arc::clone(&deployment.map)))
}

#[test]
fn chip_equals_the_fixed_point_reference_in_every_layer_by_every_policy() {
    let network = small(true);
    for policy in POLICIES {
        let spikes = compare(&network, &policy, 6, event);
        println!("{}: {spikes:?}", policy.name);
        for ((layer, neurons), spikes) in network.layers().iter().zip(spikes) {
            let share = spikes as f64 / (60 * neurons) as f64;
            // Layers of a few neurons may all spike in every step.
            let partial = share > 0.0 && (share < 1.0 || *neurons <= 16);
            assert!(partial, "{layer}: {share}; all or nothing tests little");
        }
    }
}

#[test]
fn every_engine_equals_the_fixed_point_reference() {
    let (network, nearest) = (small(true), Policy::named("nearest").unwrap());
    let expected = compare(&network, &nearest, 2, event);
    assert_eq!(compare(&network, &nearest, 2, on_two_threads), expected);
    assert_eq!(compare(&network, &nearest, 2, dense), expected);
}

/// FSVAE's encoder, cleared after each control tick.
#[test]
fn an_encoder_that_forgets_equals_the_fixed_point_reference() {
    let forgets: Change = &|name, shape, values| {
        lively(name, values);
        if name == "hsvae.kind" {
            (*shape, *values) = (vec![1], vec![2.0]);
        }
    };
    let network = EemSan::from_bytes("fsvae", "fsvae", &eem_san(true, forgets)).unwrap();
    let nearest = Policy::named("nearest").unwrap();
    let spikes = compare(&network, &nearest, 6, event);
    assert!(spikes.iter().all(|n| *n > 0), "{spikes:?}");
    assert_ne!(spikes, compare(&small(true), &nearest, 6, event));
    let expected = compare(&network, &nearest, 2, event);
    assert_eq!(compare(&network, &nearest, 2, on_two_threads), expected);
    assert_eq!(compare(&network, &nearest, 2, dense), expected);
    let (chip, schedule) = (ChipSpec::loihi1(), Schedule::Held);
    let deployment =
        Deployment::compile_eem_san(&network, &nearest, &chip, Split::Fewest, schedule).unwrap();
    assert_eq!(deployment.eem_san.as_ref().unwrap().schedule, Schedule::HeldCleared);
    let read = Deployment::from_bytes("fsvae", &deployment.to_bytes()).unwrap();
    assert_eq!(read.eem_san, deployment.eem_san);
    let agreed = compared(&network, &read);
    for layer in &agreed.layers {
        assert!(layer.share().is_some_and(|share| share > 0.9) && layer.float > 0, "{layer:?}");
    }
}

#[test]
fn the_laser_only_control_equals_the_fixed_point_reference() {
    let (network, nearest) = (small(false), Policy::named("nearest").unwrap());
    let spikes = compare(&network, &nearest, 6, event);
    assert!(spikes.iter().all(|n| *n > 0), "{spikes:?}");
}

#[test]
fn peers_and_ablations_equal_the_fixed_point_reference() {
    for name in ["san", "popsan", "naive", "fixed"] {
        let network = of_table(name);
        for policy in ["nearest", "san"].map(|policy| Policy::named(policy).unwrap()) {
            let spikes = compare(&network, &policy, 6, event);
            assert!(spikes.iter().all(|n| *n > 0), "{name} {}: {spikes:?}", policy.name);
        }
        let nearest = Policy::named("nearest").unwrap();
        let expected = compare(&network, &nearest, 2, event);
        assert_eq!(compare(&network, &nearest, 2, on_two_threads), expected, "{name}");
        assert_eq!(compare(&network, &nearest, 2, dense), expected, "{name}");
    }
}

#[test]
fn streaming_equals_the_fixed_point_reference_with_its_delays() {
    for network in [small(true), of_table("naive"), of_table("fixed")] {
        streaming_equals_the_fixed_point_reference(&network);
    }
}

/// The fixed-point reference with the delays of the schedule: layer `k` of the encoder is `k` steps
/// behind the frames, a decision's window begins a tick after its codes and a step per layer.
fn streaming_equals_the_fixed_point_reference(network: &EemSan) {
    const TICKS: u64 = 6;
    let nearest = Policy::named("nearest").unwrap();
    let chip = ChipSpec::loihi1();
    let quantized = quantize_eem_san(network, &nearest, &chip).unwrap();
    let schedule = Schedule::Streaming;
    let deployment =
        Deployment::compile_eem_san(network, &nearest, &chip, Split::Fewest, schedule).unwrap();
    for engine in [event(&deployment), on_two_threads(&deployment), dense(&deployment)] {
        let mut fixed = FixedEemSan::new(network, &quantized, &chip);
        let mut on_chip = EemSanChipPolicy::new(&deployment, engine).unwrap();
        on_chip.watch(true);
        on_chip.start_trial(Streams::new(1, 0));
        // Chip: spikes of every layer in every step. Reference: the same by frame and by code.
        let n_encoder = quantized.encoder_layers;
        let n = quantized.layers.len();
        let (mut seen, mut expected) = (vec![Vec::new(); n], vec![Vec::new(); n]);
        let (mut voltages, mut latent) = (Vec::new(), Vec::new());
        let (mut counts, mut decisions) = (Vec::new(), Vec::new());
        for tick in 0..TICKS {
            let frames = frames(tick);
            let codes = if tick == 0 { Vec::new() } else { codes(network, tick) };
            let done = on_chip.stream(&frames, &codes);
            voltages.push(done.0);
            counts.push(done.1);
            let spikes = on_chip.take_spikes();
            seen.iter_mut().zip(spikes).for_each(|(all, tick)| all.extend(tick));
            for frame in &frames {
                let spikes = fixed.encode(std::slice::from_ref(frame));
                expected.iter_mut().zip(spikes).for_each(|(all, step)| all.extend(step));
                latent.push(fixed.latent_voltages().to_vec());
            }
            if tick > 0 {
                let (decision, spikes) = fixed.decide(&codes);
                decisions.push(decision.output_counts);
                let layers = expected[n_encoder..].iter_mut().zip(spikes);
                layers.for_each(|(all, steps)| all.extend(steps));
            }
        }
        for layer in 0..n {
            let delay = match layer < n_encoder {
                true => layer + 1,
                // The first layers get the codes.
                false => 6 + (layer + 1 - n_encoder).saturating_sub(quantized.branches.max(1)),
            };
            assert!(seen[layer][..delay].iter().all(Vec::is_empty), "layer {layer} began early");
            let n_steps = 5 * TICKS as usize - delay;
            assert!(seen[layer][delay..] == expected[layer][..n_steps], "layer {layer} differs");
            assert!(seen[layer].iter().any(|step| !step.is_empty()), "layer {layer} is silent");
        }
        for (tick, voltages) in voltages.iter().enumerate().skip(1) {
            assert_eq!(*voltages, latent[5 * tick + 4 - n_encoder], "tick {tick}");
        }
        assert_eq!(counts[..2], [vec![0, 0], vec![0, 0]]);
        assert_eq!(counts[2..], decisions[..TICKS as usize - 2]);
        let used = on_chip.chip_use().counts;
        assert_eq!((used.management_writes, used.deliveries_while_held), (0, 0));
        assert_eq!(used.barriers, 5 * TICKS);
    }
}

#[test]
fn the_full_network_equals_the_fixed_point_reference() {
    let (network, nearest) = (full(), Policy::named("nearest").unwrap());
    let slow = std::env::var_os("RUN_SLOW_TESTS").is_some();
    let spikes = compare(&network, &nearest, if slow { 10 } else { 1 }, event);
    println!("{spikes:?}");
    assert!(spikes[..4].iter().all(|n| *n > 0), "{spikes:?}");
    if slow {
        assert_eq!(compare(&network, &nearest, 1, dense), compare(&network, &nearest, 1, event));
    }
}

fn observation(tick: u64, frames: Vec<EventFrame>) -> Observation {
    Observation::random(&mut Streams::new(5, 0).at(stream::STIMULUS, tick), frames)
}

/// Twenty ticks of a trial.
fn compared(network: &EemSan, deployment: &Deployment) -> Agreement {
    let mut comparison = Comparison::new(network, deployment, event(deployment)).unwrap();
    comparison.start_trial(Streams::new(7, 0));
    for tick in 0..20 {
        comparison.tick(&observation(tick, frames(tick)), tick);
    }
    comparison.agreement().clone()
}

/// With the delays of the schedule in the float network the chip agrees in every layer, in the DVS
/// state and in when an action comes.
#[test]
fn a_streaming_chip_agrees_with_the_float_network_of_the_same_delays() {
    let (network, nearest) = (small(true), Policy::named("nearest").unwrap());
    let schedule = Schedule::Streaming;
    let deployment = Deployment::compile_eem_san(
        &network,
        &nearest,
        &ChipSpec::loihi1(),
        Split::Fewest,
        schedule,
    )
    .unwrap();
    let streamed = compared(&network, &deployment);
    for layer in &streamed.layers {
        assert!(layer.share().is_some_and(|share| share > 0.9) && layer.float > 0, "{layer:?}");
    }
    assert!(streamed.equal_actions > 15, "{streamed:?}");
    assert!(streamed.state_difference_sum / 20.0 < 0.1, "{streamed:?}");
    let mut chip = EemSanChipPolicy::new(&deployment, event(&deployment)).unwrap();
    let (mut late, mut prompt) = (EemSanPolicy::streaming(&network), EemSanPolicy::new(&network));
    let mut drivers: [&mut dyn spikeloop::policy::Policy; 3] = [&mut chip, &mut late, &mut prompt];
    drivers.iter_mut().for_each(|driver| driver.start_trial(Streams::new(7, 0)));
    let mut equal = [0; 2];
    for tick in 0..20 {
        let seen = observation(tick, frames(tick));
        let [chip, late, prompt] = drivers.each_mut().map(|driver| driver.act(&seen, tick));
        assert!(tick >= 2 || (chip, late) == (STAND, STAND), "tick {tick}: {chip:?}, {late:?}");
        equal[0] += u32::from(chip == late);
        equal[1] += u32::from(chip == prompt);
    }
    assert!(equal[0] > 15 && equal[1] < equal[0], "{equal:?}");
}

const STAND: Action = Action { left: 0.0, right: 0.0 };

#[test]
fn the_chip_agrees_with_the_float_network_and_not_with_another() {
    let network = small(true);
    let fine = Policy::named("nearest").unwrap();
    let deployment = Deployment::compile_eem_san(
        &network,
        &fine,
        &ChipSpec::loihi1(),
        Split::Fewest,
        Schedule::Held,
    )
    .unwrap();
    let compared = |network: &EemSan| compared(network, &deployment);
    let same = compared(&network);
    for layer in &same.layers {
        println!("{}: {:?} {layer:?}", layer.layer, layer.share());
        assert!(layer.share().is_some_and(|share| share > 0.9) && layer.float > 0, "{layer:?}");
    }
    println!("{same:?}");
    assert_eq!(same.ticks, 20);
    let mut other = network.clone();
    other.decision.iter_mut().for_each(|layer| layer.threshold *= 4.0);
    let other = compared(&other);
    assert!(other.layers[8].share() < same.layers[8].share(), "{other:?}");
}

#[test]
fn costs_of_host_and_management_are_counted() {
    let network = small(true);
    let nearest = Policy::named("nearest").unwrap();
    let deployment = Deployment::compile_eem_san(
        &network,
        &nearest,
        &ChipSpec::loihi1(),
        Split::Fewest,
        Schedule::Held,
    )
    .unwrap();
    let mut policy = EemSanChipPolicy::new(&deployment, event(&deployment)).unwrap();
    policy.start_trial(Streams::new(1, 0));
    let cleared = deployment.map.cores().iter().map(|core| core.compartments() as u64);
    let all: u64 = cleared.sum();
    assert_eq!(policy.chip_use().counts.host_resets, all);
    policy.act(&observation(0, frames(0)), 0);
    let first = policy.chip_use();
    policy.act(&observation(1, frames(1)), 1);
    let second = policy.chip_use();
    let done = second.counts - first.counts;
    // 5 + 6 steps of six convolutions, T + 4 of a decision with three layers one after the other.
    assert_eq!(done.barriers, 11 + 8);
    let layers = network.layers();
    let neurons = |range: std::ops::Range<usize>| layers[range].iter().map(|(_, n)| *n as u64);
    assert_eq!(done.host_resets, neurons(6..layers.len()).sum::<u64>());
    // Voltages and currents of the latent layer, two wheels.
    assert_eq!(done.host_reads, 2 * 4 + 2);
    let cores = deployment.map.cores().len() as u64;
    assert_eq!(done.management_writes, 2 * cores);
    // In five of the steps each neuron of the encoder is updated, and no more often.
    let encoder = second.encoder - first.encoder;
    assert_eq!(encoder.compartment_updates(), 5 * neurons(0..6).sum::<u64>());
    assert!(second.windowed.compartment_updates() > second.encoder.compartment_updates());
    let inputs = (22 + 4) * 3;
    let host = second.host;
    assert_eq!((host.readout_macs, host.gaussians, host.draws), (32, 2 * inputs, 10 * inputs));
}

#[test]
fn what_cannot_be_on_the_chip_is_refused() {
    let negative = |name: &str, _: &mut Vec<usize>, values: &mut Vec<f32>| {
        if name == "actor.decision.1.weight" {
            values[0] = 1e6;
        }
    };
    let folder = Folder::new();
    folder.write("n.safetensors", eem_san(true, &negative));
    let text = "layer decision.1: threshold ";
    refused(&folder, "compile n.safetensors -o out.map", &[text, "must be 1..=131071"]);
    folder.write("good.safetensors", eem_san(true, LIVELY));
    folder.write("blind.safetensors", eem_san(false, LIVELY));
    let weights = "w: good.safetensors comes with its weights; leave --weights out";
    refused(&folder, "compile good.safetensors --weights w -o out.map", &[weights]);
    folder.good("compile good.safetensors -o e.map");
    folder.good("compile reflex -o r.map");
    let line = "agree e.map blind.safetensors --json out.json";
    refused(&folder, line, &["map of good: layers encoder.1 (4096), ", "compiled from"]);
    let none =
        "blind, schedule streaming: there is no encoder of event frames to keep pace with; leave";
    refused(&folder, "compile blind.safetensors --schedule streaming -o out.map", &[none]);
    let none = "reflex: --schedule is for an EEM-SAN, and this is none; leave it out";
    refused(&folder, "compile reflex --schedule held -o out.map", &[none]);
    refused(&folder, "agree r.map good.safetensors --json out.json", &["reflex: not a map of"]);
    refused(&folder, "agree e.map reflex --json out.json", &["reflex: a network with a rate code"]);
    let rate = "good chip (nearest): control rate 10 Hz gives 10 event frames per control tick";
    refused(&folder, "drive e.map --trials 1 --json out.json", &[rate]);
}

#[test]
fn a_compiled_eem_san_drives_and_agrees_from_the_command_line() {
    let folder = Folder::new();
    folder.write("e.safetensors", eem_san(true, LIVELY));
    let compiled = folder.good("compile e.safetensors -o e.map");
    let steps = "11 chip steps per 5 event frames, 8 chip steps per decision (T = 5)";
    assert!(compiled.out.contains(steps), "{}", compiled.out);
    folder.good("inspect e.map");
    folder.good("inspect e.map --json");
    let short = "--arena courtyard-moving --control-hz 20 --ticks-max 6 --trials 2";
    for threads in [1, 2] {
        let line = format!("drive e.map e.safetensors {short} --threads {threads}");
        let ran = folder.good(&format!("{line} --json {threads}.json"));
        assert!(ran.out.contains("event camera on for e chip (nearest), e float"), "{}", ran.out);
        assert!(ran.out.contains("host, per decision: draws 390.0, gaussians 78.0, "));
    }
    let chip = |name: &str| folder.json(name)["drivers"][0]["trials"].clone();
    assert_eq!(chip("1.json"), chip("2.json"));
    let compiled = folder.good("compile e.safetensors --schedule streaming -o s.map");
    assert!(compiled.out.contains(", streaming, 5 chip steps per control tick"));
    let ran = folder.good(&format!("drive s.map {short}"));
    assert!(ran.out.contains("| e chip (nearest, streaming) |"), "{}", ran.out);
    let ran =
        folder.good("agree s.map e.safetensors --ticks 8 --arena courtyard-moving --json s.json");
    let late = "layers are compared 1, 2, 3, 4, 5, 6, 6, 6, 7, 8 chip steps apart";
    assert!(ran.out.contains(late), "{}", ran.out);
    assert_eq!(folder.json("s.json")["agreement"]["ticks"], 8);
    assert_eq!(folder.json("s.json")["policy"], "nearest");
    folder.good(&format!("drive e.map {short} --engine dense --json d.json"));
    assert_eq!(chip("1.json"), chip("d.json"));
    let line = "agree e.map e.safetensors --ticks 8 --arena courtyard-moving --json a.json";
    let ran = folder.good(line);
    assert!(ran.out.contains("| encoder.1 "), "{}", ran.out);
    assert!(ran.out.contains("of 8 ticks of 1 trials"), "{}", ran.out);
    assert_eq!(folder.json("a.json")["agreement"]["ticks"], 8);
    folder.good("evaluate e.map --map courtyard --trials 1 --seeds 1 --ticks-max 3");
}
