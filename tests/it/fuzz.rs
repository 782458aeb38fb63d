//! Random and damaged files into every reader, and random networks through the whole chain.

use std::io::{Cursor, Write};
use std::sync::Arc;

use hw_model::{ChipSpec, DenseEngine, Engine, EventEngine};
use proptest::prelude::*;
use safetensors::Dtype;
use safetensors::tensor::TensorView;
use spikeloop::coding::InputSpikes;
use spikeloop::compile::policy::POLICIES;
use spikeloop::compile::quantize::quantize;
use spikeloop::compile::{Policy, Split};
use spikeloop::golden;
use spikeloop::host::{ChipPolicy, Deployment};
use spikeloop::net::eem_san::FRAMES_PER_TICK;
use spikeloop::net::{EemSan, Layer, Network, RateEncoder, builtin, description, integer};
use spikeloop::nn::variant::VARIANTS;
use spikeloop::npz::Npz;
use spikeloop::policy::{EventFrame, LASER_SECTORS, Observation, Policy as _, TOLD};
use spikeloop::reference::{EemSanPolicy, FixedNetwork};
use spikeloop::report::Report;
use spikeloop::report::activity::CoreActivity;
use spikeloop::report::chip_picture::chip_picture;
use spikeloop::report::chip_plan::ChipPlan;
use spikeloop::report::page::page;
use spikeloop::report::results::DriveResult;
use spikeloop::report::success::{SuccessTable, success_table};
use spikeloop::world::arena::Arena;
use spikeloop::world::pairs::pairs_from_json;

use crate::cli::Folder;
use crate::fixtures::network as network_file;

const DESCRIPTION: &str = r#"
format = 1
name = "tiny"
steps = 5
keep_current = 0.5
keep_voltage = 0.75
threshold = 0.5
[encoder]
kind = "rate"
goal_distance_scale_m = 0.3
linear_scale_m_per_s = 0.5
angular_scale_rad_per_s = 2.0
laser_scale_m = 0.35
[decoder]
kind = "rate"
[[layers]]
name = "a"
neurons = 2
weight = "w"
"#;

const INTEGERS: &str = r#"{"name": "n", "delta_u": 2048, "delta_v": 1024,
    "populations": [{"name": "in", "n": 2, "kind": "input"},
                    {"name": "out", "n": 1, "kind": "lif", "vth_mant": 10}],
    "projections": [{"name": "p", "src": "in", "dst": "out", "kind": "dense", "w": "W"}]}"#;

fn tensors() -> Vec<u8> {
    let bytes: Vec<u8> = (0..48).flat_map(|i| (i as f32 / 48.0).to_le_bytes()).collect();
    let view = TensorView::new(Dtype::F32, vec![2, 24], &bytes).unwrap();
    safetensors::serialize([("w", view)], None).unwrap()
}

/// An archive with one array, whose checksum fits whatever the array holds.
fn archive(name: &str, array: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file(format!("{name}.npy"), zip::write::FileOptions::default()).unwrap();
    zip.write_all(array).unwrap();
    zip.finish().unwrap().into_inner()
}

fn array() -> Vec<u8> {
    let header = "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 1), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend([2, 0, 4, 0]);
    bytes
}

/// A change at a place: overwrite, insert, delete to the end, or copy a part there.
#[derive(Debug, Clone)]
enum Damage {
    Set(prop::sample::Index, u8),
    Insert(prop::sample::Index, Vec<u8>),
    Cut(prop::sample::Index),
    Repeat(prop::sample::Index, prop::sample::Index),
}

