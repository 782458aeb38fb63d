//! Convolutions on the chip: against a plain computation without cores, kernels or axons, and at
//! the size of a whole encoder.

use std::sync::Arc;

use hw_model::container::{self, Kind};
use hw_model::core_map::Core;
use hw_model::engine::{PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::synapse::SynapseList;
use hw_model::{ChipSpec, CoreMap, CoreMapParts, DenseEngine, Engine, EventEngine};
use proptest::prelude::*;
use spikeloop::compile::graph::{
    BiasRegisters, GraphPopulation, IntegerGraph, Mantissas, Projection, Signs, Source,
};
use spikeloop::compile::place::place;
use spikeloop::net::conv2d::{Conv2d, Shape};
use spikeloop::net::integer;
use spikeloop::npz::Npz;

use crate::bad_input::integer_weights;

/// Numbers that look random, the same in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    /// Even mantissas of -254..=254, `zeros` of ten 0.
    fn mantissas(&mut self, n: usize, zeros: u64) -> Vec<i16> {
        let one = |_| match (self.below(10) < zeros, self.below(254) as i16) {
            (true, _) => 0,
            (false, n @ 0..127) => 2 * n - 254,
            (false, n) => 2 * n - 252,
        };
        (0..n).map(one).collect()
    }
}

fn population(name: &str, neurons: usize, threshold_mantissa: u32) -> GraphPopulation {
    GraphPopulation {
        name: name.to_owned(),
        neurons,
        decay_current: 2048,
        decay_voltage: 1024,
        threshold_mantissa,
        bias: BiasRegisters::default(),
    }
}

fn projection(sources: &[Source], target: usize, mantissas: Mantissas) -> Projection {
    Projection {
        sources: sources.to_vec(),
        first_source: 0,
        target,
        mantissas,
        signs: Signs::Mixed,
        weight_bits: 8,
        exponent: 0,
    }
}

/// Spikes of every population, step by step, computed synapse by synapse from the definition.
fn plain_run(
    graph: &IntegerGraph,
    steps: usize,
    inputs: &[(u64, u32, u32)],
) -> Vec<PopulationSpikes> {
    let silent = |n: usize| vec![false; n];
    let n = graph.populations.len();
    let mut state: Vec<Vec<(i64, i64)>> =
        graph.populations.iter().map(|p| vec![(0, 0); p.neurons]).collect();
    let mut neurons: Vec<Vec<bool>> = graph.populations.iter().map(|p| silent(p.neurons)).collect();
    let mut lines: Vec<Vec<bool>> = graph.ports.iter().map(|port| silent(port.1)).collect();
    let mut spikes = vec![Vec::new(); n];
    for step in 0..steps as u64 {
        let mut input: Vec<Vec<i64>> =
            graph.populations.iter().map(|p| vec![0; p.neurons]).collect();
        for projection in &graph.projections {
            for source in &projection.sources {
                let units = match source {
                    Source::Port(port) => &lines[*port],
                    Source::Population(from) => &neurons[*from],
                };
                let units = &units[projection.first_source..];
                add(&mut input[projection.target], units, projection);
            }
        }
        for (p, about) in graph.populations.iter().enumerate() {
            for neuron in 0..about.neurons {
                let (mantissa, exponent) = about.bias.of(neuron, about.neurons);
                let (u, v) = &mut state[p][neuron];
                // Division of integers truncates toward zero, as the chip's decay does.
                *u = *u * (4096 - i64::from(about.decay_current)) / 4096 + input[p][neuron];
                *v = *v * (4096 - i64::from(about.decay_voltage)) / 4096 + *u;
                *v += i64::from(mantissa) << exponent;
                assert!(u.abs() < 1 << 23 && v.abs() < 1 << 23, "the case is too large");
                neurons[p][neuron] = *v > 64 * i64::from(about.threshold_mantissa);
                if neurons[p][neuron] {
                    *v = 0;
                    spikes[p].push((step, neuron as u32));
                }
            }
        }
        lines.iter_mut().for_each(|port| port.fill(false));
        for (_, port, line) in inputs.iter().filter(|spike| spike.0 == step) {
            lines[*port as usize][*line as usize] = true;
        }
    }
    spikes
}

