//! Published vectors: single compartments, and weights as three public models see them.

use std::path::Path;
use std::sync::Arc;

use hw_model::compartment::{CompartmentParams, CompartmentState, Update, Widths, update};
use hw_model::core_map::{AxonIn, CompartmentGroup, Core, HostPort, PortTarget};
use hw_model::engine::{SpikeRecord, Stimulus};
use hw_model::fixed::DECAY_UNIT;
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList, SynapseLists};
use hw_model::trace::engines;
use hw_model::weight::{OffGrid, SignMode, SynapseFormat, effective_weight};
use hw_model::{ChipSpec, CoreMap, CoreMapParts, Engine};
use serde_json::Value;

/// The vectors in `file`, or nothing where they are not at hand.
fn shared(file: &str) -> Option<Value> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/chip_vectors");
    let Ok(text) = std::fs::read_to_string(Path::new(folder).join(file)) else {
        println!("skipped: needs ../shared");
        return None;
    };
    Some(serde_json::from_str(&text).expect("the vectors are JSON"))
}

/// One compartment and its input, with what it must do.
struct Case {
    name: String,
    group: CompartmentGroup,
    first_current: i32,
    input: Vec<i64>,
    current: Option<Vec<i64>>,
    voltage_before_reset: Option<Vec<i64>>,
    spikes: Option<Vec<i64>>,
    last_voltage: Option<i64>,
}

fn integers(value: &Value) -> Option<Vec<i64>> {
    Some(value.as_array()?.iter().map(|x| x.as_i64().expect("an integer")).collect())
}

impl Case {
    fn read(case: &Value) -> Self {
        let number = |key: &str| case[key].as_i64();
        let small = |key: &str| u16::try_from(number(key).expect(key)).expect(key);
        // A bias of up to 4095 needs no exponent.
        let bias_mantissa = i16::try_from(number("bias").unwrap_or(0)).expect("bias");
        let group = CompartmentGroup {
            len: 1,
            decay_current: small("decay_u"),
            decay_voltage: small("decay_v"),
            threshold_mantissa: number("threshold_mantissa").expect("threshold") as u32,
            bias_mantissa,
            bias_exponent: 0,
            refractory_steps: number("refractory").unwrap_or(1) as u8,
        };
        Self {
            name: case["name"].as_str().expect("a name").to_owned(),
            group,
            first_current: number("u0").unwrap_or(0) as i32,
            input: integers(&case["q"]).expect("q"),
            current: integers(&case["u"]),
            voltage_before_reset: integers(&case["v_before_reset"]).or(integers(&case["v"])),
            spikes: integers(&case["spike"]),
            last_voltage: number("v_last"),
        }
    }

    fn check(&self, through: &str, current: &[i64], voltage: &[i64], spikes: &[i64]) {
        let who = format!("{} through {through}", self.name);
        let expected = [&self.current, &self.spikes];
        for (expected, got) in expected.into_iter().zip([current, spikes]) {
            assert_eq!(expected.as_deref().unwrap_or(got), got, "{who}");
        }
        assert_eq!(self.voltage_before_reset.as_deref().unwrap_or(voltage), voltage, "{who}");
        assert_eq!(self.last_voltage.or(voltage.last().copied()), voltage.last().copied(), "{who}");
    }
}

impl Case {
    /// The same with voltages after reset, which is what engines show.
    fn after_reset(mut self) -> Self {
        let spikes = self.spikes.clone().unwrap_or_default();
        for (voltage, spike) in self.voltage_before_reset.iter_mut().flatten().zip(spikes) {
            *voltage *= 1 - spike;
        }
        self
    }
}

fn cases() -> Option<Vec<Case>> {
    let vectors = shared("cuba_lif.json")?;
    let all = ["sets", "edge"].map(|key| vectors[key].as_array().expect(key).clone());
    assert_eq!([all[0].len(), all[1].len()], [4, 7]);
    Some(all.iter().flatten().map(Case::read).collect())
}

