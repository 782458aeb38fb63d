//! `spikeloop train`: what it leaves, going on after a kill, bad input.

use std::process::Stdio;
use std::time::Duration;

use crate::bad_input::refused;
use crate::cli::Folder;
use crate::fixtures::hsvae;

const ACTOR: &str = "train actor --quick --recipe third --threads 1";

#[test]
fn auto_encoder_then_actor_leave_a_network_that_drives() {
    let folder = Folder::new();
    let ran = folder.good("train hsvae --quick --out h");
    for part in ["round 2: reconstruction", "targets: reconstruction", "wrote h/hsvae.safetensors"]
    {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    let ran = folder.good(&format!("{ACTOR} --encoder h/hsvae.safetensors --out a"));
    assert!(ran.out.contains("wrote a/eem_san.safetensors"), "{}", ran.out);
    for file in ["h/curves.svg", "a/curves.svg", "a/checkpoint.safetensors"] {
        assert!(folder.path(file).exists(), "{file}");
    }
    let drive = "drive a/eem_san.safetensors --control-hz 20 --arena courtyard --trials 1";
    folder.good(&format!("{drive} --ticks-max 3"));
    folder.good("train actor --quick --recipe second --from a/eem_san.safetensors --out b");
}

#[test]
fn the_other_auto_encoders_train_resume_and_lead_to_a_network_that_drives() {
    let folder = Folder::new();
    for kind in ["avae", "fsvae"] {
        let train = format!("train hsvae --kind {kind} --quick");
        let ran = folder.good(&format!("{train} --out whole_{kind} --threads 2"));
        let wrote = format!("wrote whole_{kind}/{kind}.safetensors");
        assert!(ran.out.contains(&wrote), "{}", ran.out);
        folder.good(&format!("{train} --out steps_{kind} --threads 1 --rounds 1"));
        let ran = folder.good(&format!("{train} --out steps_{kind} --threads 1"));
        assert!(ran.out.contains("resumed after round 1 of 2"), "{}", ran.out);
        for file in [format!("{kind}.safetensors"), "checkpoint.safetensors".to_owned()] {
            let of = |run: &str| folder.read(&format!("{run}_{kind}/{file}"));
            assert_eq!(of("whole"), of("steps"), "{file}");
        }
        let encoder = format!("--encoder whole_{kind}/{kind}.safetensors");
        let train = format!("{ACTOR} --variant naive {encoder} --out a_{kind}");
        let ran = folder.good(&train);
        assert!(ran.out.contains(&format!("wrote a_{kind}/naive.safetensors")), "{}", ran.out);
        let drive = format!("drive a_{kind}/naive.safetensors --control-hz 20 --arena courtyard");
        folder.good(&format!("{drive} --trials 1 --ticks-max 3"));
    }
    let line = "train hsvae --kind fsvae --quick --out whole_avae";
    refused(&folder, line, &["was made with another configuration or encoder"]);
}

#[test]
fn a_robot_whose_wheels_lag_trains_another_actor() {
    let folder = Folder::new();
    let config = include_str!("../../src/train/configs/third.toml");
    let lagging = config.replacen("actuators = \"ideal\"", "actuators = \"lag\"", 1);
    assert_ne!(lagging, config);
    folder.write("lag.toml", lagging.as_bytes());
    folder.good(&format!("{ACTOR} --out ideal"));
    folder.good(&format!("{ACTOR} --actuators lag --out lag"));
    folder.good("train actor --quick --config lag.toml --threads 1 --out same");
    let [ideal, lag, same] =
        ["ideal", "lag", "same"].map(|out| folder.read(&format!("{out}/laser_only.safetensors")));
    assert!(lag == same && lag != ideal);
    // In all, not in each run.
    folder.good(&format!("{ACTOR} --actuators lag --until 1 --out until"));
    for _ in 0..2 {
        let ran = folder.good(&format!("{ACTOR} --actuators lag --until 2 --out until"));
        assert!(ran.out.contains("resumed after round "), "{}", ran.out);
        assert!(folder.read("until/laser_only.safetensors") == lag);
    }
    let both = format!("{ACTOR} --until 2 --rounds 1 --out until");
    refused(&folder, &both, &["--until", "--rounds"]);
    let part = "was made with another configuration or encoder";
    refused(&folder, &format!("{ACTOR} --actuators lag-0.4 --out lag"), &[part]);
    refused(&folder, &format!("{ACTOR} --actuators slow --out new"), &["slow"]);
}

#[test]
fn encoder_that_learns_with_the_actor_is_saved_with_it() {
    let folder = Folder::new();
    folder.good("train hsvae --quick --rounds 1 --out h");
    let [train, train2] = [1, 2].map(|n| format!("train actor --quick --recipe e2e --threads {n}"));
    let ran = folder.good(&format!("{train} --encoder h/hsvae.safetensors --out whole"));
    for part in [", on the newest ", ", encoder's spikes ", "wrote whole/eem_san.safetensors"] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    folder.good(&format!("{train} --encoder h/hsvae.safetensors --rounds 1 --out steps"));
    folder.good(&format!("{train2} --encoder h/hsvae.safetensors --out steps"));
    for file in ["eem_san.safetensors", "checkpoint.safetensors"] {
        let of = |run: &str| folder.read(&format!("{run}/{file}"));
        assert_eq!(of("whole"), of("steps"), "{file}");
    }
    // Encoder and actor of one file can be trained on.
    let both = "--encoder whole/eem_san.safetensors --from whole/eem_san.safetensors";
    folder.good(&format!("{train} {both} --rounds 1 --out more"));
    let drive = "drive more/eem_san.safetensors --control-hz 20 --arena courtyard --trials 1";
    folder.good(&format!("{drive} --ticks-max 3"));
    refused(&folder, &format!("{train} --out none"), &["no encoder found", "give --encoder"]);
}

#[test]
fn killed_at_any_moment_it_goes_on_to_the_same_bytes() {
    let folder = Folder::new();
    let whole = folder.good(&format!("{ACTOR} --out whole"));
    assert!(whole.out.contains("round 2:"), "{}", whole.out);
    for pause_ms in [30, 60, 120, 180, 260, 350] {
        let mut child = folder
            .command()
            .args(format!("{ACTOR} --out killed").split(' '))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(pause_ms));
        // It may have ended by itself: that is fine as well.
        let _ = child.kill();
        child.wait().unwrap();
    }
    folder.good(&format!("{ACTOR} --out killed"));
    folder.good(&format!("{ACTOR} --rounds 1 --out steps"));
    let resumed = folder.good(&format!("{ACTOR} --out steps"));
    assert!(resumed.out.contains("resumed after round 1 of 2"), "{}", resumed.out);
    let of = |run: &str, file: &str| folder.read(&format!("{run}/{file}"));
    for file in ["laser_only.safetensors", "checkpoint.safetensors"] {
        assert_eq!(of("whole", file), of("killed", file), "{file} of the killed run");
        assert_eq!(of("whole", file), of("steps", file), "{file} of the run in two steps");
    }
}