/// Adds what arrives through one projection from the units of one source.
fn add(input: &mut [i64], units: &[bool], projection: &Projection) {
    let effective = |mantissa: i16| 64 * (i64::from(mantissa) << projection.exponent);
    let targets = input.len();
    match &projection.mantissas {
        Mantissas::Dense(weights) => {
            for (row, _) in weights.chunks(targets).zip(units).filter(|(_, spike)| **spike) {
                input.iter_mut().zip(row).for_each(|(sum, weight)| *sum += effective(*weight));
            }
        }
        Mantissas::Conv(conv, kernel) => {
            let (from, to) = (conv.input(), conv.output());
            let [_, _, rows, columns] = conv.weights_shape();
            let pad = conv.pad() as i64;
            for (target, sum) in input.iter_mut().enumerate() {
                let (out, y, x) = (
                    target / (to.height * to.width),
                    target / to.width % to.height,
                    target % to.width,
                );
                for channel in 0..from.channels {
                    for tap in 0..rows * columns {
                        let iy = (y * conv.stride() + tap / columns) as i64 - pad;
                        let ix = (x * conv.stride() + tap % columns) as i64 - pad;
                        let inside = (0..from.height as i64).contains(&iy)
                            && (0..from.width as i64).contains(&ix);
                        let at =
                            (channel as i64 * from.height as i64 + iy) * from.width as i64 + ix;
                        if inside && units[at as usize] {
                            let place = (out * from.channels + channel) * rows * columns + tap;
                            *sum += effective(kernel[place]);
                        }
                    }
                }
            }
        }
    }
}

/// A random little network with pictures, on a chip with little room.
#[derive(Debug, Clone)]
struct Case {
    seed: u64,
    input: Shape,
    channels: [usize; 2],
    kernel: usize,
    stride: usize,
    pad: usize,
    signs: Signs,
    zeros: u64,
    compartments: u32,
    axons: u32,
    words: u32,
}

fn case() -> impl Strategy<Value = Case> {
    let shape = (1..4usize, 4..10usize, 4..10usize);
    let layer = (1..5usize, 1..5usize, 2..5usize, 1..4usize, 0..2usize);
    let room = (6..80u32, 60..300u32, 60..1000u32);
    let signs = prop::sample::select(vec![Signs::Mixed, Signs::Split]);
    (any::<u64>(), shape, layer, room, signs, 0..8u64).prop_map(
        |(seed, shape, layer, (compartments, axons, words), signs, zeros)| Case {
            seed,
            input: Shape { channels: shape.0, height: shape.1, width: shape.2 },
            channels: [layer.0, layer.1],
            kernel: layer.2,
            stride: layer.3,
            pad: layer.4,
            signs,
            zeros,
            compartments,
            axons,
            words,
        },
    )
}