#[test]
fn compartment_update_gives_the_published_states_and_spikes() {
    let arithmetic = ChipSpec::loihi1().arithmetic;
    for case in cases().into_iter().flatten() {
        let params: CompartmentParams = case.group.params(&arithmetic);
        assert_eq!(params.current_keep, DECAY_UNIT - u32::from(case.group.decay_current));
        let mut state =
            CompartmentState { current: case.first_current, ..CompartmentState::default() };
        let steps: Vec<Update> = case
            .input
            .iter()
            .map(|q| {
                let done = update(&params, &Widths::new(&arithmetic), state, *q);
                state = done.state;
                done
            })
            .collect();
        let series = |f: &dyn Fn(&Update) -> i64| steps.iter().map(f).collect::<Vec<_>>();
        case.check(
            "compartment::update",
            &series(&|s| s.state.current.into()),
            &series(&|s| s.voltage_before_reset.into()),
            &series(&|s| s.spike.into()),
        );
    }
}

#[test]
fn every_engine_gives_the_published_states_and_spikes() {
    let mut runs = 0;
    // A current to start from cannot be written into a map.
    for case in cases().into_iter().flatten().filter(|case| case.first_current == 0) {
        let map = Arc::new(one_compartment(case.group));
        let case = case.after_reset();
        for (name, mut engine) in engines(&map) {
            let (current, voltage, spikes) = run(engine.as_mut(), &case);
            case.check(name, &current, &voltage, &spikes);
            runs += 1;
        }
    }
    assert!(runs == 0 || runs == 10 * 4, "{runs} runs");
}

/// Current, voltage after reset and spikes in the steps of `case`.
fn run(engine: &mut dyn Engine, case: &Case) -> (Vec<i64>, Vec<i64>, Vec<i64>) {
    // Input arrives one step after it was injected: a first one needs a step before.
    let lead = usize::from(case.input[0] != 0);
    assert!(lead == 0 || case.group.bias_mantissa == 0, "the step before would not be idle");
    let arrivals: Vec<(u64, i64)> = (0..).zip(case.input.iter().copied()).collect();
    let injected = arrivals.iter().filter(|(_, q)| *q != 0).flat_map(|(step, q)| {
        let at = step + lead as u64 - 1;
        lines_of(*q).into_iter().map(move |line| (at, 0, line))
    });
    let steps = lead + case.input.len();
    let stimulus = Stimulus::new(engine.map(), steps, injected).expect("there are 32 lines");
    let mut record = SpikeRecord::all(engine.map());
    let (mut current, mut voltage) = (Vec::new(), Vec::new());
    for step in 0..steps {
        engine.run(&stimulus.part(step..step + 1), &mut record);
        let state = engine.state(CoreId(0), CompartmentIdx(0));
        current.push(i64::from(state.current));
        voltage.push(i64::from(state.voltage));
    }
    let spiked = |step: usize| record.spikes.iter().any(|spike| spike.step == step as u64);
    let spikes = (lead..steps).map(|step| i64::from(spiked(step))).collect();
    (current.split_off(lead), voltage.split_off(lead), spikes)
}

/// Lines of the port of [`one_compartment`] that add up to `q`.
fn lines_of(q: i64) -> Vec<u32> {
    let steps = q.unsigned_abs() / 64;
    assert!(q % 64 == 0 && steps < 1 << 16, "{q} cannot be put together");
    let sign = if q < 0 { 16 } else { 0 };
    (0..16).filter(|bit| steps >> bit & 1 == 1).map(|bit| bit + sign).collect()
}

