//! Input that cannot be used: each a clear error, exit code 2, no panic, no output.

use std::collections::BTreeMap;

use safetensors::Dtype;
use safetensors::tensor::TensorView;
use spikeloop::net::builtin;
use spikeloop::npz;

use crate::cli::{Folder, Ran, reflex_map, reflex_spikes};

/// Text of an output file that was there before.
const OLD: &[u8] = b"what was there before";
/// Most lines of an error. Long ones quote a place in a file or say how to get help.
const ERROR_LINES_MAX: usize = 6;

/// Runs `line`, which must fail with an error that holds every part of `parts` and leave the
/// folder as it is, old outputs included.
pub(crate) fn refused(folder: &Folder, line: &str, parts: &[&str]) -> Ran {
    let outputs = ["out.map", "out.json", "out.npz", "out.svg", "out.html"];
    for name in outputs {
        folder.write(name, OLD);
    }
    let before = folder.names();
    let ran = folder.run(line);
    assert_eq!(ran.code, Some(2), "spikeloop {line}: {}{}", ran.out, ran.err);
    assert!(ran.err.starts_with("error: "), "spikeloop {line}: {}", ran.err);
    assert!(!ran.err.contains("panicked"), "spikeloop {line}: {}", ran.err);
    assert!(ran.err.lines().count() <= ERROR_LINES_MAX, "spikeloop {line}: {}", ran.err);
    for part in parts {
        assert!(ran.err.contains(part), "spikeloop {line}: no {part:?} in {}", ran.err);
    }
    assert_eq!(folder.names(), before, "spikeloop {line} leaves something behind");
    for name in outputs {
        assert_eq!(folder.read(name), OLD, "spikeloop {line} changes {name}");
    }
    ran
}

const RUN: &str = "-o out.npz --json out.json";
const DRIVE: &str = "--trials 2 --json out.json --plot out.svg";

#[test]
fn damaged_core_maps_are_refused_by_every_verb_that_reads_one() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0], &[6]));
    let good = folder.read("reflex.map");
    let changed = |at: usize, value: u8| {
        let mut bytes = good.clone();
        bytes[at] = value;
        bytes
    };
    let end = good.len();
    let cases: [(Vec<u8>, &str); 8] = [
        (Vec::new(), "bad.map: not a core map; make one with `spikeloop compile NETWORK -o MAP`"),
        (good[..5].to_vec(), "bad.map: not a core map"),
        (good[..30].to_vec(), "30 bytes of content"),
        (good[..end - 1].to_vec(), "the file is truncated or has been appended to"),
        ([&good[..], b"x"].concat(), "the file is truncated or has been appended to"),
        (changed(end / 2, good[end / 2] ^ 4), "the file is damaged; compile the network again"),
        (changed(8, 99), "bad.map: version 99 found, 3 expected; compile the network again"),
        (changed(0, b'X'), "bad.map: not a core map"),
    ];
    for (bytes, part) in cases {
        folder.write("bad.map", bytes);
        refused(&folder, "inspect bad.map", &[part]);
        refused(&folder, &format!("run bad.map --spikes in.npz {RUN}"), &[part]);
        refused(&folder, &format!("drive bad.map {DRIVE}"), &[part]);
    }
}

#[test]
fn a_map_is_no_network_and_a_network_no_map() {
    let folder = Folder::new();
    reflex_map(&folder);
    write_tiny(&folder, TINY, |_| ());
    let bytes = folder.read("reflex.map");
    for name in ["m.toml", "m.json"] {
        folder.write(name, &bytes);
        let text =
            format!("{name}: is a compiled core map; give the network that it was made from");
        refused(&folder, &format!("compile {name} -o out.map"), &[&text]);
    }
    refused(&folder, "compile ./reflex.map -o out.map", &["is a compiled core map"]);
    refused(&folder, "inspect tiny.toml", &["tiny.toml: not a core map; make one with"]);
    refused(&folder, &format!("run tiny.toml --spikes in.npz {RUN}"), &["not a core map"]);
    folder.write("w.bin", b"format = 1");
    refused(&folder, &format!("drive w.bin {DRIVE}"), &["w.bin: not a core map"]);
}

/// A network of 24-3-2 neurons.
const TINY: &str = r#"
format = 1
name = "tiny"
weights = "tiny.safetensors"
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
neurons = 3
weight = "a.weight"
[[layers]]
name = "b"
neurons = 2
weight = "b.weight"
"#;

/// Writes a description and its weights, changed by `change`.
fn write_tiny(folder: &Folder, text: &str, change: impl Fn(&mut BTreeMap<&str, Vec<f32>>)) {
    let mut values = BTreeMap::from([("a.weight", vec![0.25; 72]), ("b.weight", vec![-0.5; 6])]);
    change(&mut values);
    let bytes: BTreeMap<&str, Vec<u8>> = values
        .iter()
        .map(|(name, values)| (*name, values.iter().flat_map(|v| v.to_le_bytes()).collect()))
        .collect();
    let mut views = BTreeMap::new();
    for (name, bytes) in &bytes {
        let columns = if *name == "a.weight" { 24 } else { 3 };
        let shape = vec![bytes.len() / 4 / columns, columns];
        views.insert(*name, TensorView::new(Dtype::F32, shape, bytes).unwrap());
    }
    folder.write("tiny.safetensors", safetensors::serialize(&views, None).unwrap());
    folder.write("tiny.toml", text);
}

/// `compile` and `drive` of the tiny network must both refuse it.
fn refused_tiny(folder: &Folder, parts: &[&str]) {
    refused(folder, "compile tiny.toml -o out.map", parts);
    refused(folder, &format!("drive tiny.toml {DRIVE}"), parts);
}