impl Case {
    /// Two pictures one after the other, the second with two sources and a direct way from the
    /// input, and a layer behind that both feed.
    fn graph(&self) -> Option<IntegerGraph> {
        let mut numbers = Numbers(self.seed);
        let kernel = [self.kernel, self.kernel];
        let first =
            Conv2d::new(self.input, self.channels[0], kernel, self.stride, self.pad).ok()?;
        let second = Conv2d::new(first.output(), self.channels[1], [2, 2], 1, 1).ok()?;
        let mut weights = |conv: &Conv2d| {
            let values = numbers.mantissas(conv.n_weights(), self.zeros);
            Mantissas::Conv(*conv, values)
        };
        let kernels = [weights(&first), weights(&first), weights(&second)];
        let [n, m] = [first.output().neurons(), second.output().neurons()];
        let ports = vec![("in".to_owned(), 3 + self.input.neurons()), ("bias".to_owned(), 2)];
        let mut populations = vec![
            population("a", n, 700),
            population("b", n, 900),
            population("c", m, 1500),
            population("d", 5, 600),
        ];
        populations[0].bias =
            BiasRegisters { mantissas: numbers.mantissas(self.channels[0], 3), exponent: 4 };
        populations[2].bias = BiasRegisters { mantissas: numbers.mantissas(m, 5), exponent: 3 };
        let [k0, k1, k2] = kernels;
        let (a, b) = (Source::Population(0), Source::Population(1));
        let rows = |numbers: &mut Numbers, rows: usize, n: usize| {
            Mantissas::Dense(numbers.mantissas(rows * n, 6))
        };
        let mut projections = vec![
            projection(&[Source::Port(0)], 0, k0),
            projection(&[Source::Port(0)], 1, k1),
            // A kernel from two layers at once, and a recurrent one.
            projection(&[a, b], 2, k2),
            projection(&[Source::Port(1)], 2, rows(&mut numbers, 2, m)),
            projection(&[Source::Population(2)], 3, rows(&mut numbers, m, 5)),
            projection(&[a, b], 3, rows(&mut numbers, n, 5)),
            projection(&[Source::Population(3)], 1, rows(&mut numbers, 5, n)),
        ];
        projections[0].first_source = 3;
        projections[1].exponent = 1;
        projections[2].signs = self.signs;
        Some(IntegerGraph { name: "case".to_owned(), ports, populations, projections })
    }

    fn chip(&self) -> ChipSpec {
        let mut chip = ChipSpec::loihi1();
        chip.limits.compartments_per_core = self.compartments;
        chip.limits.input_axons_per_core = self.axons;
        chip.limits.synapse_words_per_core = self.words;
        chip
    }
}

fn engines(map: &Arc<CoreMap>) -> Vec<Box<dyn Engine>> {
    let event = |threads| -> Box<dyn Engine> {
        Box::new(EventEngine::with_threads(Arc::clone(map), threads))
    };
    vec![event(1), event(2), event(3), Box::new(DenseEngine::new(Arc::clone(map)))]
}

fn random_inputs(
    graph: &IntegerGraph,
    steps: usize,
    numbers: &mut Numbers,
) -> Vec<(u64, u32, u32)> {
    let mut inputs = Vec::new();
    for step in 0..steps as u64 {
        for (port, (_, lines)) in graph.ports.iter().enumerate() {
            let spiking = (0..*lines as u32).filter(|_| numbers.below(4) == 0);
            inputs.extend(spiking.map(|line| (step, port as u32, line)));
        }
    }
    inputs
}

const STEPS: usize = 12;
const KIND: Kind = Kind { label: *b"SLTEST\0\0", version: 1, advice: "make it again" };

/// What became of a case: it was refused, or it ran on so many cores.
fn check(case: &Case) -> Result<Option<usize>, TestCaseError> {
    let Some(graph) = case.graph() else { return Ok(None) };
    let Ok(map) = place(&graph, &case.chip(), None) else { return Ok(None) };
    let map = Arc::new(map);
    let inputs = random_inputs(&graph, STEPS, &mut Numbers(!case.seed));
    let expected = plain_run(&graph, STEPS, &inputs);
    let stimulus = Stimulus::new(&map, STEPS, inputs).unwrap();
    let mut seen = Vec::new();
    for mut engine in engines(&map) {
        let mut record = SpikeRecord::all(&map);
        engine.run(&stimulus, &mut record);
        prop_assert_eq!(&record.by_population(&map), &expected);
        let times = (engine.chip_time_ps().to_vec(), engine.slowest_ps().to_vec());
        seen.push((engine.core_counts(), engine.total_counts(), times));
    }
    prop_assert!(seen.windows(2).all(|pair| pair[0] == pair[1]), "counters differ");
    let text = map.to_text();
    let read = CoreMapParts::from_text("x", &text, map.chip().clone()).unwrap();
    prop_assert_eq!(&read, map.parts());
    let bytes = container::to_bytes(KIND, map.parts());
    let read: CoreMapParts = container::from_bytes(KIND, "x", &bytes).unwrap();
    prop_assert_eq!(CoreMap::new(read).unwrap().digest(), map.digest());
    Ok(Some(map.cores().len()))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn small_convolutions_spike_as_the_definition_says_on_every_engine(case in case()) {
        check(&case)?;
    }
}

