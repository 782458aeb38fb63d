//! EEM-SAN's peers and ablations from their files to the closed loop.

use spikeloop::evaluate::Driver;
use spikeloop::net::{Controller, EemSan, EncoderKind, Layer, StateCode, builtin};
use spikeloop::nn::variant::{Thresholds, VARIANTS};
use spikeloop::nn::{Form, Variant};
use spikeloop::policy::{EventFrame, Observation, Policy};
use spikeloop::reference::EemSanPolicy;
use spikeloop::rng::{Streams, stream};

use crate::bad_input::refused;
use crate::cli::Folder;
use crate::fixtures::{Change, network};

const AS_IS: Change = &|_, _, _| ();

/// Weights at which no layer is silent.
const LIVELY: Change = &|name, _, values| {
    if name.ends_with(".weight") && name.starts_with("actor.") {
        let shift = if name == "actor.decision.2.weight" { 0.25 } else { 0.03 };
        values.iter_mut().for_each(|value| *value = 2.0 * *value + shift);
    }
};

fn read(variant: &Variant, change: Change) -> EemSan {
    let bytes = network(variant.form, variant.events, change);
    EemSan::from_bytes(variant.name, "file", &bytes).unwrap()
}

fn error(variant: &str, change: Change) -> String {
    let variant = Variant::named(variant).unwrap();
    let bytes = network(variant.form, variant.events, change);
    EemSan::from_bytes("x", "x.st", &bytes).unwrap_err().to_string()
}

#[test]
fn files_say_by_their_tensors_what_network_they_hold() {
    for variant in VARIANTS {
        let network = read(&variant, AS_IS);
        let rate = ["san", "bdett"].contains(&variant.name);
        assert_eq!(network.laser.code == StateCode::Rate, rate, "{}", variant.name);
        let middle = ["laser-only", "fixed", "eem-san"].contains(&variant.name);
        assert!(network.branches().all(|b| b.layer.is_some() == middle), "{}", variant.name);
        assert_eq!(network.dynamic.is_some(), variant.name == "bdett");
        assert_eq!(network.encoder.is_some(), variant.events);
        let inputs = match variant.name {
            "san" | "bdett" => 24,
            "popsan" => 66,
            "naive" => 66 + 12,
            _ => 5,
        };
        assert_eq!(network.decision[0].inputs, inputs, "{}", variant.name);
    }
}

#[test]
fn files_that_hold_no_network_are_refused() {
    let threshold: Change = &|name, _, values| {
        if name == "actor.decision.2.threshold" {
            values[0] = 0.0;
        }
    };
    assert!(error("san", threshold).contains("decision.2: threshold = 0, must be above 0"));
    let without = |gone: &'static str| {
        move |name: &str, shape: &mut Vec<usize>, _: &mut Vec<f32>| {
            if name == gone {
                shape.clear();
            }
        }
    };
    let found = error("san", &without("actor.decision.1.threshold"));
    assert!(found.contains("layer decision.1: tensor actor.decision.1.r: nothing"), "{found}");
    let found = error("naive", &without("actor.population.dvs.mean"));
    assert!(found.contains("tensor actor.population.dvs.mean: nothing"), "{found}");
    let found = error("popsan", &without("actor.population.laser.mean"));
    assert!(found.contains("tensor actor.population.laser.mean: nothing"), "{found}");
    let found = error("fixed", &without("actor.fuse.laser.weight"));
    assert!(found.contains("tensor actor.fuse.laser.weight: nothing"), "{found}");
    let found = error("bdett", &without("actor.bdett"));
    assert!(found.contains("tensor actor.decision.1.r: nothing"), "{found}");
    let rule: Change = &|name, _, values| {
        if name == "actor.bdett" {
            values[1] = 0.0;
        }
    };
    assert!(error("bdett", rule).contains("bdett: temporal_scale = 0, must be above 0"));
    let short: Change = &|name, shape, values| {
        if name == "actor.bdett" {
            shape[0] = 5;
            values.truncate(5);
        }
    };
    assert!(
        error("bdett", short)
            .contains("tensor actor.bdett: F32 [5] found, F32 or F16 [6] expected")
    );
}

