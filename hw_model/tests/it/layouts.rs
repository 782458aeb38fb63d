//! Maps whose synapse lists the event engine lays out in its own ways, against the dense engine.

use std::sync::Arc;

use hw_model::core_map::{AxonIn, AxonOut, CompartmentGroup, Core, HostPort, PortTarget};
use hw_model::engine::Stimulus;
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::{SignMode, SynapseFormat};
use hw_model::{ChipSpec, CoreMap, CoreMapParts, EventEngine, Faults};
use proptest::prelude::*;

use crate::differential::{dense, event, run_whole};
use crate::random_map::config;

/// A core of compartments with equal parameters but for their biases.
fn core_of(compartments: u16, biases: bool) -> Core {
    let group = |len, bias_mantissa| CompartmentGroup {
        len,
        decay_current: 2000,
        decay_voltage: 700,
        threshold_mantissa: 300,
        bias_mantissa,
        bias_exponent: 3,
        refractory_steps: 1,
    };
    let groups = if biases {
        let half = compartments / 2;
        vec![group(half, 0), group(compartments - half, -40)]
    } else {
        vec![group(compartments, 0)]
    };
    Core { label: "a".to_owned(), groups, ..Core::default() }
}

/// A map of `core` alone, each input axon with a line of its own.
fn map_of(core: Core) -> Arc<CoreMap> {
    let target = |axon: u16| PortTarget { line: axon.into(), core: CoreId(0), axon: AxonIdx(axon) };
    let lines = core.axons_in.len() as u16;
    let port = HostPort {
        name: "in".to_owned(),
        lines: lines.into(),
        targets: (0..lines).map(target).collect(),
    };
    let parts = CoreMapParts {
        chip: ChipSpec::loihi1(),
        cores: vec![core],
        populations: Vec::new(),
        ports: vec![port],
    };
    Arc::new(CoreMap::new(parts).unwrap())
}

/// Numbers below `n` from a fixed stream.
fn draws(seed: u64) -> impl FnMut(u64) -> u64 {
    let mut state = seed;
    move |n| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % n
    }
}

/// A picture of `width` x `height` pixels with `channels` each, and kernels of up to two by two
/// pixels; with `all`, one axon reaches every compartment.
#[derive(Debug, Clone)]
struct Kernels {
    channels: u16,
    width: u16,
    height: u16,
    sign_mode: SignMode,
    exponent: i8,
    magnitude: u64,
    all: bool,
    biases: bool,
    seed: u64,
}

fn kernels() -> impl Strategy<Value = Kernels> {
    let channels = prop::sample::select(vec![1u16, 3, 16, 32, 42]);
    let weights = prop::sample::select(vec![
        (SignMode::Mixed, 0i8, 60u64),
        (SignMode::Mixed, 0, 254),
        (SignMode::Inhibitory, 1, 255),
        (SignMode::Excitatory, 0, 255),
        (SignMode::Mixed, 7, 254),
    ]);
    (channels, 2..=6u16, 2..=4u16, weights, any::<[bool; 2]>(), any::<u64>()).prop_map(
        |(channels, width, height, (sign_mode, exponent, magnitude), [all, biases], seed)| {
            Kernels { channels, width, height, sign_mode, exponent, magnitude, all, biases, seed }
        },
    )
}