fn damage() -> impl Strategy<Value = Vec<Damage>> {
    let index = any::<prop::sample::Index>;
    // Bytes that mean something in text formats come up more often.
    let byte =
        || prop_oneof![any::<u8>(), prop::sample::select(b"0919-.eE+[]{}()\"',:;=# \n\0".to_vec())];
    let one = prop_oneof![
        6 => (index(), byte()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        3 => (index(), prop::collection::vec(byte(), 1..9)).prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        1 => index().prop_map(Damage::Cut),
        1 => (index(), index()).prop_map(|(from, to)| Damage::Repeat(from, to)),
    ];
    prop::collection::vec(one, 1..4)
}

fn damaged(good: &[u8], damage: &[Damage]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for one in damage {
        let at = |index: &prop::sample::Index, len: usize| index.index(len + 1);
        match one {
            Damage::Set(place, byte) => {
                let at = at(place, bytes.len());
                if let Some(there) = bytes.get_mut(at) {
                    *there = *byte;
                }
            }
            Damage::Insert(place, new) => {
                let at = at(place, bytes.len());
                bytes.splice(at..at, new.iter().copied());
            }
            Damage::Cut(place) => bytes.truncate(at(place, bytes.len())),
            Damage::Repeat(from, to) => {
                let (a, b) = (at(from, bytes.len()), at(to, bytes.len()));
                let part = bytes[a.min(b)..a.max(b)].to_vec();
                bytes.splice(b..b, part);
            }
        }
    }
    bytes
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What a reader took must also compile or be refused.
fn read_description(description: &str, weights: &[u8]) {
    if let Ok(network) = description::from_memory("x.toml", description, "x.st", weights) {
        let policy = Policy::named("nearest").unwrap();
        let compiled = Deployment::compile(&network, &policy, &ChipSpec::loihi1(), Split::Fewest);
        if let Err(error) = compiled {
            assert!(error.to_string().len() > 10, "{error:?}");
        }
    }
}

fn read_integers(json: &str, array: &[u8]) {
    let Ok(mut npz) = Npz::from_bytes("x.npz", archive("W", array)) else { return };
    if let Ok(net) = integer::from_parts("x.json", json, &mut npz)
        && let Ok(deployment) = Deployment::of_integers(net, &ChipSpec::loihi1(), Split::Fewest)
    {
        let bytes = deployment.to_bytes();
        let again = Deployment::from_bytes("x.map", &bytes).expect("what compiles can be read");
        assert_eq!(again.map.digest(), deployment.map.digest());
    }
}

fn read_result(json: &str) {
    let map = reflex().map;
    if let Ok(activity) = CoreActivity::from_json("r.json", json, &map) {
        let plan = ChipPlan::of_map("r", "nearest", &map);
        assert!(chip_picture(&plan, Some(&activity)).ends_with("</svg>\n"));
    }
    let mut report = Report::new("r");
    if report.add("r.json", json).is_ok() {
        assert!(page(&report).ends_with("</html>\n"));
    }
}

/// What a reader took must also decide, whatever its numbers.
fn read_eem_san(bytes: &[u8]) {
    let Ok(network) = EemSan::from_bytes("x", "x.st", bytes) else { return };
    let observation = Observation {
        told: vec![0.0; TOLD],
        goal_direction_rad: 0.5,
        goal_distance_m: 3.0,
        linear_m_per_s: 0.2,
        angular_rad_per_s: -0.1,
        laser_m: [1.0; LASER_SECTORS],
        wheel_speed_m_per_s_max: 1.0,
        frames: vec![EventFrame::default(); FRAMES_PER_TICK],
    };
    let action = EemSanPolicy::new(&network).act(&observation, 0);
    assert!((0.0..=1.0).contains(&action.left) && (0.0..=1.0).contains(&action.right));
}

fn read_success(json: &str) {
    if let Ok(table) = SuccessTable::from_json("s.json", json) {
        assert!(success_table(&table).to_string().contains("condition"));
    }
}

/// A table with one cell.
fn success() -> Vec<u8> {
    let folder = Folder::new();
    folder.good("evaluate straight --map courtyard --condition static-0.5 --trials 2 --ticks-max 2 --seeds 1 --json t.json");
    folder.read("t.json")
}

/// The same file with its table of contents damaged, and the length before it right.
fn with_damaged_header(good: &[u8], damage: &[Damage]) -> Vec<u8> {
    let (length, rest) = good.split_at(8);
    let length = u64::from_le_bytes(length.try_into().unwrap()) as usize;
    let header = damaged(&rest[..length], damage);
    [&(header.len() as u64).to_le_bytes()[..], &header, &rest[length..]].concat()
}

fn read_arena(json: &[u8], pairs: &[u8]) {
    for room in [None, Some(1)] {
        if let Ok(arena) = Arena::from_json(json, "a.json", room) {
            assert!(arena.bounds().contains(arena.bounds().min));
        }
    }
    if let Ok(pairs) = pairs_from_json(pairs, "p.json") {
        assert!(!pairs.is_empty());
    }
}

fn reflex() -> Deployment {
    let network = builtin::read("reflex", None).unwrap();
    let policy = Policy::named("nearest").unwrap();
    Deployment::compile(&network, &policy, &ChipSpec::loihi1(), Split::Fewest).unwrap()
}

fn drive_result() -> Vec<u8> {
    let folder = Folder::new();
    crate::cli::reflex_map(&folder);
    folder.good("drive reflex.map --trials 1 --ticks-max 3 --json r.json");
    folder.read("r.json")
}

#[test]
fn the_samples_themselves_are_good() {
    assert!(description::from_memory("x", DESCRIPTION, "x", &tensors()).is_ok());
    let mut npz = Npz::from_bytes("x", archive("W", &array())).unwrap();
    assert_eq!(
        integer::from_parts("x", INTEGERS, &mut npz).unwrap().projections[0].weights.values(),
        [2, 4]
    );
    assert!(DriveResult::from_json("x", &text(&drive_result())).is_ok());
    assert!(Arena::from_json(ARENA.as_bytes(), "x", None).is_ok());
    assert!(pairs_from_json(PAIRS.as_bytes(), "x").is_ok());
    assert!(golden::check_text("x", CHIP_TRACE).is_ok());
    assert!(golden::check_text("x", NETWORK_TRACE).is_ok());
}

const ARENA: &str = include_str!("../../src/world/arenas/courtyard-moving.json");
const PAIRS: &str = r#"{"starts": [[1, 1, 0.5], [2, 2, 0]], "goals": [[8, 8], [1, 9]]}"#;
const CHIP_TRACE: &str = include_str!("../../traces/chip/lif.trace");
const NETWORK_TRACE: &str = include_str!("../../traces/net/reflex_mixed.trace");

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn random_bytes_into_every_reader_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let words = text(&bytes);
        read_description(&words, &bytes);
        read_description(DESCRIPTION, &bytes);
        read_integers(&words, &array());
        read_integers(INTEGERS, &bytes);
        prop_assert!(Npz::from_bytes("x.npz", bytes.clone()).is_err());
        prop_assert!(Deployment::from_bytes("x.map", &bytes).is_err());
        prop_assert!(golden::check_text("x.trace", &words).is_err());
        read_result(&words);
        read_eem_san(&bytes);
        read_success(&words);
        read_arena(&bytes, &bytes);
    }

    #[test]
    fn damaged_networks_never_panic(damage in damage()) {
        read_description(&text(&damaged(DESCRIPTION.as_bytes(), &damage)), &tensors());
        read_description(DESCRIPTION, &damaged(&tensors(), &damage));
        read_integers(&text(&damaged(INTEGERS.as_bytes(), &damage)), &array());
        read_integers(INTEGERS, &damaged(&array(), &damage));
    }

    #[test]
    fn damaged_archives_and_maps_never_panic(damage in damage()) {
        if let Ok(mut npz) = Npz::from_bytes("x.npz", damaged(&archive("W", &array()), &damage))
            && let Ok(read) = npz.ints("W")
        {
            prop_assert!(read.values.len() <= 1 << 16);
        }
        let good = reflex().to_bytes();
        let bytes = damaged(&good, &damage);
        // A digest protects every byte.
        prop_assert!(Deployment::from_bytes("x.map", &bytes).is_err() || bytes == good);
    }

    #[test]
    fn damaged_arenas_and_pairs_never_panic(damage in damage()) {
        read_arena(&damaged(ARENA.as_bytes(), &damage), &damaged(PAIRS.as_bytes(), &damage));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn damaged_traces_never_panic(damage in damage()) {
        for good in [CHIP_TRACE, NETWORK_TRACE] {
            let text = text(&damaged(good.as_bytes(), &damage));
            if let Err(error) = golden::check_text("x.trace", &text) {
                prop_assert!(error.to_string().contains("x.trace"), "{}", error);
            }
        }
    }
}

#[test]
fn damaged_eem_sans_never_panic() {
    for variant in VARIANTS {
        let good = network_file(variant.form, variant.events, &|_, _, _| ());
        read_eem_san(&good);
        let config =
            ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(100) };
        proptest!(config, |(damage in damage())| {
            read_eem_san(&damaged(&good, &damage));
            read_eem_san(&with_damaged_header(&good, &damage));
        });
    }
}