fn observation(tick: u64, events: bool) -> Observation {
    let mut draw = Streams::new(5, 0).at(stream::STIMULUS, tick);
    let n = if events { 5 } else { 0 };
    let frames = (0..n).map(|_| EventFrame::random(&mut draw, 400)).collect();
    Observation::random(&mut draw, frames)
}

/// Spikes of all layers over some ticks of a trial.
fn flown(policy: &mut EemSanPolicy, events: bool) -> Vec<Vec<usize>> {
    policy.start_trial(Streams::new(3, 0));
    let mut ticks = Vec::new();
    for tick in 0..6 {
        let (_, spikes) = policy.act_watched(&observation(tick, events), tick);
        ticks.push(spikes.iter().map(|layer| layer.iter().map(Vec::len).sum()).collect());
    }
    ticks
}

#[test]
fn every_network_of_the_table_flies_and_each_trial_begins_afresh() {
    for variant in VARIANTS {
        let network = read(&variant, LIVELY);
        let mut policy = EemSanPolicy::new(&network);
        let first = flown(&mut policy, variant.events);
        assert_eq!(first[0].len(), network.layers().len(), "{}", variant.name);
        assert_eq!(flown(&mut policy, variant.events), first, "{}", variant.name);
        let fired = |layer: usize| first.iter().map(|tick| tick[layer]).sum::<usize>();
        let decision = network.layers().len() - network.dense_layers().count();
        for layer in decision..network.layers().len() {
            assert!(fired(layer) > 0, "{}: layer {layer} is silent", variant.name);
        }
    }
}

#[test]
fn only_dynamic_thresholds_carry_a_state_from_tick_to_tick() {
    for name in ["san", "bdett"] {
        let mut policy = EemSanPolicy::new(&read(Variant::named(name).unwrap(), LIVELY));
        let mut again = |first: u64| {
            policy.start_trial(Streams::new(3, 0));
            policy.act_watched(&observation(first, false), 0);
            policy.act_watched(&observation(9, false), 1).1
        };
        assert_eq!(again(1) == again(2), name == "san", "{name}");
    }
}

/// Their digests are in results that were recorded before there were other networks.
#[test]
fn digests_of_the_networks_that_ship_are_what_they_were() {
    for (name, digest) in [
        ("eem-san", "44d98e58b70adfcc5ef8548d46d8e8a4cd6857a1c3e9a5987601a226f37b3832"),
        ("laser-only", "e02d9881a0ed275f18e849cdfaf5e1cf579d15c556000933989f759623972aac"),
    ] {
        let network = builtin::open(name, None).unwrap();
        assert_eq!(Driver::controller(&network).digest.as_deref(), Some(digest), "{name}");
    }
}

#[test]
fn what_a_network_cannot_do_is_said() {
    let folder = Folder::new();
    for name in ["san", "popsan", "bdett", "naive"] {
        let variant = Variant::named(name).unwrap();
        let bytes = network(variant.form, variant.events, LIVELY);
        folder.write(&format!("{name}.safetensors"), bytes);
    }
    folder.good("compile san.safetensors -o san.map");
    for (line, parts) in [
        (
            "compile bdett.safetensors -o b.map",
            [
                "bdett: dynamic thresholds (BDETT): each of 9 neurons needs a threshold of its own",
                "limit 8 per core and set from outside (loihi1.threshold_configs_per_core)",
            ],
        ),
        ("thresholds bdett.safetensors", ["one for each neuron and step", "leave it out"]),
        ("agree san.map bdett.safetensors --arena courtyard", ["bdett: dynamic", "no map has"]),
        (
            "agree san.map popsan.safetensors --arena courtyard",
            ["map of san: codes of [24] lines, but popsan has [66]", "compiled from"],
        ),
        (
            "table5 naive.safetensors --arena courtyard-moving",
            ["naive.safetensors: not an EEM-SAN", "artificial counterparts are about"],
        ),
    ] {
        refused(&folder, line, &parts);
    }
    assert!(!folder.path("b.map").exists());
}