impl Kernels {
    fn build(&self) -> Arc<CoreMap> {
        let mut draw = draws(self.seed);
        let compartments = self.channels * self.width * self.height;
        let mut core = core_of(compartments, self.biases);
        core.formats = vec![SynapseFormat {
            sign_mode: self.sign_mode,
            weight_bits: 8,
            exponent: self.exponent,
        }];
        let magnitude = self.magnitude;
        let mantissa = |draw: &mut dyn FnMut(u64) -> u64| {
            let size = draw(magnitude + 1) as i16;
            match self.sign_mode {
                SignMode::Mixed if draw(2) == 0 => -(size & !1),
                SignMode::Mixed => size & !1,
                SignMode::Excitatory => size,
                SignMode::Inhibitory => -size,
            }
        };
        for _ in 0..12 {
            let (rows, columns) = (1 + draw(2) as u16, 1 + draw(2) as u16);
            let run = columns * self.channels;
            let targets = (0..rows).flat_map(|row| {
                let first = row * self.width * self.channels;
                first..first + run
            });
            let synapses: Vec<(u16, i16)> =
                targets.map(|target| (target, mantissa(&mut draw))).collect();
            let form = if draw(2) == 0 {
                let kept = synapses.iter().filter(|(_, mantissa)| *mantissa != 0).copied();
                let (targets, mantissas) = kept.unzip();
                vec![SynapseForm::Sparse { targets, mantissas }]
            } else {
                let dense = |run: &[(u16, i16)]| SynapseForm::Dense {
                    first: run[0].0,
                    mantissas: run.iter().map(|(_, mantissa)| *mantissa).collect(),
                };
                synapses.chunks(run.into()).map(dense).collect()
            };
            let entries: Vec<SynapseEntry> =
                form.into_iter().map(|form| SynapseEntry { format: 0, form }).collect();
            core.lists.push(SynapseList { entries });
            let list = core.lists.len() as u32 - 1;
            for _ in 0..=draw(3) {
                let x = draw(u64::from(self.width - columns) + 1) as u16;
                let y = draw(u64::from(self.height - rows) + 1) as u16;
                let base = (y * self.width + x) * self.channels;
                core.axons_in.push(AxonIn { list, base: base.min(255) });
            }
        }
        if self.all {
            let mantissas = (0..compartments).map(|_| mantissa(&mut draw)).collect();
            let form = SynapseForm::Dense { first: 0, mantissas };
            core.lists.push(SynapseList { entries: vec![SynapseEntry { format: 0, form }] });
            core.axons_in.push(AxonIn { list: core.lists.len() as u32 - 1, base: 0 });
        }
        map_of(core)
    }
}

proptest! {
    #![proptest_config(config(200))]

    #[test]
    fn kernels_of_any_shape_agree_with_the_dense_engine(kernels in kernels()) {
        let map = kernels.build();
        let mut draw = draws(kernels.seed ^ 1);
        let lines = u64::from(map.ports()[0].lines);
        let spikes: Vec<(u64, u32, u32)> =
            (0..120).map(|_| (draw(12), 0, draw(lines) as u32)).collect();
        let stimulus = Stimulus::new(&map, 16, spikes).unwrap();
        prop_assert_eq!(run_whole(event(&map, 1), &stimulus), run_whole(dense(&map), &stimulus));
        let [lossy_event, lossy_dense] = [event(&map, 1), dense(&map)].map(|mut engine| {
            engine.set_faults(Faults::new(kernels.seed, 300_000, []).unwrap());
            run_whole(engine, &stimulus)
        });
        prop_assert_eq!(lossy_event, lossy_dense);
    }
}

/// Cores of which each gets one or two synapses of a spike, from the host and from other cores.
#[derive(Debug, Clone)]
struct Scattered {
    cores: usize,
    compartments: u16,
    /// Lines of the host, and neurons that send anything.
    lines: usize,
    senders: usize,
    /// Synapses of each.
    fan_out: usize,
    seed: u64,
}

fn scattered() -> impl Strategy<Value = Scattered> {
    let sizes = (1..=40usize, prop::sample::select(vec![1u16, 3, 16, 64]), any::<u64>());
    (sizes, 1..=400usize, 0..=60usize, 1..=120usize).prop_map(
        |((cores, compartments, seed), lines, senders, fan_out)| {
            // No input axon beyond the chip's 4,096 of a core.
            let fan_out = fan_out.min(cores * 3);
            Scattered { cores, compartments, lines, senders, fan_out, seed }
        },
    )
}