#[test]
fn most_random_convolutions_run_and_on_several_cores_each() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut cores = Vec::new();
    for _ in 0..40 {
        let case = case().new_tree(&mut runner).unwrap().current();
        cores.extend(check(&case).unwrap());
    }
    assert!(cores.len() >= 20, "only {} of 40 cases ran", cores.len());
    let several = cores.iter().filter(|n| **n >= 8).count();
    assert!(several >= 10, "cores of the cases: {cores:?}");
}

#[test]
fn kernels_that_are_stored_again_farther_up_a_full_core_give_the_same_spikes() {
    let mut numbers = Numbers(3);
    let input = Shape { channels: 2, height: 32, width: 32 };
    let conv = Conv2d::new(input, 8, [3, 3], 1, 1).unwrap();
    let kernel = Mantissas::Conv(conv, numbers.mantissas(conv.n_weights(), 1));
    let graph = IntegerGraph {
        name: "full".to_owned(),
        ports: vec![("in".to_owned(), input.neurons())],
        populations: vec![population("a", conv.output().neurons(), 900)],
        projections: vec![projection(&[Source::Port(0)], 0, kernel)],
    };
    let map = Arc::new(place(&graph, &ChipSpec::loihi1(), None).unwrap());
    assert_eq!(map.cores().len(), 8);
    assert_eq!(map.cores()[0].compartments(), 1024);
    let inputs = random_inputs(&graph, 6, &mut numbers);
    let expected = plain_run(&graph, 6, &inputs);
    assert!(expected[0].len() > 1000, "{} spikes", expected[0].len());
    let stimulus = Stimulus::new(&map, 6, inputs).unwrap();
    for mut engine in engines(&map) {
        let mut record = SpikeRecord::all(&map);
        engine.run(&stimulus, &mut record);
        assert!(record.by_population(&map) == expected);
    }
}

#[test]
fn projections_of_equal_weights_onto_one_population_share_axons() {
    let text = r#"{"name": "n", "delta_u": 2048, "delta_v": 1024,
        "populations": [{"name": "in", "n": 2, "kind": "input"},
                        {"name": "more", "n": 2, "kind": "input"},
                        {"name": "out", "n": 1, "kind": "lif", "vth_mant": 10}],
        "projections": [{"name": "p", "src": "in", "dst": "out", "kind": "dense", "w": "W"},
                        {"name": "q", "src": "more", "dst": "out", "kind": "dense", "w": "W"}]}"#;
    let mut npz = Npz::from_bytes("x", integer_weights([2, -4])).unwrap();
    let net = integer::from_parts("x", text, &mut npz).unwrap();
    let map = place(&IntegerGraph::from(net), &ChipSpec::loihi1(), None).unwrap();
    assert_eq!((map.cores()[0].lists.len(), map.cores()[0].axons_in.len()), (2, 2));
    assert_eq!(map.ports()[0].targets, map.ports()[1].targets);
    assert_eq!(map.ports()[0].targets.len(), 2);
}

const DECISION: [(&str, usize); 4] = [("fc1", 256), ("fc2", 256), ("fc3", 256), ("out", 2)];

