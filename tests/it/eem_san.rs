//! EEM-SAN from its file to the closed loop, and the pictures around it.

use serde_json::Value;
use spikeloop::net::{EemSan, builtin};
use spikeloop::nn::lif::LifTrace;
use spikeloop::nn::{Hsvae, HsvaeShape, Rectangular, StateWriter};
use spikeloop::policy::EventFrame;
use spikeloop::reference::FloatEncoder;
use spikeloop::rng::{Streams, stream};

use crate::bad_input::refused;
use crate::cli::{Folder, assert_well_formed};
use crate::fixtures::{Change, eem_san, hsvae};

/// Short trials at the rate of EEM-SAN.
const SHORT: &str = "--arena courtyard-moving --control-hz 20 --ticks-max 6 --trials 2";

const AS_IS: Change = &|_, _, _| ();

fn folder_with_networks() -> Folder {
    let folder = Folder::new();
    folder.write("seeing.safetensors", eem_san(true, AS_IS));
    folder.write("blind.safetensors", eem_san(false, AS_IS));
    folder
}

fn text(folder: &Folder, name: &str) -> String {
    String::from_utf8(folder.read(name)).expect("UTF-8")
}

#[test]
fn drive_puts_the_camera_on_the_robot_of_those_who_need_it() {
    let folder = folder_with_networks();
    let ran = folder.good(&format!(
        "drive straight seeing.safetensors blind.safetensors {SHORT} --json r.json"
    ));
    assert!(ran.out.contains("actuators ideal, event camera on for seeing float\n"), "{}", ran.out);
    let result = folder.json("r.json");
    assert_eq!(result["settings"]["camera"]["field_of_view_deg"], 90.0);
    let cameras: Vec<&Value> =
        result["drivers"].as_array().unwrap().iter().map(|d| &d["camera"]).collect();
    assert_eq!(cameras, [false, true, false]);
    folder.good("report r.json -o r.html");
    assert!(text(&folder, "r.html").contains(", event camera on for seeing float."));
    let ran = folder.good(&format!("drive straight blind.safetensors {SHORT} --json b.json"));
    assert!(!ran.out.contains("event camera"), "{}", ran.out);
    assert!(folder.json("b.json")["settings"]["camera"].is_null());
}

#[test]
fn the_network_sees_what_the_camera_sees() {
    let folder = folder_with_networks();
    fn awake(name: &str, values: &mut [f32]) {
        let scale = match name {
            _ if name.starts_with("hsvae.encoder.") && name.ends_with(".bias") => 0.0,
            "hsvae.latent.deviation" | "actor.fuse.dvs.weight" => 8.0,
            _ if name.starts_with("actor.decision.") && name.ends_with(".weight") => 4.0,
            _ => 1.0,
        };
        values.iter_mut().for_each(|value| *value *= scale);
        if name.starts_with("hsvae.encoder.") && name.ends_with(".weight") {
            values.iter_mut().for_each(|value| *value = value.abs() + 0.2);
        }
    }
    folder.write("seeing.safetensors", eem_san(true, &|name, _, values| awake(name, values)));
    let dead: Change = &|name, _, values| {
        awake(name, values);
        if name.starts_with("hsvae.encoder.1.") {
            values.fill(0.0);
        }
    };
    folder.write("dead.safetensors", eem_san(true, dead));
    let line = format!("drive seeing.safetensors dead.safetensors {SHORT} --json r.json");
    folder.good(&line.replace("--ticks-max 6", "--ticks-max 40"));
    let result = folder.json("r.json");
    let way = |driver: usize| &result["drivers"][driver]["trials"][0]["trajectory_mm"];
    assert_ne!(way(0), way(1));
}

#[test]
fn drive_of_an_eem_san_is_the_same_on_any_number_of_threads() {
    let folder = folder_with_networks();
    for threads in [1, 2] {
        folder.good(&format!(
            "drive seeing.safetensors {SHORT} --threads {threads} --json {threads}.json"
        ));
    }
    let trials = |name: &str| folder.json(name)["drivers"][0]["trials"].clone();
    assert_eq!(trials("1.json"), trials("2.json"));
}

#[test]
fn networks_that_ship_drive_by_name() {
    let folder = Folder::new();
    let ran = folder.good(&format!("drive eem-san laser-only {SHORT}"));
    assert!(ran.out.contains("event camera on for eem-san float\n"), "{}", ran.out);
    assert!(ran.out.contains("| laser-only float |"), "{}", ran.out);
}