impl Scattered {
    fn build(&self) -> Arc<CoreMap> {
        let mut draw = draws(self.seed);
        let mut core = core_of(self.compartments, false);
        core.formats =
            vec![SynapseFormat { sign_mode: SignMode::Mixed, weight_bits: 8, exponent: 0 }];
        let mut cores = vec![core; self.cores];
        // The axons that a source reaches: core and number.
        let mut axons = |cores: &mut [Core]| {
            let mut reached: Vec<usize> =
                (0..self.fan_out).map(|_| draw(cores.len() as u64) as usize).collect();
            reached.sort_unstable();
            // Two that follow each other become one axon where the core has room for two.
            let mut made = Vec::new();
            let mut reached = reached.into_iter().peekable();
            while let Some(core) = reached.next() {
                let mut targets = vec![draw(u64::from(self.compartments)) as u16];
                if self.compartments > 1 && reached.next_if_eq(&core).is_some() {
                    targets[0] = targets[0].min(self.compartments - 2);
                    targets.push(targets[0] + 1);
                }
                let mantissas = targets.iter().map(|_| 2 * draw(250) as i16 - 250).collect();
                let form = SynapseForm::Sparse { targets, mantissas };
                let into = &mut cores[core];
                into.lists.push(SynapseList { entries: vec![SynapseEntry { format: 0, form }] });
                let list = into.lists.len() as u32 - 1;
                into.axons_in.push(AxonIn { list, base: 0 });
                made.push((CoreId(core as u16), AxonIdx(into.axons_in.len() as u16 - 1)));
            }
            made
        };
        for sender in 0..self.senders.min(self.cores * usize::from(self.compartments)) {
            let (from, compartment) = (sender % self.cores, (sender / self.cores) as u16);
            let compartment = CompartmentIdx(compartment);
            for (core, axon) in axons(&mut cores) {
                cores[from].axons_out.push(AxonOut { compartment, core, axon });
            }
        }
        let mut targets = Vec::new();
        for line in 0..self.lines as u32 {
            let of_line = axons(&mut cores).into_iter();
            targets.extend(of_line.map(|(core, axon)| PortTarget { line, core, axon }));
        }
        let port = HostPort { name: "in".to_owned(), lines: self.lines as u32, targets };
        let chip = ChipSpec::loihi1();
        let parts = CoreMapParts { chip, cores, populations: Vec::new(), ports: vec![port] };
        Arc::new(CoreMap::new(parts).unwrap())
    }
}

/// All threads, with and without lost messages, against the dense engine. All lines spike in the
/// first step, later a third of them.
fn check_scattered(scattered: &Scattered) -> Result<(), TestCaseError> {
    let map = scattered.build();
    let mut draw = draws(scattered.seed ^ 1);
    let spikes: Vec<(u64, u32, u32)> = (0..6u64)
        .flat_map(|step| (0..scattered.lines as u32).map(move |line| (step, 0, line)))
        .filter(|(step, _, _)| *step == 0 || draw(3) == 0)
        .collect();
    let stimulus = Stimulus::new(&map, 8, spikes).unwrap();
    let expected = run_whole(dense(&map), &stimulus);
    for threads in [1, 2, 3] {
        prop_assert_eq!(&run_whole(event(&map, threads), &stimulus), &expected);
    }
    let [lossy_event, lossy_dense] = [event(&map, 1), dense(&map)].map(|mut engine| {
        engine.set_faults(Faults::new(scattered.seed, 300_000, []).unwrap());
        run_whole(engine, &stimulus)
    });
    prop_assert_eq!(lossy_event, lossy_dense);
    Ok(())
}

proptest! {
    #![proptest_config(config(100))]

    #[test]
    fn scattered_synapses_agree_with_the_dense_engine(scattered in scattered()) {
        check_scattered(&scattered)?;
    }
}

#[test]
fn many_scattered_synapses_in_one_step_agree_with_the_dense_engine() {
    let scattered =
        Scattered { cores: 16, compartments: 16, lines: 1200, senders: 20, fan_out: 48, seed: 5 };
    check_scattered(&scattered).unwrap();
}

/// Two threads have 15 cores each, so that the second begins within a bin.
#[test]
fn scattered_synapses_of_threads_that_share_a_bin_agree_with_the_dense_engine() {
    let scattered =
        Scattered { cores: 30, compartments: 3, lines: 300, senders: 40, fan_out: 60, seed: 6 };
    check_scattered(&scattered).unwrap();
}