#[test]
fn best_actor_is_kept_and_is_the_same_in_two_steps() {
    let folder = Folder::new();
    let third = include_str!("../../src/train/configs/third.toml");
    let selection = "[selection]\nevery = 1\nn_rooms = 1\nflights_per_room = 1\n\n[flight]";
    let config =
        third.replacen("[flight]", selection, 1).replace("ticks_max = 500", "ticks_max = 40");
    folder.write("s.toml", format!("average = 0.01\n{config}").as_bytes());
    let train = "train actor --quick --threads 1 --config s.toml";
    let whole = folder.good(&format!("{train} --out whole"));
    let first = "of the selection's flights at the goal: the best so far, kept as best.safetensors";
    assert!(whole.out.contains(first), "{}", whole.out);
    folder.good(&format!("{train} --rounds 1 --out steps"));
    let after_one = folder.read("steps/laser_only.safetensors");
    // No actor of so short a training gets anywhere: the first one stays the best.
    assert_eq!(folder.read("steps/best.safetensors"), after_one);
    folder.good(&format!("{train} --out steps"));
    for file in ["best.safetensors", "laser_only.safetensors", "curves.svg"] {
        let of = |run: &str| folder.read(&format!("{run}/{file}"));
        assert_eq!(of("whole"), of("steps"), "{file}");
    }
    assert_eq!(folder.read("whole/best.safetensors"), after_one);
    assert_ne!(folder.read("whole/laser_only.safetensors"), after_one);
}