#[test]
fn an_old_result_without_camera_is_still_read() {
    let folder = Folder::new();
    folder.good("drive straight --trials 1 --json r.json");
    let mut result = folder.json("r.json");
    result["settings"].as_object_mut().unwrap().remove("camera");
    result["drivers"][0].as_object_mut().unwrap().remove("camera");
    folder.write("r.json", result.to_string());
    folder.good("report r.json -o r.html");
}

#[test]
fn a_control_rate_without_five_frames_is_refused_for_those_who_need_them() {
    let folder = folder_with_networks();
    let text = "seeing float: control rate 10 Hz gives 10 event frames per control tick, 5 needed \
                (FRAMES_PER_TICK); drive at 20 Hz (--control-hz)";
    refused(&folder, "drive seeing.safetensors --trials 1 --json out.json", &[text]);
    let line = "drive straight seeing.safetensors --control-hz 50 --trials 9999 --json out.json";
    refused(&folder, line, &["control rate 50 Hz gives 2 event frames"]);
    folder.good("drive blind.safetensors --trials 1 --ticks-max 3");
}

/// Every reader of an EEM-SAN must refuse this one.
fn refused_everywhere(change: Change, part: &str) {
    let folder = Folder::new();
    folder.write("n.safetensors", eem_san(true, change));
    for line in [
        "drive n.safetensors --control-hz 20 --json out.json",
        "evaluate n.safetensors --json out.json",
        "thresholds n.safetensors -o out.svg",
        "camera --driver n.safetensors --json out.json",
    ] {
        refused(&folder, line, &["n.safetensors: ", part]);
    }
}

#[test]
fn files_that_are_no_eem_san_are_refused() {
    refused_everywhere(
        &|name, shape, _| {
            if name == "actor.decision.2.bias" {
                shape.clear();
            }
        },
        "layer decision.2: tensor actor.decision.2.bias: nothing (there is: actor.",
    );
    refused_everywhere(
        &|name, shape, _| {
            if name == "actor.fuse.dvs.weight" {
                *shape = vec![4, 15];
            }
        },
        "layer fuse.dvs: tensor actor.fuse.dvs.weight: F32 [4, 15] found, F32 or F16 [4, 12] expected",
    );
    refused_everywhere(
        &|name, _, values| {
            if name == "actor.decision.1.weight" {
                values[3] = f32::NAN;
            }
        },
        "tensor actor.decision.1.weight: element 3 is NaN, must be finite",
    );
    refused_everywhere(
        &|name, _, values| {
            if name == "actor.decision.1.r" {
                values[0] = -0.5;
            }
        },
        "decision.1: threshold tanh(r) = -0.4621",
    );
    refused_everywhere(
        &|name, _, values| {
            if name == "hsvae.threshold" {
                values[0] = 0.0;
            }
        },
        "encoder: threshold = 0, must be above 0; train it to stay there",
    );
    refused_everywhere(
        &|name, _, values| {
            if name == "actor.population.laser.deviation" {
                values[1] = 0.0;
            }
        },
        "population.laser: deviation = 0, must be above 0",
    );
}

#[test]
fn layers_without_neurons_are_refused() {
    fn emptied(
        name: &'static str,
        shape: &'static [usize],
    ) -> impl Fn(&str, &mut Vec<usize>, &mut Vec<f32>) {
        move |found, old, values| {
            if found == name {
                *old = shape.to_vec();
                values.truncate(shape.iter().product());
            }
        }
    }
    let cases: [(&str, &[usize], &str); 4] = [
        ("actor.decision.1.weight", &[0, 5], "decision.1: neurons = 0, must be 1 or more"),
        ("actor.population.laser.mean", &[22, 0], "population.laser: neurons = 0"),
        ("hsvae.encoder.2.weight", &[0, 1, 4, 4], "encoder.2: neurons = 0"),
        ("hsvae.mu.weight", &[0, 4], "mu: neurons = 0"),
    ];
    for (name, shape, part) in cases {
        refused_everywhere(&emptied(name, shape), part);
    }
}