#[test]
fn damaged_tables_never_panic() {
    let good = success();
    assert!(SuccessTable::from_json("x", &text(&good)).is_ok());
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) };
    proptest!(config, |(damage in damage())| {
        read_success(&text(&damaged(&good, &damage)));
    });
}

#[test]
fn damaged_replays_never_panic() {
    let folder = Folder::new();
    folder.good("compile reflex -o r.map");
    folder.good("drive r.map --trials 1 --ticks-max 4 --arena courtyard-moving --replay r.json");
    let good = folder.read("r.json");
    assert!(Report::new("r").add("r.json", &text(&good)).is_ok());
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) };
    proptest!(config, |(damage in damage())| {
        read_result(&text(&damaged(&good, &damage)));
    });
}

#[test]
fn damaged_results_never_panic() {
    let good = drive_result();
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(128) };
    proptest!(config, |(damage in damage())| {
        read_result(&text(&damaged(&good, &damage)));
    });
}

/// Numbers of a random network.
#[derive(Debug, Clone)]
struct Random {
    network: Network,
    input: Vec<InputSpikes>,
    policy: Policy,
    split: Split,
}

fn layer(index: usize, inputs: usize, neurons: usize) -> impl Strategy<Value = Layer> {
    let weight = prop_oneof![1 => Just(0.0f32), 3 => -1.0f32..1.0];
    let weights = prop::collection::vec(weight, inputs * neurons);
    // Biases beyond the weights need an exponent, or a smaller scale of the layer.
    let bias =
        prop_oneof![30 => -1.0f32..1.0, 8 => Just(0.0), 1 => Just(30.0f32), 1 => Just(-300.0)];
    let biases = prop::collection::vec(bias, neurons);
    let keep = || prop_oneof![Just(0.0), Just(0.5), Just(0.75), Just(1.0), 0.0..1.0f64];
    (weights, biases, keep(), keep(), 0.2..3.0f64).prop_map(
        move |(mut weights, bias, keep_current, keep_voltage, threshold)| {
            weights[0] = 0.9;
            let name = format!("l{index}");
            Layer { name, inputs, neurons, weights, bias, keep_current, keep_voltage, threshold }
        },
    )
}

