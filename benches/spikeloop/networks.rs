//! Networks to time the engine with, each with its input.

use std::collections::BTreeSet;
use std::sync::Arc;

use hw_model::core_map::{AxonIn, AxonOut, CompartmentGroup, Core, HostPort, PortTarget};
use hw_model::engine::Stimulus;
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::{SignMode, SynapseFormat};
use hw_model::{ChipSpec, CoreMap, CoreMapParts};
use spikeloop::compile::eem_san::PIXEL_PORT;
use spikeloop::compile::quantize::BIAS_PORT;
use spikeloop::compile::{Policy, Split};
use spikeloop::host::{Deployment, Schedule};
use spikeloop::net::conv2d::{Conv2d, Shape};
use spikeloop::net::integer::{IntegerNet, IntegerPopulation, IntegerProjection, Mantissas};
use spikeloop::net::{Controller, EemSan, builtin};
use spikeloop::rng::{Draw, Streams, stream};

/// A map and what the host injects.
pub(crate) struct Case {
    pub(crate) map: Arc<CoreMap>,
    pub(crate) stimulus: Stimulus,
}

fn stream_of(case: u64) -> Draw {
    Streams::new(3, case).at(stream::STIMULUS, 0)
}

/// Even mantissas of 8-bit mixed mode, normal with deviation 80: those of the integer networks
/// with golden spikes.
fn mantissas(draw: &mut Draw, mean: f64, count: usize) -> Vec<i16> {
    let even = |x: f64| 2 * ((x / 2.0).round() as i16).clamp(-127, 127);
    (0..count).map(|_| even(mean + 80.0 * draw.gaussian())).collect()
}

/// Each line of the first port with probability `p` in each step.
fn bernoulli(map: &CoreMap, steps: usize, p: f64, draw: &mut Draw) -> Stimulus {
    let lines = map.ports()[0].lines;
    let all = (0..steps as u64).flat_map(|step| (0..lines).map(move |line| (step, 0, line)));
    Stimulus::new(map, steps, all.filter(|_| draw.bernoulli(p))).expect("within the port")
}

/// An input, then layers of LIF neurons (size, threshold mantissa), with decays of SAN.
fn net(name: &str, inputs: usize, layers: &[(usize, u32)], weights: Vec<Mantissas>) -> IntegerNet {
    let population = |name: String, neurons, threshold_mantissa| IntegerPopulation {
        name,
        neurons,
        threshold_mantissa,
    };
    let layer = |(index, (neurons, threshold)): (usize, &(usize, u32))| {
        population(format!("l{}", index + 1), *neurons, Some(*threshold))
    };
    let projection = |(source, weights)| IntegerProjection {
        sources: vec![source],
        target: source + 1,
        weights,
    };
    let input = population("in".to_owned(), inputs, None);
    IntegerNet {
        name: name.to_owned(),
        decay_current: 2048,
        decay_voltage: 1024,
        populations: std::iter::once(input).chain(layers.iter().enumerate().map(layer)).collect(),
        projections: weights.into_iter().enumerate().map(projection).collect(),
    }
}

fn placed(net: IntegerNet) -> Arc<CoreMap> {
    Deployment::of_integers(net, &ChipSpec::loihi1(), Split::Fewest).expect("it fits").map
}

/// SAN's shape, 24-256-256-256-2, in 5,000 steps; about 15 % of the neurons spike in a step.
pub(crate) fn mlp() -> Case {
    let mut draw = stream_of(0);
    let layers = [(256, 610), (256, 1700), (256, 1630), (2, 3260)];
    let sizes = [24, 256, 256, 256, 2];
    let weights = sizes.windows(2).map(|n| mantissas(&mut draw, 5.0, n[0] * n[1]));
    let weights = weights.map(Mantissas::Dense).collect();
    let map = placed(net("mlp", 24, &layers, weights));
    let stimulus = bernoulli(&map, 5000, 0.3, &mut draw);
    Case { map, stimulus }
}