#[test]
fn weights_files_that_cannot_be_read_are_refused() {
    let folder = folder_with_networks();
    folder.write("x.safetensors", b"hello");
    let drive = "drive x.safetensors --json out.json";
    refused(&folder, drive, &["x.safetensors: not a readable safetensors file ("]);
    refused(&folder, "drive no.safetensors --json out.json", &["no.safetensors: cannot read: "]);
    for name in ["eem-san", "seeing.safetensors"] {
        let line = format!("drive {name} --weights w --json out.json");
        refused(&folder, &line, &["w: weights are for networks with a description, and there"]);
        let line = format!("camera --driver {name} --weights w --json out.json");
        refused(&folder, &line, &[&format!("w: {name} comes with its weights; leave --weights")]);
        let is = format!("{name}: is an EEM-SAN, and a network with a description is expected");
        let error = builtin::read(name, None).unwrap_err().to_string();
        assert!(error.contains(&is), "{error}");
    }
    let trained = builtin::trained_names().collect::<Vec<_>>().join(", ");
    let known = format!("(there is: reflex, san, {trained})");
    refused(&folder, "drive nobody --json out.json", &[&known]);
    let line = "drive blind.safetensors --json blind.safetensors";
    refused(&folder, line, &["is an input or another output as well"]);
}

#[test]
fn arena_draws_everything_with_tracks_and_speeds() {
    let folder = Folder::new();
    let ran = folder.good("arena map1 -o a.svg");
    assert!(ran.out.contains("arena map1: 20.0 x 20.0 m, "), "{}", ran.out);
    assert!(ran.out.contains(" obstacles, 11 movers\nwrote a.svg\n"), "{}", ran.out);
    let svg = text(&folder, "a.svg");
    assert_eq!(svg.matches("stroke-dasharray").count(), 11);
    assert_well_formed(&svg);
    refused(&folder, "arena garden -o out.svg", &["built-in arenas are courtyard"]);
    refused(&folder, "arena map1 -o no/out.svg", &["cannot write: "]);
    refused(&folder, "arena map1", &["required arguments were not provided"]);
}