#[test]
fn networks_to_compare_are_trained_by_name_and_drive() {
    let folder = Folder::new();
    let train = "train actor --quick --recipe compare --threads 1";
    for (variant, form) in [
        ("bdett", "rate code, naive fusion, dynamic thresholds"),
        ("popsan", "population code, naive fusion, fixed thresholds"),
    ] {
        let ran = folder.good(&format!("{train} --variant {variant} --out {variant}"));
        let file = format!("{variant}/{variant}.safetensors");
        for part in [format!("network {variant}: {form}"), format!("wrote {file}")] {
            assert!(ran.out.contains(&part), "no {part:?} in {}", ran.out);
        }
        let drive = format!("drive {file} --control-hz 20 --arena courtyard --trials 1");
        folder.good(&format!("{drive} --ticks-max 3"));
    }
    let error = "bdett/bdett.safetensors: holds an actor with rate code, naive fusion, dynamic \
                 thresholds, one with population code, middle fusion, learned thresholds is trained";
    refused(&folder, &format!("{train} --from bdett/bdett.safetensors --out x"), &[error]);
    let line = format!("{train} --variant popsan --from popsan/popsan.safetensors --out y");
    folder.good(&line);
}

#[test]
fn bad_input_of_training_is_refused() {
    let folder = Folder::new();
    folder.write("hsvae.safetensors", hsvae(&|_, _, _| ()));
    folder.write("noise.safetensors", b"not tensors");
    folder.write("small.safetensors", hsvae(&|_, _, _| ()));
    folder.write("bad.toml", b"seed = 1\ncolour = \"blue\"\n");
    let avae = include_str!("../../src/train/configs/avae.toml");
    let priced = avae.replace("rate_weight = 0.0", "rate_weight = 0.1");
    folder.write("priced.toml", priced);
    folder.write("kind.toml", avae.replace("\"avae\"", "\"vae\""));
    for (line, part) in [
        ("train hsvae --config gone.toml", "gone.toml: cannot read"),
        ("train hsvae --config bad.toml", "bad.toml: TOML parse error at line 2"),
        ("train hsvae --kind vae", "invalid value 'vae' for '--kind <KIND>'"),
        ("train hsvae --kind avae --config priced.toml", "priced.toml: --kind chooses a built-in"),
        (
            "train hsvae --config priced.toml",
            "priced.toml: rate_weight is 0.1, must be 0 with kind = \"avae\"",
        ),
        ("train hsvae --config kind.toml", "unknown variant `vae`, expected one of `hsvae`,"),
        ("train actor --encoder gone.safetensors", "gone.safetensors: cannot read"),
        ("train actor --encoder noise.safetensors", "not a readable safetensors file"),
        ("train actor --from noise.safetensors", "noise.safetensors: not readable as safetensors"),
        ("train actor --variant ann", "invalid value 'ann' for '--variant <NAME>'"),
        ("train actor --variant naive", "network.variant naive takes events, and there is no"),
        (
            "train actor --variant san --encoder hsvae.safetensors",
            "network.variant san takes no events; leave --encoder out",
        ),
        ("train actor --from small.safetensors", "actor.population.laser.mean: missing"),
    ] {
        refused(&folder, &format!("{line} --quick --out out"), &[part]);
        assert!(!folder.path("out/checkpoint.safetensors").exists(), "{line}");
    }
}

#[test]
fn checkpoint_of_another_configuration_or_damaged_is_refused_and_kept() {
    let folder = Folder::new();
    folder.good(&format!("{ACTOR} --rounds 1 --out a"));
    let path = folder.path("a/checkpoint.safetensors");
    let before = std::fs::read(&path).unwrap();
    refused(&folder, "train actor --quick --recipe first --out a", &["another configuration"]);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    let mut damaged = before.clone();
    damaged.truncate(before.len() / 2);
    std::fs::write(&path, &damaged).unwrap();
    refused(&folder, &format!("{ACTOR} --out a"), &["not readable as safetensors"]);
    assert_eq!(std::fs::read(&path).unwrap(), damaged);
    std::fs::write(folder.path("file"), b"x").unwrap();
    refused(&folder, &format!("{ACTOR} --out file"), &["cannot make the folder"]);
}