/// One compartment with an input axon for each of `weights`, all of which spike at once.
fn summed(sign_mode: SignMode, weights: impl IntoIterator<Item = i16>) -> [Vec<String>; 2] {
    let mut core = core_of(1, false);
    core.formats = vec![SynapseFormat { sign_mode, weight_bits: 8, exponent: 0 }];
    for (list, weight) in weights.into_iter().enumerate() {
        let form = SynapseForm::Dense { first: 0, mantissas: vec![weight] };
        core.lists.push(SynapseList { entries: vec![SynapseEntry { format: 0, form }] });
        core.axons_in.push(AxonIn { list: list as u32, base: 0 });
    }
    let map = map_of(core);
    let lines = map.ports()[0].lines;
    let stimulus = Stimulus::new(&map, 4, (0..lines).map(|line| (0, 0, line))).unwrap();
    [event(&map, 1), dense(&map)].map(|engine| run_whole(engine, &stimulus))
}

#[test]
fn sums_at_the_ends_of_16_bit_agree_with_the_dense_engine() {
    // 128 * 255 + 127 = 2^15 - 1; one more needs 17 bit.
    for last in [126, 127, 128, 129] {
        for (sign_mode, sign) in [(SignMode::Excitatory, 1), (SignMode::Inhibitory, -1)] {
            let weights = std::iter::repeat_n(sign * 255, 128).chain([sign * last]);
            let [event, dense] = summed(sign_mode, weights);
            assert_eq!(event, dense, "last weight {last}, {sign_mode:?}");
        }
    }
    // In units of 128: 258 * 127 = 2^15 - 2.
    for n in [258, 259, 260] {
        let [event, dense] = summed(SignMode::Mixed, std::iter::repeat_n(254, n));
        assert_eq!(event, dense, "{n} weights of 254");
    }
    // Both signs: neither sum leaves 16 bit, their difference would.
    let weights = std::iter::repeat_n(254, 200).chain(std::iter::repeat_n(-256, 200));
    let [event, dense] = summed(SignMode::Mixed, weights);
    assert_eq!(event, dense);
}

#[test]
fn threads_are_used_where_each_has_enough_to_do() {
    let small = map_of(core_of(1000, false));
    assert_eq!(EventEngine::with_threads_at_most(Arc::clone(&small), 2).threads(), 1);
    let chip = ChipSpec::loihi1();
    let cores = (0..128).map(|_| core_of(1000, false)).collect();
    let parts = CoreMapParts { chip, cores, populations: Vec::new(), ports: Vec::new() };
    let large = Arc::new(CoreMap::new(parts).unwrap());
    assert_eq!(EventEngine::with_threads_at_most(Arc::clone(&large), 2).threads(), 2);
    assert_eq!(EventEngine::with_threads_at_most(large, 1).threads(), 1);
    assert_eq!(EventEngine::with_threads(small, 2).threads(), 1, "no more than cores");
}

#[test]
fn memory_grows_with_compartments_and_synapses() {
    let memory = |core| EventEngine::new(map_of(core)).memory();
    let (small, large) = (memory(core_of(64, false)), memory(core_of(640, false)));
    // Current, voltage, refractory count, a sum of 16 bit at least.
    assert!(large.state - small.state >= 576 * 11, "{small:?} {large:?}");
    let mut full = core_of(640, false);
    full.formats = vec![SynapseFormat { sign_mode: SignMode::Mixed, weight_bits: 8, exponent: 0 }];
    for list in 0..100u16 {
        let mantissas =
            (0..640).map(|target| 2 * ((target + 7 * i16::from(list as u8)) % 100)).collect();
        let form = SynapseForm::Dense { first: 0, mantissas };
        full.lists.push(SynapseList { entries: vec![SynapseEntry { format: 0, form }] });
        full.axons_in.push(AxonIn { list: list.into(), base: 0 });
    }
    let grown = memory(full).shared - large.shared;
    assert!((64_000..80_000).contains(&grown), "64,000 synapses take {grown} bytes");
}