/// One layer, 256-1024, of whose inputs a share of `rate` spikes in a step, in 1,000 steps.
pub(crate) fn layer(rate: f64) -> Case {
    let mut draw = stream_of(1);
    let weights = vec![Mantissas::Dense(mantissas(&mut draw, 5.0, 256 * 1024))];
    let map = placed(net("layer", 256, &[(1024, 1700)], weights));
    let stimulus = bernoulli(&map, 1000, rate, &mut draw);
    Case { map, stimulus }
}

/// An encoder of EEM-SAN's shape, 102,464 neurons, in 100 steps; 5 % of the pixels and 10 to 15 %
/// of the neurons spike in a step.
pub(crate) fn conv() -> Case {
    let mut draw = stream_of(2);
    let mut shape = Shape { channels: 1, height: 128, width: 128 };
    let (mut weights, mut layers) = (Vec::new(), Vec::new());
    for (channels, threshold, mean) in
        [(16, 110, 3.0), (32, 2690, 12.0), (16, 4800, 12.0), (1, 4160, 20.0)]
    {
        let conv = Conv2d::new(shape, channels, [4, 4], 2, 1).expect("the sizes go together");
        weights.push(Mantissas::Conv(conv, mantissas(&mut draw, mean, conv.n_weights())));
        shape = conv.output();
        layers.push((shape.neurons(), threshold));
    }
    let map = placed(net("conv", 128 * 128, &layers, weights));
    let stimulus = bernoulli(&map, 100, 0.05, &mut draw);
    Case { map, stimulus }
}

pub(crate) fn shipped_eem_san() -> Box<EemSan> {
    match builtin::open("eem-san", None) {
        Ok(Controller::EemSan(network)) => network,
        _ => panic!("eem-san is built in"),
    }
}

/// The EEM-SAN that ships, all of it in each of 100 steps: 300 events per frame, a fifth of the
/// population codes' lines, all biases.
pub(crate) fn eem_san() -> Case {
    let policy = Policy::named("nearest").expect("there is one");
    let (chip, schedule) = (ChipSpec::loihi1(), Schedule::Streaming);
    let network = shipped_eem_san();
    let deployment = Deployment::compile_eem_san(&network, &policy, &chip, Split::Fewest, schedule);
    let map = deployment.expect("it fits").map;
    let mut draw = stream_of(3);
    let mut spikes = Vec::new();
    for (index, port) in map.ports().iter().enumerate() {
        let p = match port.name.as_str() {
            PIXEL_PORT => 300.0 / f64::from(port.lines),
            BIAS_PORT => 1.0,
            _ => 0.2,
        };
        for step in 0..100 {
            let lines = (0..port.lines).filter(|_| draw.bernoulli(p));
            spikes.extend(lines.map(|line| (step, index as u32, line)));
        }
    }
    let stimulus = Stimulus::new(&map, 100, spikes).expect("within the ports");
    Case { map, stimulus }
}

const SPARSE_CORES: usize = 100;
const SPARSE_NEURONS_PER_CORE: usize = 1000;
const SPARSE_FAN_OUT: usize = 100;
const SPARSE_LINES: usize = 1000;

/// 100,000 neurons with 100 random targets each, in 100 steps; 1.6 % of the neurons spike in a
/// step, because each line of the host makes 100 random neurons do so.
///
/// A neuron's targets lie on 63 of the 100 cores. So a core has 64,000 input axons of one or two
/// synapses, for which the chip's limits are raised: no Loihi could hold this network.
pub(crate) fn sparse() -> Case {
    let mut draw = stream_of(4);
    let mut cores = vec![sparse_core(); SPARSE_CORES];
    for source in 0..SPARSE_CORES * SPARSE_NEURONS_PER_CORE {
        let (core, compartment) =
            (source / SPARSE_NEURONS_PER_CORE, source % SPARSE_NEURONS_PER_CORE);
        for (target, axon) in random_axons(&mut cores, 0, &mut draw) {
            cores[core].axons_out.push(AxonOut {
                compartment: CompartmentIdx(compartment as u16),
                core: target,
                axon,
            });
        }
    }
    let mut targets = Vec::new();
    for line in 0..SPARSE_LINES as u32 {
        let axons = random_axons(&mut cores, 1, &mut draw).into_iter();
        targets.extend(axons.map(|(core, axon)| PortTarget { line, core, axon }));
    }
    let mut chip = ChipSpec::loihi1();
    chip.name = "loihi1-many-axons".to_owned();
    chip.limits.input_axons_per_core = 65_535;
    chip.limits.output_axons_per_core = 1 << 17;
    chip.limits.synapse_words_per_core = 1 << 18;
    let ports = vec![HostPort { name: "in".to_owned(), lines: SPARSE_LINES as u32, targets }];
    let parts = CoreMapParts { chip, cores, populations: Vec::new(), ports };
    let map = Arc::new(CoreMap::new(parts).expect("within the raised limits"));
    let stimulus = bernoulli(&map, 100, 0.016, &mut draw);
    Case { map, stimulus }
}