fn network() -> impl Strategy<Value = Network> {
    let sizes = prop::collection::vec(1usize..9, 0..3);
    (sizes, 1u32..9, any::<bool>()).prop_flat_map(|(mut sizes, steps, relay)| {
        sizes.push(2);
        let inputs = std::iter::once(24).chain(sizes.clone());
        let layers: Vec<_> =
            inputs.zip(&sizes).enumerate().map(|(k, (inputs, n))| layer(k, inputs, *n)).collect();
        layers.prop_map(move |layers| Network {
            name: "random".to_owned(),
            steps,
            encoder: RateEncoder {
                goal_distance_scale_m: 0.3,
                linear_scale_m_per_s: 0.5,
                angular_scale_rad_per_s: 2.0,
                laser_scale_m: 0.35,
            },
            relay,
            layers,
        })
    })
}

fn random() -> impl Strategy<Value = Random> {
    let split = prop_oneof![
        Just(Split::Fewest),
        (1usize..5).prop_map(Split::NeuronsPerCore),
        (60usize..=128).prop_map(Split::Cores),
    ];
    // The chip has no weights of 7 bits.
    let bits = prop_oneof![Just(8u8), 2..=6u8];
    (network(), prop::sample::select(POLICIES.to_vec()), bits, split).prop_flat_map(
        |(network, policy, bits, split)| {
            let policy = policy.with_weight_bits(bits).expect("a width that there is");
            let step = prop::collection::vec(any::<bool>(), 24);
            let decision = prop::collection::vec(step, network.steps as usize);
            prop::collection::vec(decision, 1..4).prop_map(move |input| Random {
                network: network.clone(),
                input,
                policy,
                split,
            })
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn chip_counts_equal_the_fixed_reference_for_random_networks(random in random()) {
        let chip = ChipSpec::loihi1();
        let Random { network, input, policy, split } = random;
        // Biases far above the threshold may leave it below one mantissa: refused, not wrong.
        let Ok(quantized) = quantize(&network, &policy, &chip) else {
            let bias_max = |l: &Layer| l.bias.iter().fold(0.0f32, |max, b| max.max(b.abs()));
            prop_assert!(network.layers.iter().any(|l| bias_max(l) >= 30.0), "{:?}", network);
            return Ok(());
        };
        let fixed = FixedNetwork::new(&network, &quantized, &chip);
        let compiled = Deployment::compile(&network, &policy, &chip, split).unwrap();
        let deployment = Deployment::from_bytes("x.map", &compiled.to_bytes()).unwrap();
        let event = |threads| Box::new(EventEngine::with_threads(Arc::clone(&deployment.map), threads));
        let engines: [Box<dyn Engine>; 3] =
            [event(1), event(2), Box::new(DenseEngine::new(Arc::clone(&deployment.map)))];
        for (index, engine) in engines.into_iter().enumerate() {
            let mut on_chip = ChipPolicy::new(&deployment, engine).unwrap();
            for spikes in &input {
                let expected = fixed.decide(spikes).output_counts;
                prop_assert_eq!(on_chip.decide(spikes), expected, "engine {}", index);
            }
        }
    }
}