/// A compartment whose port line `i` adds `64 << i`, line `16 + i` the negative of it.
fn one_compartment(group: CompartmentGroup) -> CoreMap {
    let formats = [SignMode::Excitatory, SignMode::Inhibitory].map(|sign_mode| {
        [0, 7].map(|exponent| SynapseFormat { sign_mode, weight_bits: 8, exponent })
    });
    // 1 to 128 at exponent 0, then 2 to 128 at exponent 7; bit 15 is twice bit 14.
    let small = (0..8).map(|bit| (0, 1 << bit));
    let large = (1..8).map(|bit| (1, 1 << bit));
    let weights: Vec<(u8, i16)> = small.chain(large).collect();
    let signed = weights.iter().copied();
    let all = signed.clone().chain(signed.map(|(format, mantissa)| (format + 2, -mantissa)));
    let list = |(format, mantissa)| SynapseList {
        entries: vec![SynapseEntry {
            format,
            form: SynapseForm::Dense { first: 0, mantissas: vec![mantissa] },
        }],
    };
    let lists: SynapseLists = all.map(list).collect();
    let of_bit = |bit: u32| if bit < 15 { vec![bit] } else { vec![14, 15] };
    // Axon 15 of each sign is a second one with the weight of axon 14.
    let axon = |sign: u32, bit: u32| AxonIn { list: 15 * sign + bit.min(14), base: 0 };
    let axons_in = (0..32).map(|i| axon(i / 16, i % 16)).collect();
    let targets = (0..32).flat_map(|line| {
        of_bit(line % 16).into_iter().map(move |bit| PortTarget {
            line,
            core: CoreId(0),
            axon: AxonIdx((line / 16 * 16 + bit) as u16),
        })
    });
    CoreMap::new(CoreMapParts {
        chip: ChipSpec::loihi1(),
        cores: vec![Core {
            label: "one".to_owned(),
            groups: vec![group],
            formats: formats.concat(),
            lists,
            axons_in,
            axons_out: Vec::new(),
        }],
        populations: Vec::new(),
        ports: vec![HostPort { name: "q".to_owned(), lines: 32, targets: targets.collect() }],
    })
    .expect("one compartment fits")
}

#[test]
fn each_rounding_rule_gives_the_weights_of_its_library() {
    let Some(vectors) = shared("weights.json") else { return };
    let cases = vectors["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 264);
    let rules =
        [(OffGrid::Nengo, "nengo"), (OffGrid::Brian2Loihi, "brian"), (OffGrid::Lava, "lava")];
    let mut differing = 0;
    for case in cases {
        let (weight, format) = weight_case(case);
        for (rule, key) in rules {
            // "REJ" is no number, as a refused weight is none.
            let expected = case[key].as_i64();
            let got = effective_weight(weight, &format, rule).map(i64::from);
            assert_eq!(got, expected, "{rule:?}: {case}");
        }
        differing += usize::from(case["nengo"] != case["brian"] || case["brian"] != case["lava"]);
    }
    assert_eq!(differing, 119, "libraries that agree everywhere would prove little");
}

#[test]
fn on_grid_weights_amount_to_what_all_libraries_agree_on() {
    let Some(vectors) = shared("weights.json") else { return };
    let mut compared = 0;
    for case in vectors["cases"].as_array().expect("cases") {
        let (weight, format) = weight_case(case);
        let agreed = case["nengo"] == case["brian"] && case["brian"] == case["lava"];
        if agreed && format.holds(weight) {
            let steps = format.effective_steps(weight as i16);
            assert_eq!(case["lava"].as_i64(), Some(64 * i64::from(steps)), "{case}");
            compared += 1;
        }
    }
    assert!(compared >= 30, "only {compared} cases");
}

fn weight_case(case: &Value) -> (i32, SynapseFormat) {
    let number = |key: &str| case[key].as_i64().expect(key);
    let sign_mode = match case["sign_mode"].as_str().expect("sign_mode") {
        "mixed" => SignMode::Mixed,
        "exc" => SignMode::Excitatory,
        "inh" => SignMode::Inhibitory,
        other => panic!("sign mode {other}"),
    };
    let (weight_bits, exponent) = (number("bits") as u8, number("exponent") as i8);
    (number("weight") as i32, SynapseFormat { sign_mode, weight_bits, exponent })
}