/// The encoder of event frames and the decision module, with weights that look random: pixels and
/// population-coded lines from the host, biases from always-on lines, two groups of 20 neurons
/// into one layer through the same weights.
fn encoder_and_decision() -> IntegerGraph {
    let mut numbers = Numbers(1);
    let mut graph = IntegerGraph {
        name: "encoder".to_owned(),
        ports: vec![
            ("pixels".to_owned(), 128 * 128),
            ("lines".to_owned(), 220 + 640),
            ("bias".to_owned(), 10),
        ],
        populations: Vec::new(),
        projections: Vec::new(),
    };
    let mut add_bias = |graph: &mut IntegerGraph, channels: usize, pixels: usize| {
        let target = graph.populations.len() - 1;
        let of_channels = numbers.mantissas(channels, 0);
        let of_neurons = of_channels.iter().flat_map(|m| std::iter::repeat_n(*m, pixels));
        let mut bias =
            projection(&[Source::Port(2)], target, Mantissas::Dense(of_neurons.collect()));
        bias.first_source = target;
        graph.projections.push(bias);
    };
    let mut weights = Numbers(2);
    let mut shape = Shape { channels: 1, height: 128, width: 128 };
    let mut source = Source::Port(0);
    for (index, channels) in [16, 32, 16, 1].into_iter().enumerate() {
        let conv = Conv2d::new(shape, channels, [4, 4], 2, 1).unwrap();
        shape = conv.output();
        graph.populations.push(population(&format!("c{}", index + 1), shape.neurons(), 2000));
        let kernel = Mantissas::Conv(conv, weights.mantissas(conv.n_weights(), 0));
        graph.projections.push(projection(&[source], index, kernel));
        add_bias(&mut graph, channels, shape.height * shape.width);
        source = Source::Population(index);
    }
    for (name, first, lines) in [("state", 0, 220), ("vision", 220, 640)] {
        let target = graph.populations.len();
        graph.populations.push(population(name, 20, 500));
        let rows = Mantissas::Dense(weights.mantissas(lines * 20, 0));
        let mut from_lines = projection(&[Source::Port(1)], target, rows);
        from_lines.first_source = first;
        graph.projections.push(from_lines);
        add_bias(&mut graph, 20, 1);
    }
    let mut sources = vec![Source::Population(4), Source::Population(5)];
    let mut rows = 20;
    for (name, neurons) in DECISION {
        let target = graph.populations.len();
        graph.populations.push(population(name, neurons, 700));
        let mantissas = Mantissas::Dense(weights.mantissas(rows * neurons, 0));
        graph.projections.push(projection(&sources, target, mantissas));
        add_bias(&mut graph, neurons, 1);
        (sources, rows) = (vec![Source::Population(target)], neurons);
    }
    graph
}

#[test]
fn an_encoder_of_102464_neurons_and_a_decision_module_fit_one_chip() {
    let map = place(&encoder_and_decision(), &ChipSpec::loihi1(), None).unwrap();
    let convolutions: usize = map.populations()[..4].iter().map(|p| p.len()).sum();
    assert_eq!(convolutions, 102_464);
    let by_layer: Vec<(&str, usize)> =
        map.populations().iter().map(|p| (&*p.name, p.cores().len())).collect();
    println!("{} cores of 128: {by_layer:?}", map.cores().len());
    // The last layer sees 4096 neurons and a bias line: one axon more than a core has.
    assert_eq!(by_layer[..4], [("c1", 64), ("c2", 32), ("c3", 16), ("c4", 2)]);
    assert!(map.cores().len() <= 128, "{by_layer:?}");
    // Every synapse of the convolutions is there, and one of each neuron's from its bias line.
    let cores = &map.cores()[..114];
    let synapses = |list: &SynapseList| list.entries.iter().map(|e| e.len()).sum::<usize>();
    let of_core = |core: &Core| -> usize {
        core.axons_in.iter().map(|axon| synapses(&core.lists[axon.list as usize])).sum()
    };
    assert_eq!(cores.iter().map(of_core).sum::<usize>(), 11_143_296 + 102_464);
    let stored: usize = cores.iter().flat_map(|core| &core.lists).map(synapses).sum();
    println!("{stored} stored of 11,245,760 synapses onto the encoder");
    assert!(stored < 2_800_000, "{stored} stored synapses");
    // Bases are as small as the chip's registers for them.
    assert!(cores.iter().flat_map(|core| &core.axons_in).all(|axon| axon.base < 256));
}