#[test]
fn one_training_at_a_time_writes_into_a_folder() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("a")).unwrap();
    let other = spikeloop::files::OwnFolder::take(&folder.path("a")).unwrap();
    let text = "a: another run writes there; wait for its end, or give another folder";
    refused(&folder, "train hsvae --quick --rounds 1 --out a", &[text]);
    assert!(!folder.path("a/checkpoint.safetensors").exists());
    drop(other);
    folder.good("train hsvae --quick --rounds 1 --out a");
}

#[test]
fn training_never_writes_over_what_it_reads() {
    let folder = Folder::new();
    folder.good("train actor --quick --rounds 1 --out t");
    let before = folder.read("t/laser_only.safetensors");
    let line = "train actor --quick --rounds 1 --out t --from t/laser_only.safetensors";
    refused(&folder, line, &["laser_only.safetensors: is an input or another output as well"]);
    assert_eq!(folder.read("t/laser_only.safetensors"), before);
    folder.write("c.toml", include_bytes!("../../src/train/configs/first.toml"));
    let line = "train actor --quick --recipe compare --config c.toml --out t";
    refused(&folder, line, &["c.toml: --recipe chooses a built-in configuration"]);
}

#[test]
fn training_that_diverges_says_so_and_leaves_no_files() {
    let folder = Folder::new();
    let config = include_str!("../../src/train/configs/hsvae.toml");
    let config = config.replace("learning_rate = 2e-3", "learning_rate = 1.0");
    folder.write("c.toml", config);
    folder.good("train hsvae --quick --rounds 1 --out t");
    std::fs::remove_file(folder.path("t/checkpoint.safetensors")).unwrap();
    let before = folder.read("t/hsvae.safetensors");
    let line = "train hsvae --config c.toml --quick --rounds 2 --out t";
    refused(&folder, line, &["t: the training has diverged: tensor ", "smaller learning rates"]);
    assert_eq!(folder.read("t/hsvae.safetensors"), before);
}

#[test]
fn an_actor_that_the_simulator_tells_of_movers_flies_and_does_not_compile() {
    let folder = Folder::new();
    let recipe = include_str!("../../src/train/configs/told_actor.toml");
    folder.write("t.toml", recipe);
    let train = "train actor --quick --config t.toml --threads 1";
    folder.good(&format!("{train} --out a"));
    folder.good(&format!("{train} --rounds 1 --out b"));
    folder.good(&format!("{train} --out b"));
    assert!(folder.read("a/eem_san.safetensors") == folder.read("b/eem_san.safetensors"));
    let told = "a/eem_san.safetensors";
    let short = "--arena train4 --control-hz 20 --trials 2 --ticks-max 20";
    folder.good(&format!("drive {told} {short} --json r.json"));
    // Movers make a difference to it, and nothing else changes without them in the first tick.
    folder.good(&format!("drive {told} {short} --static --json s.json"));
    let way = |file: &str| folder.json(file)["drivers"][0]["trials"][0]["trajectory_mm"].clone();
    assert_ne!(way("r.json"), way("s.json"));
    folder.good(&format!("halve {told} -o half.safetensors"));
    folder.good(&format!("drive half.safetensors {short}"));
    folder.good(&format!(
        "train actor --quick --from {told} --threads 1 --rounds 1 --config t.toml --out c"
    ));
    folder.good("train hsvae --quick --rounds 1 --out h");
    for (line, part) in [
        (format!("compile {told} -o out.map"), "the simulator tells it where movers are"),
        (format!("study {told} --axis bits --trials 1"), "the simulator tells it where movers are"),
        (format!("table5 {told} --json out.json"), "not an EEM-SAN with HSVAE's encoder"),
        (format!("camera --driver {told} --events out.npz"), "give another driver"),
        (format!("{train} --encoder h/hsvae.safetensors --out out"), "leave --encoder out"),
        (format!("train actor --quick --encoder {told} --out out"), "encoder.1"),
    ] {
        refused(&folder, &line, &[part]);
    }
}