#[test]
fn the_tiny_network_itself_is_good() {
    let folder = Folder::new();
    write_tiny(&folder, TINY, |_| ());
    folder.good("compile tiny.toml -o tiny.map");
    folder.good("drive tiny.toml tiny.map --trials 1");
    // Its weights in half the bytes are the same ones: 0.25 and -0.5 are numbers of 16 bits.
    folder.good("halve tiny.safetensors -o half.safetensors");
    assert!(folder.read("half.safetensors").len() < folder.read("tiny.safetensors").len());
    folder.good("compile tiny.toml --weights half.safetensors -o half.map");
    assert!(folder.read("half.map") == folder.read("tiny.map"));
}

#[test]
fn weights_of_another_shape_or_not_finite_are_refused() {
    let folder = Folder::new();
    write_tiny(&folder, TINY, |values| values.get_mut("a.weight").unwrap().truncate(48));
    let shape = "tiny.safetensors: layer a: tensor a.weight: F32 [2, 24] found, F32 or F16 [3, 24] expected";
    refused_tiny(&folder, &[shape]);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        write_tiny(&folder, TINY, |values| values.get_mut("b.weight").unwrap()[4] = value);
        let text = format!("tensor b.weight: element 4 is {value}, must be finite");
        refused_tiny(&folder, &[&text]);
    }
    folder.write("tiny.safetensors", b"\xff\xff\xff\xff\xff\xff\xff\xff{}");
    refused_tiny(&folder, &["tiny.safetensors: not a readable safetensors file ("]);
    std::fs::remove_file(folder.path("tiny.safetensors")).unwrap();
    refused_tiny(&folder, &["tiny.safetensors: cannot read: "]);
}

#[test]
fn descriptions_with_bad_numbers_or_keys_are_refused() {
    let folder = Folder::new();
    let cases = [
        ("threshold = 0.5", "threshold = -0.031", "layer a: threshold = -0.031, must be positive"),
        ("threshold = 0.5", "threshold = 0.0", "layer a: threshold = 0, must be positive"),
        ("threshold = 0.5", "threshold = nan", "layer a: threshold = NaN, must be positive"),
        ("format = 1", "format = 9", "tiny.toml: header: format = 9, must be 1"),
        ("steps = 5", "steps = 0", "header: steps = 0, must be 1..=4096"),
        (
            "name = \"tiny\"",
            "name = \"a\\nb\"",
            "header: name = \"a\\nb\", must be 1..=256 characters",
        ),
        ("steps = 5", "steps = 5\nrelay = true\nspeed = 1", "unknown field `speed`"),
        ("name = \"a\"", "name = \"b\"", "two layers are called b"),
        (
            "name = \"a\"",
            "name = \"a b\"",
            "tiny.toml: layer: name = \"a b\", must be 1..=256 visible ASCII characters, no blank",
        ),
        ("name = \"a\"", "name = \"\"", "layer: name = \"\", must be 1..=256 visible"),
        ("neurons = 3", "neurons = 99999999", "layer a: neurons = 99999999, must be 1..=1048576"),
    ];
    for (from, to, part) in cases {
        assert!(TINY.contains(from), "{from}");
        write_tiny(&folder, &TINY.replacen(from, to, 1), |_| ());
        refused_tiny(&folder, &[part]);
    }
    let relay = TINY.replacen("steps = 5", "steps = 5\nrelay = true", 1);
    write_tiny(&folder, &relay.replacen("name = \"a\"", "name = \"relay\"", 1), |_| ());
    refused_tiny(&folder, &["layer: name = relay, must be another name"]);
    folder.write("tiny.toml", b"\xff\xfe");
    refused_tiny(&folder, &["tiny.toml: not UTF-8 text (byte 0)"]);
}

#[test]
fn networks_that_the_chip_cannot_express_are_refused() {
    let folder = Folder::new();
    write_tiny(&folder, TINY, |values| values.get_mut("a.weight").unwrap().fill(0.0));
    refused(&folder, "compile tiny.toml -o out.map", &["layer a: all weights and biases are zero"]);
    write_tiny(&folder, TINY, |values| values.get_mut("a.weight").unwrap()[0] = 1e9);
    let small =
        "layer a: threshold 0.5 -> mantissa 0, must be 1..=131071; the threshold is too small";
    refused(&folder, "compile tiny.toml -o out.map", &[small]);
    let text = TINY.replacen("threshold = 0.5", "threshold = 1e300", 1);
    write_tiny(&folder, &text, |_| ());
    refused(&folder, "compile tiny.toml -o out.map", &["too large beside the weights"]);
    write_tiny(&folder, &TINY.replace("\"a\"", "\"a b\""), |_| ());
    refused(&folder, "compile tiny.toml -o out.map", &["\"a b\"", "no blank"]);
}

fn chip_with(folder: &Folder, from: &str, to: &str) {
    let chip = include_str!("../../hw_model/chips/loihi1.toml");
    let changed = chip.replacen(from, to, 1).replace("name = \"loihi1\"", "name = \"small\"");
    assert!(chip.contains(from), "{from}");
    folder.write("chip.toml", changed);
}

#[test]
fn over_full_chips_name_layer_resource_value_limit_and_a_way_out() {
    let folder = Folder::new();
    let cases: [(&str, &str, &[&str]); 7] = [
        (
            "voltage_bits = 23",
            "voltage_bits = 11",
            &["layer pools: threshold 1 -> mantissa 63, must be 1..=31; it is too large beside"],
        ),
        (
            "input_axons_per_core = 4096",
            "input_axons_per_core = 4",
            &["layer wheels: one neuron needs 7 input axons, limit 4 per core; reduce the fan-in"],
        ),
        (
            "synapse_words_per_core = 16384",
            "synapse_words_per_core = 3",
            &["one neuron needs", "synapse memory words, limit 3 per core; reduce the fan-in"],
        ),
        (
            "synapse_formats_per_core = 7",
            "synapse_formats_per_core = 1",
            &["2 synapse formats, limit 1 (small.synapse_formats_per_core); use fewer"],
        ),
        (
            "cores = 128",
            "cores = 1",
            &[
                "2 cores needed, limit 1 (small.cores): pools 1 (6 neurons), wheels 1 (2 neurons); use",
            ],
        ),
        (
            "threshold_mantissa_bits = 17",
            "threshold_mantissa_bits = 4",
            &["layer pools: threshold 1 -> mantissa 63, must be 1..=15"],
        ),
        (
            "compartment_configs_per_core = 32",
            "compartment_configs_per_core = 0",
            &["limit 0 (small.compartment_configs_per_core)"],
        ),
    ];
    for (from, to, parts) in cases {
        chip_with(&folder, from, to);
        refused(&folder, "compile reflex --chip chip.toml -o out.map", parts);
    }
}