/// EEM-SAN's artificial counterpart has a middle fuse module.
#[test]
fn only_networks_of_the_layers_of_eem_san_are_put_beside_its_artificial_counterpart() {
    let folder = Folder::new();
    for (name, artificial) in [("naive", false), ("fixed", true)] {
        let variant = Variant::named(name).unwrap();
        folder.write("n.safetensors", network(variant.form, true, LIVELY));
        folder.good("compile n.safetensors -o n.map");
        let drive = "drive n.map --arena courtyard-moving --control-hz 20 --trials 1 --ticks-max 3";
        let ran = folder.good(drive);
        assert!(ran.out.contains("per decision on the emulated chip"), "{}", ran.out);
        assert_eq!(ran.out.contains("artificial counterpart"), artificial, "{name}: {}", ran.out);
    }
}

#[test]
fn networks_that_ship_for_comparison_are_what_their_names_say() {
    let shipped = |variant: &&Variant| builtin::is_name(&format!("compare/{}", variant.name));
    let shipped: Vec<&Variant> = VARIANTS.iter().filter(shipped).collect();
    assert!(shipped.len() >= 2, "{shipped:?}");
    for variant in shipped {
        let name = format!("compare/{}", variant.name);
        let Ok(Controller::EemSan(network)) = builtin::open(&name, None) else { panic!("{name}") };
        let like = read(variant, AS_IS);
        assert_eq!(network.laser.code == StateCode::Rate, like.laser.code == StateCode::Rate);
        assert_eq!(network.laser.layer.is_some(), like.laser.layer.is_some(), "{name}");
        assert_eq!(network.encoder.is_some(), variant.events, "{name}");
        assert_eq!(network.dynamic.is_some(), like.dynamic.is_some(), "{name}");
        let sizes: Vec<usize> = network.decision.iter().map(|layer| layer.neurons).collect();
        assert_eq!(sizes, [256, 256, 256, 2], "{name}");
        let fixed = network.dense_layers().all(|layer| layer.threshold == 0.5);
        let learned = variant.form.thresholds == Thresholds::Learned;
        assert_eq!(fixed, !learned, "{name}");
    }
}

/// Forty trials without movers, of which what learned with ideal wheels loses some.
#[test]
fn networks_that_learned_with_lagging_wheels_bear_them() {
    let folder = Folder::new();
    let common = "--map map1 --condition static-1.0 --trials 40 --seeds 1 --actuators lag";
    folder.good(&format!("evaluate laser-only lag/laser-only {common} --json t.json"));
    let cells = folder.json("t.json")["cells"].clone();
    let [ideal, lag] = [0, 1].map(|cell| cells[cell]["summary"]["success"].as_u64().unwrap());
    assert!(lag >= 38 && lag > ideal, "{ideal}, {lag}");
    for (lagging, ideal) in [("lag/laser-only", "laser-only"), ("lag/eem-san", "eem-san")] {
        let [lagging, ideal] = [lagging, ideal].map(|name| builtin::open(name, None).unwrap());
        let (Controller::EemSan(lagging), Controller::EemSan(ideal)) = (lagging, ideal) else {
            panic!("no EEM-SAN")
        };
        let sizes =
            |network: &EemSan| network.dense_layers().map(|l| l.neurons).collect::<Vec<_>>();
        assert_eq!(sizes(&lagging), sizes(&ideal));
        assert_eq!(lagging.encoder.is_some(), ideal.encoder.is_some());
    }
}

/// Rows of figure 5. What is learned has left its start in every layer, but for 0.9: its last layers
/// never spike, and no gradient passes them.
#[test]
fn networks_that_ship_with_other_thresholds_have_them() {
    let (mut fixed, mut learned) = (0, 0);
    for name in builtin::trained_names() {
        // What follows the number is the seed.
        let start = |kind: &str| {
            let number = name.strip_prefix(kind)?.split('-').next()?;
            Some(f64::from(number.parse::<f32>().unwrap()))
        };
        let Ok(Controller::EemSan(network)) = builtin::open(name, None) else { panic!("{name}") };
        if let Some(start) = start("compare/fixed-") {
            assert!(network.dense_layers().all(|layer| layer.threshold == start), "{name}");
            fixed += 1;
        } else if let Some(start) = start("compare/learned-") {
            let moves = name != "compare/learned-0.9";
            let moved = |layer: &Layer| (layer.threshold - start).abs() > 1e-6;
            assert!(network.dense_layers().all(|layer| moved(layer) == moves), "{name}");
            learned += 1;
        } else {
            continue;
        }
        assert!(network.branches().all(|branch| branch.layer.is_some()), "{name}");
        let hsvae = network.encoder.as_ref().is_some_and(|e| e.kind == EncoderKind::Hsvae);
        assert!(hsvae, "{name}");
    }
    assert!(fixed > 0 && learned > 0);
}