fn sparse_core() -> Core {
    let format = |exponent| SynapseFormat { sign_mode: SignMode::Mixed, weight_bits: 8, exponent };
    Core {
        label: "sparse".to_owned(),
        // A current lasts for one step, so a line's spike makes one spike of each target.
        groups: vec![CompartmentGroup {
            len: SPARSE_NEURONS_PER_CORE as u16,
            decay_current: 4096,
            decay_voltage: 1024,
            threshold_mantissa: 2000,
            bias_mantissa: 0,
            bias_exponent: 0,
            refractory_steps: 1,
        }],
        // Between neurons, and from the host: 254 << 5 is above any threshold.
        formats: vec![format(0), format(5)],
        ..Core::default()
    }
}

/// Synapses to random neurons: the input axons made for them, in order.
fn random_axons(cores: &mut [Core], format: u8, draw: &mut Draw) -> Vec<(CoreId, AxonIdx)> {
    let neurons = (SPARSE_CORES * SPARSE_NEURONS_PER_CORE) as u64;
    let mut neurons_reached = BTreeSet::new();
    while neurons_reached.len() < SPARSE_FAN_OUT {
        neurons_reached.insert(draw.below(neurons) as usize);
    }
    let neurons_reached: Vec<usize> = neurons_reached.into_iter().collect();
    let per_core =
        neurons_reached.chunk_by(|a, b| a / SPARSE_NEURONS_PER_CORE == b / SPARSE_NEURONS_PER_CORE);
    let axon = |neurons: &[usize]| {
        let core_idx = neurons[0] / SPARSE_NEURONS_PER_CORE;
        let core = &mut cores[core_idx];
        let mantissas = match format {
            0 => mantissas(draw, 0.0, neurons.len()),
            _ => vec![254; neurons.len()],
        };
        let targets = neurons.iter().map(|n| (n % SPARSE_NEURONS_PER_CORE) as u16).collect();
        let form = SynapseForm::Sparse { targets, mantissas };
        core.axons_in.push(AxonIn { list: core.lists.len() as u32, base: 0 });
        core.lists.push(SynapseList { entries: vec![SynapseEntry { format, form }] });
        (CoreId(core_idx as u16), AxonIdx(core.axons_in.len() as u16 - 1))
    };
    per_core.map(axon).collect()
}

pub(crate) const STATE_STEPS: usize = 100;

/// Compartments without synapses that a bias keeps busy; each spikes every 40 steps.
pub(crate) fn state_only(cores: usize, compartments: usize) -> Case {
    let group = CompartmentGroup {
        len: compartments as u16,
        decay_current: 2048,
        decay_voltage: 0,
        threshold_mantissa: 1000,
        bias_mantissa: 25 * 64,
        bias_exponent: 0,
        refractory_steps: 1,
    };
    let core = Core { label: "state".to_owned(), groups: vec![group], ..Core::default() };
    let parts = CoreMapParts {
        chip: ChipSpec::loihi1(),
        cores: vec![core; cores],
        populations: Vec::new(),
        ports: Vec::new(),
    };
    let map = Arc::new(CoreMap::new(parts).expect("within the limits"));
    Case { map, stimulus: Stimulus::silent(STATE_STEPS) }
}