#[test]
fn a_layer_with_too_many_neurons_is_refused_before_it_is_laid_out() {
    let folder = Folder::new();
    let net = r#"{"name": "big", "delta_u": 1, "delta_v": 1, "projections": [],
        "populations": [{"name": "l", "n": 1000000, "kind": "lif", "vth_mant": 5}]}"#;
    folder.write("n.json", net);
    folder.write("n.npz", npz::to_bytes(&[]).unwrap());
    let text =
        "layer l: its 1000000 neurons need more cores than the limit of 128 (loihi1.cores); make";
    refused(&folder, "compile n.json -o out.map", &[text]);
    refused(&folder, "compile n.json --neurons-per-core 1 -o out.map", &[text]);
    refused(&folder, "compile n.json --neurons-per-core 0 -o out.map", &["0 is not in 1..="]);
    refused(&folder, "compile n.json --cores 0 -o out.map", &["0 is not in 1..="]);
    let line = "compile n.json --cores 4 --neurons-per-core 1 -o out.map";
    refused(&folder, line, &["cannot be used with"]);
    let beyond = "129 cores are more than the limit of 128 (loihi1.cores); ask for at most that";
    refused(&folder, "compile reflex --cores 129 -o out.map", &[beyond]);
    let few = "6 cores needed, 5 asked for: fuse.laser 1 (20 neurons), ";
    refused(&folder, "compile laser-only --cores 5 -o out.map", &[few, "; ask for 6 or more"]);
}

#[test]
fn chip_files_with_nonsense_are_refused() {
    let folder = Folder::new();
    let cases = [
        ("cores = 128 ", "cores = 100000 ", "chip small: limits.cores = 100000, must be 1..=128"),
        ("cores = 128 ", "cores = -1 ", "chip chip.toml: TOML parse error"),
        ("voltage_bits = 23", "voltage_bits = 99", "arithmetic.voltage_bits = 99, must be 1..=30"),
        ("chip_mw = 104.0", "chip_mw = nan", "static_power.chip_mw = NaN"),
        ("tiles_x = 8", "tiles_x = 0", "limits.cores = 128, must be"),
        ("[limits]", "[limits]\nsugar = 1", "unknown field `sugar`"),
        ("synaptic_op_dense = 23.6", "synaptic_op_dense = inf", "synaptic_op_dense = inf"),
    ];
    for (from, to, part) in cases {
        chip_with(&folder, from, to);
        refused(&folder, "compile reflex --chip chip.toml -o out.map", &[part]);
    }
    let unknown = "chip loihi9: no such built-in chip (there is: loihi1); or give the path of";
    refused(&folder, "compile reflex --chip loihi9 -o out.map", &[unknown]);
    refused(&folder, "compile reflex --chip no.toml -o out.map", &["no.toml: cannot read: "]);
}

#[test]
fn missing_files_and_folders_as_files_are_refused() {
    let folder = Folder::new();
    reflex_map(&folder);
    std::fs::create_dir(folder.path("dir.map")).unwrap();
    std::fs::create_dir(folder.path("dir.toml")).unwrap();
    let cases = [
        "compile no.toml -o out.map",
        "compile dir.toml -o out.map",
        "compile no.json -o out.map",
        "compile san --weights no.safetensors -o out.map",
        "compile san --weights dir.map -o out.map",
        "inspect no.map",
        "inspect dir.map",
        "run no.map --spikes no.npz",
        "run reflex.map --spikes no.npz -o out.npz",
        "run reflex.map --spikes dir.map -o out.npz",
        "drive no.map --json out.json",
        "drive no.toml --json out.json",
        "report no.json -o out.html",
        "report dir.map -o out.html",
    ];
    for line in cases {
        refused(&folder, line, &["cannot read: "]);
    }
    refused(&folder, "drive reflex --arena no.json", &["no.json: cannot be read", "courtyard"]);
    refused(&folder, "drive reflex --arena dir.map", &["dir.map: cannot be read"]);
    refused(&folder, "drive reflex --pairs no.json", &["no.json: cannot be read"]);
    refused(&folder, "trace check no.trace", &["no.trace: cannot read: "]);
    refused(&folder, "trace check dir.map", &["dir.map: no trace files (*.trace) there"]);
    refused(&folder, "trace record dir.map", &["dir.map: no trace files (*.trace) there"]);
}

#[test]
fn unknown_names_list_the_known_ones() {
    let folder = Folder::new();
    let trained = builtin::trained_names().collect::<Vec<_>>().join(", ");
    let known = format!("a built-in network (there is: reflex, san, {trained})");
    let known = format!("nobody: neither a file nor {known}");
    let cases = [
        ("compile nobody -o out.map", known.as_str()),
        ("drive reflex straight reflex", "driver reflex: given twice; leave one out"),
        (
            "compile reflex --policy p -o out.map",
            "policy p: no such policy (there is: nearest, san, ",
        ),
        ("compile san -o out.map", "san: names no weights file; give one with --weights FILE"),
        ("compile reflex --weights w -o out.map", "takes no weights; leave --weights out"),
        ("drive nobody --json out.json", "nobody: neither a file nor a built-in network"),
        (
            "drive laser_only",
            "laser_only: neither a file nor a built-in network (did you mean laser-only",
        ),
        ("drive compare/eem_san", "(did you mean compare/eem-san or compare/eem-san-"),
        ("drive straight --weights w --json out.json", "w: weights are for networks"),
        ("drive reflex --arena garden", "built-in arenas are courtyard, courtyard-moving"),
        ("completions tcsh", "invalid value 'tcsh'"),
    ];
    for (line, part) in cases {
        refused(&folder, line, &[part]);
    }
}