#[test]
fn weights_of_16_bits_make_the_network_that_they_were_rounded_to() {
    let folder = Folder::new();
    for variant in VARIANTS {
        let whole = network(variant.form, variant.events, LIVELY);
        folder.write("n.safetensors", &whole);
        let ran = folder.good("halve n.safetensors -o half.safetensors");
        assert!(ran.out.contains("weights of 16 bits"), "{}", ran.out);
        let half = folder.read("half.safetensors");
        assert!(half.len() < whole.len(), "{}", variant.name);
        let open = |bytes| EemSan::from_bytes(variant.name, "file", bytes).unwrap();
        let (mut whole, mut half) = (open(&whole), open(&half));
        assert_ne!(whole, half, "{}", variant.name);
        for (whole, half) in whole.weights_mut().into_iter().zip(half.weights_mut()) {
            assert_eq!(whole.len(), half.len(), "{}", variant.name);
            for (whole, half) in whole.iter().zip(half) {
                assert!((whole - *half).abs() <= whole.abs() * 2f32.powi(-11), "{}", variant.name);
            }
        }
        for (whole, half) in whole.dense_layers().zip(half.dense_layers()) {
            assert_eq!((whole.threshold, &whole.bias), (half.threshold, &half.bias));
        }
    }
    folder.write("n.safetensors", network(Form::EEM_SAN, true, LIVELY));
    folder.good("halve n.safetensors -o half.safetensors");
    folder.good("compile half.safetensors -o half.map");
    folder.good("drive half.map --arena courtyard-moving --control-hz 20 --trials 1 --ticks-max 3");
}

#[test]
fn what_cannot_be_halved_is_refused() {
    let folder = Folder::new();
    folder.write("n.safetensors", network(Form::EEM_SAN, true, LIVELY));
    folder.write("no.safetensors", "not weights");
    let large: Change = &|name, _, values| {
        if name == "actor.decision.1.weight" {
            values[3] = -7e4;
        }
    };
    folder.write("large.safetensors", network(Form::EEM_SAN, true, large));
    let narrow: Change = &|name, _, values| {
        if name == "actor.population.laser.deviation" {
            values[0] = 1e-9;
        }
    };
    folder.write("narrow.safetensors", network(Form::EEM_SAN, true, narrow));
    folder.good("train actor --quick --recipe third --threads 1 --rounds 1 --out t");
    for (line, parts) in [
        ("halve n.safetensors -o n.safetensors", ["n.safetensors: is an input", "name of its own"]),
        ("halve no.safetensors -o h.st", ["no.safetensors: not a readable", "export the weights"]),
        (
            "halve large.safetensors -o h.st",
            ["large.safetensors: tensor actor.decision.1.weight: element 3 is -70000", "65504"],
        ),
        ("halve narrow.safetensors -o h.st", ["h.st: population.laser", "must be above 0"]),
        ("halve n.safetensors -o no/such/h.st", ["no/such", ""]),
        ("halve t/checkpoint.safetensors -o h.st", ["the checkpoint of a training", "beside it"]),
        ("drive t/checkpoint.safetensors", ["t/checkpoint.safetensors: is the", "beside it"]),
        (
            "compile t/checkpoint.safetensors -o m.map",
            ["the checkpoint of a training", "beside it"],
        ),
        (
            "train actor --quick --from t/checkpoint.safetensors --out u",
            ["the checkpoint of a training", "beside it"],
        ),
    ] {
        refused(&folder, line, &parts);
    }
}