#[test]
fn thresholds_are_a_table_and_bars() {
    let folder = folder_with_networks();
    let ran = folder.good("thresholds seeing.safetensors blind.safetensors reflex -o t.svg");
    for part in [
        "| network            | fuse.laser | fuse.dvs | decision.1 | decision.2 |  pools | wheels |",
        "| seeing.safetensors |     0.5000 |   0.5000 |     0.5000 |     0.5000 |      - |      - |",
        "| blind.safetensors  |     0.5000 |        - |     0.5000 |     0.5000 |      - |      - |",
        "| reflex             |          - |        - |          - |          - | 1.0000 | 1.0000 |",
        "wrote t.svg",
    ] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    let svg = text(&folder, "t.svg");
    assert!(svg.contains(r#"stroke-dasharray="6 4"/><text x="10" y="158.0">0.50<"#), "{svg}");
    assert_eq!(svg.matches("<title>").count(), 9);
    assert_well_formed(&svg);
    folder.good("thresholds eem-san laser-only");
    let weights = "w: weights are for networks with a description, and there is none";
    refused(&folder, "thresholds eem-san --weights w -o out.svg", &[weights]);
    refused(&folder, "thresholds nobody -o out.svg", &["neither a file nor a built-in network"]);
    refused(&folder, "thresholds reflex -o no/out.svg", &["cannot write: "]);
}

#[test]
fn an_encoder_watches_what_the_camera_sees() {
    let folder = Folder::new();
    folder.write("e.safetensors", hsvae(AS_IS));
    let line = "camera --seconds 1 --arena courtyard-moving --encoder e.safetensors";
    let ran = folder.good(&format!("{line} --frames f --json c.json"));
    assert!(ran.out.contains("| encoder layer | neurons | spikes per frame |"), "{}", ran.out);
    assert!(ran.out.contains("| encoder.1     |    4096 |"), "{}", ran.out);
    let layers = folder.json("c.json")["encoder"].clone();
    assert_eq!(layers.as_array().unwrap().len(), 6);
    assert!(layers[0]["spikes"].as_u64().unwrap() > 0, "{layers}");
    let png = std::fs::read(folder.path("f/tick_00000.png")).unwrap();
    let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
    // The view, five frames and the reconstruction, three pixels for one, gaps of two.
    assert_eq!(width, 3 * (7 * 128 + 6 * 2));
    let ran = folder.good("camera --seconds 1 --arena courtyard-moving --frames g --json d.json");
    assert!(folder.json("d.json")["encoder"].is_null());
    assert!(ran.out.contains("wrote 20 pictures to g\n") && !ran.out.contains("more there"));
    // Of pictures that a longer run left there, it is said that they are none of this one's.
    for name in ["tick_00020.png", "tick_00021.png", "tick_21.png", "tick_00022.svg"] {
        folder.write(&format!("g/{name}"), b"old");
    }
    let ran = folder.good("camera --seconds 1 --arena courtyard-moving --frames g");
    assert!(ran.out.contains("2 more there are of an earlier, longer run\n"), "{}", ran.out);
}

#[test]
fn a_driver_that_sees_flies_in_the_camera_verb() {
    let folder = folder_with_networks();
    let line = "camera --seconds 1 --arena courtyard-moving --driver seeing.safetensors";
    assert!(folder.good(line).out.contains("seeing.safetensors drives at up to 1 m/s"));
}

#[test]
fn encoders_that_cannot_watch_are_refused() {
    let folder = Folder::new();
    let camera = "camera --seconds 1 --encoder e.safetensors --json out.json";
    refused(&folder, camera, &["e.safetensors: cannot read: "]);
    folder.write("e.safetensors", b"hello");
    refused(&folder, camera, &["e.safetensors: not a readable safetensors file ("]);
    folder.write("e.safetensors", eem_san(false, AS_IS));
    let nothing = "e.safetensors: layer encoder.1: tensor encoder.1.weight: nothing found";
    refused(&folder, camera, &[nothing]);
    let without = |left_out: &'static str| {
        move |name: &str, shape: &mut Vec<usize>, _: &mut Vec<f32>| {
            if name == left_out {
                shape.clear();
            }
        }
    };
    folder.write("e.safetensors", hsvae(&without("decoder.3.weight")));
    refused(&folder, camera, &["e.safetensors: tensor decoder.3.weight: missing"]);
    folder.write("e.safetensors", hsvae(&without("latent.mean")));
    refused(&folder, camera, &["tensor latent.mean: nothing"]);
}

#[test]
fn the_event_driven_encoder_equals_the_one_that_was_trained() {
    use spikeloop::nn::EncoderKind;
    for (kind, number) in [
        (EncoderKind::Spiking, None),
        (EncoderKind::Artificial, Some(1.0)),
        (EncoderKind::PerTick, Some(2.0)),
    ] {
        event_driven_equals_trained(kind, number);
    }
}

/// `number` is what the file says of the kind.
fn event_driven_equals_trained(kind: spikeloop::nn::EncoderKind, number: Option<f32>) {
    const TICKS: usize = 2;
    let channels = vec![2, 3, 2, 1, 1, 2];
    let shape = HsvaeShape { encoder: kind, channels, encoder_lean: 3.0, ..HsvaeShape::eem_san() };
    let (hsvae, n) = (Hsvae::new(&shape), shape.latent());
    let mut parameters = hsvae.initial(&Streams::new(8, 0));
    parameters.values.iter_mut().for_each(|value| *value = 1.5 * *value + 0.05);
    let mut state = StateWriter::default();
    state.parameters("", &parameters);
    if let Some(number) = number {
        state.floats("kind", &[1], &[number]);
    }
    if number != Some(1.0) {
        state.floats("threshold", &[1], &[shape.threshold]);
    }
    state.floats("latent.mean", &[n], &vec![0.0; n]);
    state.floats("latent.deviation", &[n], &vec![1.0; n]);
    let encoder = EemSan::encoder_from_bytes("test", &state.bytes()).unwrap();
    let mut events = FloatEncoder::new(&encoder);
    let mut draw = Streams::new(9, 0).at(stream::STIMULUS, 0);
    let (mut frames, mut states) = (Vec::new(), Vec::new());
    for _ in 0..TICKS {
        for _ in 0..shape.frames {
            let mut frame = EventFrame::default();
            (0..500).for_each(|_| frame.set(draw.below(128) as usize, draw.below(128) as usize));
            events.step(&frame);
            let mut pixels = vec![0.0; shape.pixels()];
            frame.active().for_each(|pixel| pixels[pixel] = 1.0);
            frames.extend(pixels);
        }
        states.extend(events.state());
    }
    let trace = hsvae.encode::<Rectangular>(&parameters.values, &frames, &mut hsvae.rest(1));
    let spikes = |layer: &LifTrace<Rectangular>| layer.spikes.iter().sum::<f32>() as u64;
    let above = |outputs: &Vec<f32>| outputs.iter().filter(|output| **output > 0.0).count() as u64;
    let trained = trace.layers.iter().map(spikes).chain(trace.outputs.iter().map(above));
    let trained: Vec<u64> = trained.collect();
    assert!(trained.iter().all(|spikes| *spikes > 0), "the test needs spikes: {trained:?}");
    assert_eq!(events.spikes(), trained);
    assert_eq!(states.len(), trace.mean.len());
    for (found, wanted) in states.into_iter().zip(&trace.mean) {
        assert!((found - wanted).abs() < 1e-3, "{kind:?}: {found} {wanted}");
    }
}

#[test]
fn an_encoder_of_no_known_kind_is_refused() {
    let kind = |value: f32| {
        move |name: &str, shape: &mut Vec<usize>, values: &mut Vec<f32>| {
            if name == "hsvae.kind" {
                (*shape, *values) = (vec![1], vec![value]);
            }
        }
    };
    let limit = "must be 1 (AVAE) or 2 (FSVAE), or no such tensor (HSVAE); train or export again";
    refused_everywhere(&kind(3.0), &format!("encoder: kind = 3, {limit}"));
    refused_everywhere(&kind(0.0), &format!("encoder: kind = 0, {limit}"));
    refused_everywhere(&kind(f32::NAN), "tensor hsvae.kind: element 0 is NaN, must be finite");
    let two: Change = &|name, shape, values| {
        if name == "hsvae.kind" {
            (*shape, *values) = (vec![2], vec![1.0, 2.0]);
        }
    };
    refused_everywhere(two, "tensor hsvae.kind: F32 [2] found, F32 or F16 [1] expected");
    // Spiking neurons have a threshold, artificial ones need none.
    let without_threshold = |value: f32| {
        move |name: &str, shape: &mut Vec<usize>, values: &mut Vec<f32>| {
            kind(value)(name, shape, values);
            if name == "hsvae.threshold" {
                shape.clear();
            }
        }
    };
    refused_everywhere(&without_threshold(2.0), "tensor hsvae.threshold: nothing");
    let folder = Folder::new();
    folder.write("avae.safetensors", eem_san(true, &without_threshold(1.0)));
    folder.good(&format!("drive avae.safetensors {SHORT}"));
}

#[test]
fn networks_with_the_other_encoders_fly_and_what_does_not_take_them_says_so() {
    let folder = Folder::new();
    for (name, kind) in [("avae", 1.0), ("fsvae", 2.0)] {
        let change = move |tensor: &str, shape: &mut Vec<usize>, values: &mut Vec<f32>| {
            if tensor.ends_with("kind") {
                (*shape, *values) = (vec![1], vec![kind]);
            }
        };
        let file = format!("{name}.safetensors");
        folder.write(&file, eem_san(true, &change));
        folder.good(&format!("drive {file} {SHORT}"));
        folder.good(&format!("thresholds {file}"));
        let table5 = format!("table5 {file} --json out.json");
        refused(&folder, &table5, &["not an EEM-SAN with HSVAE's encoder of event frames"]);
        folder.write("e.safetensors", hsvae(&change));
        let camera = "camera --seconds 1 --arena courtyard-moving --encoder e.safetensors";
        folder.good(&format!("{camera} --frames f_{name}"));
        let train = "train actor --quick --threads 1 --encoder e.safetensors --out out";
        let title = name.to_uppercase();
        let late = format!("readout_delay_frames: the encoder is {title}, HSVAE expected: ");
        refused(&folder, &format!("{train} --recipe streaming"), &[&late]);
        let learned = format!("end_to_end: the encoder is {title}, HSVAE expected: only neurons");
        refused(&folder, &format!("{train} --recipe e2e"), &[&learned]);
    }
    let compile = "compile avae.safetensors -o out.map";
    let error = "avae: layer encoder.1: 4096 artificial neurons (ReLU, AVAE), and loihi1 has \
                 compartments that spike";
    refused(&folder, compile, &[error]);
    let compile = "compile fsvae.safetensors --schedule streaming -o out.map";
    let error =
        "fsvae, schedule streaming: the encoder is at rest at the start of each control tick";
    refused(&folder, compile, &[error, "compile it with --schedule held"]);
    let ran = folder.good("compile fsvae.safetensors -o fsvae.map");
    assert!(ran.out.contains("chip steps per 5 event frames, then cleared"), "{}", ran.out);
    folder.good(&format!("drive fsvae.map {SHORT}"));
}