#[test]
fn unwritable_outputs_are_refused_before_the_work_begins() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0], &[6]));
    folder.write("file", b"");
    let cases = [
        "compile reflex -o no/out.map",
        "compile reflex -o .",
        "compile reflex -o file/out.map",
        "run reflex.map --spikes in.npz -o out.npz --json no/out.json",
        "run reflex.map --spikes in.npz -o no/out.npz --json out.json",
        "drive reflex --trials 10000 --json out.json --plot no/p.svg",
        "drive reflex --trials 10000 --json .. --plot out.svg",
    ];
    for line in cases {
        let ran = refused(&folder, line, &["cannot write: "]);
        assert_eq!(ran.out, "", "spikeloop {line} began");
    }
    refused(
        &folder,
        "demo --network reflex --trials 1 -o file",
        &["file: cannot make the folder: "],
    );
}

#[test]
fn outputs_that_would_replace_an_input_or_each_other_are_refused() {
    let folder = Folder::new();
    reflex_map(&folder);
    write_tiny(&folder, TINY, |_| ());
    folder.write("in.npz", reflex_spikes(&[0], &[6]));
    folder.write("a.json", br#"{"arena": {"xmin": 0, "xmax": 12, "ymin": 0, "ymax": 12}}"#);
    folder.write("net.json", INTEGERS);
    folder.write("net.npz", b"");
    folder.write("b.svg", b"{}");
    let cases = [
        "compile tiny.toml -o tiny.safetensors",
        "compile net.json -o net.npz",
        "drive tiny.toml --json tiny.safetensors",
        "evaluate chip:tiny.toml --map map1 --condition static-1.0 --json tiny.toml",
        "evaluate tiny.toml --map map1 --condition static-1.0 --state tiny.safetensors",
        "camera --arena a.json --events a.json",
        "drive straight --arena a.json#1 --json a.json",
        "evaluate straight --map a.json#2 --json ./a.json",
        "study laser-only --map a.json#1 --state a.json",
        "arena b.svg#1 -o b.svg",
        "drive reflex --json new --replay ./new",
        "compile tiny.toml -o ./tiny.toml",
        "compile tiny.toml --weights tiny.safetensors -o tiny.safetensors",
        "run reflex.map --spikes in.npz -o in.npz",
        "run reflex.map --spikes in.npz -o new --json new",
        "drive reflex.map --plot reflex.map",
        "drive reflex --json out.json --plot ./out.json",
        "report out.json -o out.json",
    ];
    for line in cases {
        let ran = refused(&folder, line, &["is an input or another output as well"]);
        assert_eq!(ran.out, "", "spikeloop {line} began");
    }
    folder.good("inspect reflex.map");
}

#[test]
fn outputs_among_pictures_that_could_replace_them_are_refused() {
    let folder = Folder::new();
    let cases = [
        "evaluate reflex --plot all --json all/r.svg",
        "evaluate reflex --plot all --state ./all/s.SVG",
        "camera --frames all --json all/../all/tick_00000.png",
    ];
    std::fs::create_dir(folder.path("all")).unwrap();
    for line in cases {
        refused(&folder, line, &["lies among the pictures of all, which could replace it"]);
    }
}

#[test]
fn a_name_as_long_as_the_file_system_allows_can_be_written() {
    let folder = Folder::new();
    let name = "n".repeat(251);
    folder.good(&format!("arena map1 -o {name}.svg"));
    assert_eq!(folder.names(), [format!("{name}.svg")]);
}

#[test]
fn arenas_without_room_or_sense_are_refused() {
    let folder = Folder::new();
    let bounds = r#""arena": {"xmin": 0, "xmax": 9, "ymin": 0, "ymax": 9}"#;
    let disc = |name: &str, radius: &str| {
        format!(
            r#"{{"name": "{name}", "shape": "cylinder", "x": 4, "y": 4, "radius": {radius}, "height": 1}}"#
        )
    };
    let with = |obstacles: &str| format!(r#"{{{bounds}, "obstacles": [{obstacles}]}}"#);
    let full = with(&disc("rock", "20"));
    let cases: [(&str, &str); 9] = [
        (&full, "no free start"),
        (r#"{"arena": {"xmin": 0, "xmax": 3, "ymin": 0, "ymax": 3}}"#, "no goal 6 m or more"),
        ("{", "a.json: "),
        ("[]", "a.json: "),
        ("{}", "a.json: "),
        (&with(&disc("rock", "-1")), "rock"),
        (&with(&disc("rock", "1e999")), "a.json: "),
        (&with(&disc("rock", "1").replace("cylinder", "blob")), "use box, polygon or cylinder"),
        (&format!(r#"{{{bounds}, "obstacels": []}}"#), "obstacels"),
    ];
    for (text, part) in cases {
        folder.write("a.json", text);
        refused(&folder, &format!("drive reflex --arena a.json {DRIVE}"), &[part]);
    }
}

#[test]
fn pairs_that_do_not_fit_the_arena_or_the_trials_are_refused() {
    let folder = Folder::new();
    let cases = [
        (
            r#"{"starts": [[99, 0, 0]], "goals": [[1, 1]]}"#,
            "trial 0: start (99, 0) is outside of arena courtyard",
        ),
        (r#"{"starts": [[1, 1, 0]], "goals": [[1, 1], [2, 2]]}"#, "1 starts and 2 goals"),
        (r#"{"starts": [], "goals": []}"#, "0 starts and 0 goals"),
        (r#"{"starts": [[1, 1]], "goals": [[1, 1]]}"#, "trial 0: start has 2 numbers, needs 3"),
        (r#"{"starts": 3}"#, "expected {\"starts\": [[x, y, yaw], ..]"),
        ("", "p.json: "),
    ];
    for (text, part) in cases {
        folder.write("p.json", text);
        refused(&folder, "drive reflex --pairs p.json --json out.json", &[part]);
    }
    folder.write("p.json", r#"{"starts": [[1, 1, 0]], "goals": [[1, 1]]}"#);
    let text = "p.json: 1 pairs, --trials 5; ask for 1 or fewer";
    refused(&folder, "drive reflex --pairs p.json --trials 5 --json out.json", &[text]);
}

#[test]
fn settings_out_of_range_are_refused() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0], &[6]));
    let cases = [
        ("drive reflex --v-max nan", "wheel speed (m/s) is NaN, must be 0.05..=10"),
        ("drive reflex --v-max -1", "wheel speed (m/s) is -1, must be 0.05..=10"),
        ("drive reflex --v-max 1e308", "wheel speed (m/s) is 1e308, must be 0.05..=10"),
        ("drive reflex --v-max fast", "invalid value 'fast' for '--v-max"),
        ("drive reflex --plot x.PNG", "pictures are written as SVG; let the name end in .svg"),
        ("drive reflex --repeats 0", "'--repeats <N>': 0 is not in 1..=1000"),
        ("drive reflex --repeats 1001", "1001 is not in 1..=1000"),
        ("drive reflex --repeats 2 --seed 18446744073709551615", "take a smaller seed"),
        ("drive reflex --trials 0", "'--trials <N>': 0 is not in 1..=10000"),
        ("drive reflex --trials -1", "'--trials <N>': -1 is not in 1..=10000"),
        ("drive reflex --trials 10001", "10001 is not in 1..=10000"),
        ("drive reflex --threads 0", "'--threads <K>': 0 is not in 1..=256"),
        ("drive reflex --threads 1000000", "1000000 is not in 1..=256"),
        ("drive reflex --control-hz 7", "control rate 7 Hz must divide the physics rate of 100 Hz"),
        ("drive reflex --control-hz 0", "control rate 0 Hz must divide"),
        ("drive reflex --ticks-max 0", "tick limit is 0, must be 1..=1000000"),
        ("drive reflex --actuators jelly", "actuators \"jelly\": not understood; use ideal, lag"),
        ("drive reflex --actuators v:9+0,w:0+0", "command delay 9 s, must be 0..=2 s"),
        (
            "drive reflex --actuators v:0+nan,w:0+0",
            "time constant NaN s, must be 0 or 0.001..=10 s",
        ),
        ("drive", "required arguments were not provided"),
        ("demo --trials 0", "0 is not in 1..=10000"),
        ("run reflex.map --spikes in.npz --steps 0", "'--steps <N>': 0 is not in 1..=10000000"),
        ("run reflex.map --spikes in.npz --steps 1000000000000", "is not in 1..=10000000"),
        ("run reflex.map --spikes in.npz --threads 0", "0 is not in 1..=256"),
        ("run reflex.map --spikes in.npz --engine sparse", "possible values: event, dense"),
        ("inspect reflex.map --json --dump", "cannot be used with"),
        ("inspect reflex.map --json --picture p.svg", "cannot be used with"),
        ("inspect reflex.map --picture reflex.map", "reflex.map: is an input or another output"),
        ("inspect reflex.map --picture no/p.svg", "no/p.svg: "),
    ];
    for (line, part) in cases {
        let json = if line.starts_with("drive ") { "--json out.json" } else { "" };
        refused(&folder, &format!("{line} {json}"), &[part]);
    }
}

/// A .npy file with the given type and shape over `data`.
fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// An archive with the given arrays for `in_t` and `in_i`, and empty ones for the biases.
fn archive(steps: &[u8], lines: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let empty = npy("<i4", "False", "(0,)", b"");
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let arrays = [("in_t", steps), ("in_i", lines), ("bias_t", &empty), ("bias_i", &empty)];
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), zip::write::FileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn longs(values: &[i64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    npy("<i8", "False", &format!("({},)", values.len()), &data)
}

#[test]
fn spike_files_with_bad_arrays_are_refused() {
    let folder = Folder::new();
    reflex_map(&folder);
    let one = longs(&[0]);
    let floats = npy("<f8", "False", "(1,)", &[0; 8]);
    let nested = npy("<i8", "False", &format!("{}1{}", "(".repeat(200), ")".repeat(200)), &[0; 8]);
    let cases: [(Vec<u8>, Vec<u8>, &str); 18] = [
        (floats.clone(), one.clone(), "array in_t: has the type '<f8', whole numbers expected"),
        (one.clone(), floats, "array in_i: has the type"),
        (
            npy("<u8", "False", "(1,)", &u64::MAX.to_le_bytes()),
            one.clone(),
            "array in_t: has the value 18446744073709551615, too large",
        ),
        (longs(&[1, 2]), one.clone(), "in_t has 2 elements, in_i has 1; they must be pairs"),
        (longs(&[-3]), one.clone(), "element 0 of in_t is -3, must be 0 or more"),
        (
            longs(&[0, 700]),
            longs(&[0, 24]),
            "element 1 of in_i is 24, must be 0..=23 (lines of port in)",
        ),
        (one.clone(), longs(&[-1]), "element 0 of in_i is -1, must be 0..=23"),
        (one.clone(), longs(&[1 << 40]), "element 0 of in_i is 1099511627776, must be"),
        (
            longs(&[i64::MAX - 1]),
            one.clone(),
            "last input spike is at step 9223372036854775806, limit 10000000 steps; give --steps N",
        ),
        (npy("<i8", "False", "(1, 1)", &[0; 8]), one.clone(), "shape [1, 1] found, one dimension"),
        (npy("<i8", "True", "(1,)", &[0; 8]), one.clone(), "is in Fortran order"),
        (npy("<i8", "False", "(9,)", &[0; 8]), one.clone(), "array in_t: "),
        (
            npy("<i8", "False", "(99999999999999999999,)", b""),
            one.clone(),
            "without a shape that can be read",
        ),
        (npy("<i8", "False", "(4294967296, 4294967296)", b""), one.clone(), "larger than the data"),
        (
            npy("<i8", "False", "(0, 4294967296, 4294967296)", b""),
            one.clone(),
            "larger than the data",
        ),
        (
            npy("<i8", "False", "(4294967296, 4294967296, 0)", b""),
            one.clone(),
            "larger than the data",
        ),
        (nested, one.clone(), "brackets in its header, limit 6 (BRACKETS_MAX)"),
        (b"hello".to_vec(), one, "array in_t: is not a NumPy array"),
    ];
    for (steps, lines, part) in cases {
        folder.write("in.npz", archive(&steps, &lines));
        refused(&folder, &format!("run reflex.map --spikes in.npz {RUN}"), &["in.npz: ", part]);
    }
}

#[test]
fn a_far_spike_is_no_error_when_the_steps_are_given() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", archive(&longs(&[0, i64::MAX]), &longs(&[6, 6])));
    let ran = folder.good("run reflex.map --spikes in.npz --steps 4");
    assert!(ran.out.contains("2 input spikes, 1 of them after the last step"), "{}", ran.out);
    let one = ["in_t", "in_i", "bias_t", "bias_i", "out_t", "out_i", "W"];
    let arrays = one.map(|name| (name.to_owned(), vec![0]));
    folder.write("in.npz", npz::to_bytes(&arrays).unwrap());
    let ran = folder.good("run reflex.map --spikes in.npz --json r.json");
    assert!(ran.out.contains("\nnot injected, as no port has that name: out\n"), "{}", ran.out);
    let input = serde_json::json!({ "spikes": 2, "late": 0, "repeated": 0 });
    assert_eq!(folder.json("r.json")["input"], input);
    // Numbers without a sign are as good.
    let unsigned = npy("<u8", "False", "(1,)", &2u64.to_le_bytes());
    folder.write("in.npz", archive(&unsigned, &longs(&[6])));
    folder.good("run reflex.map --spikes in.npz --steps 4");
}

#[test]
fn spike_files_that_are_no_archive_or_lack_arrays_are_refused() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", b"hello");
    let run = format!("run reflex.map --spikes in.npz {RUN}");
    refused(&folder, &run, &["in.npz: not a readable npz archive ("]);
    folder.write("in.npz", npz::to_bytes(&[("in_t".to_owned(), vec![0])]).unwrap());
    refused(&folder, &run, &["in.npz: array in_i: is not there (there is: in_t)"]);
    let good = reflex_spikes(&[0; 100], &[6; 100]);
    folder.write("in.npz", &good[..good.len() / 2]);
    refused(&folder, &run, &["in.npz: "]);
}

const INTEGERS: &str = r#"{"name": "n", "delta_u": 2048, "delta_v": 1024,
    "populations": [{"name": "in", "n": 2, "kind": "input"},
                    {"name": "out", "n": 1, "kind": "lif", "vth_mant": 10}],
    "projections": [{"name": "p", "src": "in", "dst": "out", "kind": "dense", "w": "W"}]}"#;

/// An npz file with `W` of shape [2, 1].
pub(crate) fn integer_weights(values: [i64; 2]) -> Vec<u8> {
    use std::io::Write;
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    zip.start_file("W.npy", zip::write::FileOptions::default()).unwrap();
    zip.write_all(&npy("<i8", "False", "(2, 1)", &data)).unwrap();
    zip.finish().unwrap().into_inner()
}

#[test]
fn integer_networks_with_wrong_references_or_numbers_are_refused() {
    let folder = Folder::new();
    folder.write("n.npz", integer_weights([2, -256]));
    folder.write("n.json", INTEGERS);
    folder.good("compile n.json -o n.map");
    // Notes of how it was made change nothing.
    folder.write(
        "n.json",
        INTEGERS.replacen("\"delta_v\"", "\"steps\": 9, \"seed\": 1, \"delta_v\"", 1),
    );
    folder.good("compile n.json -o notes.map");
    assert!(folder.read("n.map") == folder.read("notes.map"));
    let cases = [
        ("\"src\": \"in\"", "\"src\": \"nobody\"", "n.json: no population is called nobody"),
        ("\"dst\": \"out\"", "\"dst\": \"in\"", "projection p: in is an input, it has no synapses"),
        ("\"w\": \"W\"", "\"w\": \"V\"", "n.npz: array V: is not there (there is: W)"),
        ("\"dense\"", "\"dance\"", "projection p: kind dance found, dense or conv2d expected"),
        ("\"lif\"", "\"liv\"", "population out: kind liv found, input or lif expected"),
        ("\"n\": 2", "\"n\": 3", "tensor W: shape [2, 1] found, shape [3, 1] expected"),
        ("\"n\": 2", "\"n\": 0", "population in: n = 0, must be 1..=1048576"),
        ("\"vth_mant\": 10", "\"vth_mant\": -10", "invalid value: integer `-10`"),
        (
            "\"vth_mant\": 10",
            "\"vth_mant\": 0",
            "n.json: population out: vth_mant = 0, must be 1 or more",
        ),
        (
            "\"vth_mant\": 10",
            "\"vth_mant\": 200000",
            "n.json: core 0 (out), group 0: threshold mantissa = 200000, must be 1..=131071",
        ),
        (
            "\"w\": \"W\"}",
            "\"w\": \"W\"}, {\"name\": \"q\", \"src\": \"in\", \"dst\": \"out\", \"kind\": \"dense\", \"w\": \"W\"}",
            "n.json: projection q: from in onto out with weights W, as projection p; leave one out",
        ),
        (
            "\"name\": \"out\"",
            "\"name\": \"o t\"",
            "n.json: population \"o t\": must be of visible ASCII",
        ),
        ("\"vth_mant\": 10", "\"bias\": 0", "population out: vth_mant is missing"),
        ("\"vth_mant\": 10", "\"vth_mant\": 1, \"bias\": 4", "population out: bias = 4"),
        ("\"delta_u\": 2048", "\"delta_u\": 5000", "n.json: delta_u = 5000, must be 0..=4096"),
        ("\"name\": \"out\"", "\"name\": \"in\"", "population \"in\": name given twice"),
        ("\"delta_v\": 1024", "\"delta_v\": 1024, \"dt\": 1", "the file: unknown key \"dt\""),
        (
            "\"vth_mant\": 10",
            "\"vth_mant\": 10, \"delta_u\": 4096",
            "population \"out\": unknown key \"delta_u\"; correct or remove it",
        ),
        ("\"w\": \"W\"", "\"w\": \"W\", \"delay\": 2", "projection \"p\": unknown key \"delay\""),
        ("{\"name\": \"n\"", "{\"name\": \"n\\nm\"", "the file: name \"n\\nm\", must be 1..=256"),
        ("\"name\": \"in\"", "\"name\": \"\"", "population: name \"\", must be 1..=256"),
        ("{\"name\": \"n\"", "[{\"name\": \"n\"", "n.json: "),
    ];
    for (from, to, part) in cases {
        let text = INTEGERS.replacen(from, to, 1);
        assert_ne!(text, INTEGERS, "{from}");
        folder.write("n.json", text);
        refused(&folder, "compile n.json -o out.map", &[part]);
    }
    folder.write("n.json", INTEGERS);
    for weights in [[3, 0], [256, 0], [0, -258], [i64::MAX, 0]] {
        folder.write("n.npz", integer_weights(weights));
        let part = "found, even mantissas in -256..=254 expected";
        refused(
            &folder,
            "compile n.json -o out.map",
            &["n.npz: layer out: tensor W: weight", part],
        );
    }
    refused(&folder, "compile n.json --policy san -o out.map", &["--policy san cannot apply"]);
    let text =
        "n.json: an integer network without encoder and decoder cannot drive; compile it and use";
    refused(&folder, &format!("drive n.json {DRIVE}"), &[text]);
    refused(&folder, "study n.json --trials 1", &[text]);
    folder.write("n.trace", "network n.json\n");
    refused(&folder, "trace record n.trace", &[text]);
    refused(
        &folder,
        &format!("drive n.map {DRIVE}"),
        &["a map without encoder and decoder cannot drive; use `spikeloop run`"],
    );
}

const CONVOLUTION: &str = r#"{"name": "n", "delta_u": 2048, "delta_v": 1024,
    "populations": [{"name": "in", "n": 2, "kind": "input"},
                    {"name": "out", "n": 2, "kind": "lif", "vth_mant": 10}],
    "projections": [{"name": "p", "src": "in", "dst": "out", "kind": "conv2d", "w": "W",
                     "in_shape": [1, 2, 1], "out_shape": [2, 1, 1],
                     "kernel": 1, "stride": 2, "pad": 0}]}"#;

#[test]
fn convolutions_whose_parts_do_not_go_together_are_refused() {
    let folder = Folder::new();
    folder.write("n.npz", integer_weights([2, -256]));
    folder.write("n.json", CONVOLUTION);
    let shape = "tensor W: shape [2, 1] found, shape [2, 1, 1, 1] expected";
    refused(&folder, "compile n.json -o out.map", &[shape]);
    let cases = [
        ("\"conv2d\"", "\"conv1d\"", "projection p: kind conv1d found, dense or conv2d expected"),
        ("\"in_shape\": [1, 2, 1], ", "", "projection p: in_shape is missing, a conv2d has it"),
        ("\"stride\": 2, ", "", "projection p: stride is missing"),
        (", \"pad\": 0", "", "projection p: pad is missing"),
        ("\"kernel\": 1", "\"kernel\": 0", "projection p: kernel = 0, must be 1 or more"),
        ("\"stride\": 2", "\"stride\": 0", "projection p: stride = 0, must be 1 or more"),
        ("\"kernel\": 1", "\"kernel\": 3", "kernel 3 is larger than 2 pixels with pad 0"),
        ("\"pad\": 0", "\"pad\": 1", "pad = 1, must be below the kernel of [1, 1]"),
        ("\"stride\": 2", "\"stride\": 1", "out_shape 2x1x1, but the convolution gives 2x2x1"),
        ("[1, 2, 1]", "[1, 2, 2]", "in_shape 1x2x2 is 4 neurons, but in has 2"),
        (
            "\"n\": 2, \"kind\": \"input\"",
            "\"n\": 3, \"kind\": \"input\"",
            "in_shape 1x2x1 is 2 neurons, but in has 3",
        ),
        (
            "\"n\": 2, \"kind\": \"lif\"",
            "\"n\": 3, \"kind\": \"lif\"",
            "out_shape 2x1x1 is 2 neurons, but out has 3",
        ),
        ("[2, 1, 1]", "[18446744073709551615, 1, 1]", "must be 1..=16777216"),
        ("[2, 1, 1]", "[16777216, 1, 1]", "out_shape 16777216x1x1 is"),
        ("\"dst\": \"out\"", "\"dst\": \"in\"", "projection p: in is an input"),
    ];
    for (from, to, part) in cases {
        let text = CONVOLUTION.replacen(from, to, 1);
        assert_ne!(text, CONVOLUTION, "{from}");
        folder.write("n.json", text);
        refused(&folder, "compile n.json -o out.map", &[part]);
    }
}

#[test]
fn results_of_another_form_are_refused() {
    let folder = Folder::new();
    let cases = [
        (r#"{"format": 2, "drivers": [], "pairs_mm": []}"#, "r.json: format 2 found, 1 expected"),
        (
            r#"{"format": 1, "drivers": [], "pairs_mm": []}"#,
            "r.json: not a result of `spikeloop drive --json` (missing field",
        ),
        (r#"{"drivers": [], "pairs_mm": []}"#, "missing field `format`"),
        ("{}", "r.json: fields none; not a result"),
        ("[1, 2]", "r.json: fields none; not a result"),
        ("", "r.json: not JSON"),
    ];
    for (text, part) in cases {
        folder.write("r.json", text);
        refused(&folder, "report r.json -o out.html", &[part]);
    }
    // Of an item of a report it is the report that errors name.
    let item = r#"{"file": "good.json", "content": {"drivers": [], "pairs_mm": []}}"#;
    folder.write("r.json", format!(r#"{{"format": 1, "revision": "x", "items": [{item}]}}"#));
    refused(
        &folder,
        "report r.json -o out.html",
        &["r.json: good.json: not a result of `spikeloop dr"],
    );
    folder.write("r.json", "");
    folder.good("drive straight --trials 2 --seed 3 --json good.json");
    refused(&folder, "report good.json r.json -o out.html", &["r.json: not JSON"]);
    let good = folder.json("good.json");
    for what in ["trials", "success", "collision", "time_out"] {
        let mut damaged = good.clone();
        let count = &mut damaged["drivers"][0]["summary"][what];
        let expected = count.as_u64().unwrap();
        *count = (expected + 1).into();
        folder.write("r.json", damaged.to_string());
        let part = format!(
            "r.json: straight to goal, seed 3: {what} is {}, but {expected} trials are so; the file",
            expected + 1
        );
        refused(&folder, "report r.json -o out.html", &[&part]);
    }
}

#[test]
fn traces_that_cannot_be_run_are_refused_and_stay_as_they_are() {
    let folder = Folder::new();
    let cases = [
        ("", "x.trace"),
        ("network nobody\n", "nobody: neither a file nor a built-in network"),
        ("loop reflex\ntrial 99999999999\n", "x.trace:2: trial 99999999999"),
        (
            "loop reflex\ntrial 20000\n",
            "x.trace:2: trial 20000; expected a whole number of 0 to 9999",
        ),
        ("chip loihi1\nsugar\nrun 3\n", "x.trace:2: "),
        ("chip loihi1\nrun 99999999999999\n", "x.trace:2: "),
        ("network reflex\nseed -1\n", "x.trace:2: seed -1; expected a whole number"),
        (
            "network reflex\ndecisions 0\n",
            "x.trace:2: decisions 0; expected a whole number of 1 to",
        ),
    ];
    for (text, part) in cases {
        folder.write("x.trace", text);
        refused(&folder, "trace check x.trace", &[part]);
        refused(&folder, "trace record x.trace", &[part]);
        assert_eq!(folder.read("x.trace"), text.as_bytes());
    }
}

#[cfg(target_os = "linux")]
mod memory {
    use std::process::Command;

    use super::*;

    /// Address space that is enough for every refusal.
    const KIB: u32 = 400_000;

    /// Runs `line` with little memory; a failed allocation would abort.
    fn refused_in_little_memory(folder: &Folder, line: &str, part: &str) {
        let script = format!("ulimit -v {KIB}; exec \"$0\" {line}");
        let mut command = Command::new("sh");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_spikeloop")]);
        let output = command.current_dir(folder.path("")).output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "spikeloop {line}: {err}");
        assert!(err.contains(part), "spikeloop {line}: {err}");
    }

    #[test]
    fn lengths_that_files_only_claim_take_no_memory() {
        let folder = Folder::new();
        reflex_map(&folder);
        let mut map = folder.read("reflex.map");
        map[12..20].fill(0x7f);
        folder.write("bad.map", map);
        refused_in_little_memory(&folder, "inspect bad.map", "the header says");

        write_tiny(&folder, TINY, |_| ());
        let header = [&(90_000_000u64).to_le_bytes()[..], b"{}"].concat();
        folder.write("tiny.safetensors", header);
        refused_in_little_memory(&folder, "compile tiny.toml -o out.map", "safetensors file");

        let huge_header = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}".to_vec();
        let huge_shape = npy("<i8", "False", "(99999999,)", &[0; 8]);
        for array in [huge_header, huge_shape] {
            folder.write("in.npz", archive(&array, &longs(&[0])));
            let line = "run reflex.map --spikes in.npz";
            refused_in_little_memory(&folder, line, "in.npz: array in_t: has a");
        }
        folder.write("in.npz", reflex_spikes(&[0], &[6]));
        let line = "run reflex.map --spikes in.npz --steps 1000000000000";
        refused_in_little_memory(&folder, line, "is not in 1..=10000000");
    }

    #[test]
    fn a_layer_of_a_million_neurons_is_refused_in_little_memory() {
        let folder = Folder::new();
        let net = INTEGERS.replace("\"n\": 1,", "\"n\": 1000000,");
        let (populations, _) = net.split_once("\"projections\"").unwrap();
        folder.write("n.json", format!("{populations}\"projections\": []}}"));
        folder.write("n.npz", npz::to_bytes(&[]).unwrap());
        let line = "compile n.json --neurons-per-core 1 -o out.map";
        refused_in_little_memory(&folder, line, "layer out: its 1000000 neurons need more cores");
    }
}
