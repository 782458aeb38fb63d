//! Every form of the command line, through the built binary.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};

use hw_model::{ChipSpec, CoreMap, CoreMapParts};
use serde_json::Value;
use spikeloop::npz::Npz;

use crate::bad_input::refused;
use crate::fixtures::{json, shared};

/// A folder of its own for a test, removed at its end.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new() -> Self {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path =
            std::env::temp_dir().join(format!("spikeloop-it-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).expect("a temporary file");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("the file is there")
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        json(&self.path(name))
    }

    /// Names of everything in the folder.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).expect("the folder is there");
        let name = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.expect("readable").file_name().to_string_lossy().into_owned()
        };
        let mut names: Vec<String> = entries.map(name).collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_spikeloop"));
        command.current_dir(&self.0).env("NO_COLOR", "1");
        command
    }

    /// Runs the binary in the folder; the words of `line` are split at blanks.
    pub(crate) fn run(&self, line: &str) -> Ran {
        Ran::new(line, self.command().args(line.split_whitespace()).output().expect("it starts"))
    }

    /// The same, and it must end with exit code 0.
    pub(crate) fn good(&self, line: &str) -> Ran {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(0), "spikeloop {line}: {}{}", ran.out, ran.err);
        assert_eq!(ran.err, "", "spikeloop {line}");
        ran
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that stays behind in the temporary one is no failure.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// How a run ended.
pub(crate) struct Ran {
    pub(crate) line: String,
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Ran {
    fn new(line: &str, output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        let (out, err) = (text(output.stdout), text(output.stderr));
        Self { line: line.to_owned(), code: output.status.code(), out, err }
    }

    /// Seed and core maps of the first line.
    fn header(&self) -> (String, String) {
        let first = self.out.lines().next().unwrap_or_default();
        let parts: Vec<&str> = first.split(" | ").collect();
        let [seed, revision, maps] = parts[..] else {
            panic!("spikeloop {}: first line {first:?}", self.line)
        };
        assert!(revision.strip_prefix("revision ").is_some_and(|r| !r.is_empty()), "{first}");
        let part = |text: &str, name: &str| text.strip_prefix(name).expect(name).to_owned();
        (part(seed, "seed "), part(maps, "core map "))
    }
}

/// A map of the built-in network in a folder.
pub(crate) fn reflex_map(folder: &Folder) -> Ran {
    folder.good("compile reflex -o reflex.map")
}

fn digest_of(folder: &Folder, map: &str) -> String {
    let about: Value =
        serde_json::from_str(&folder.good(&format!("inspect {map} --json")).out).unwrap();
    about["map_digest"].as_str().expect("a digest").to_owned()
}

fn shared_text(path: &str) -> Option<String> {
    shared(path).map(|path| path.display().to_string())
}

#[test]
fn compile_of_the_built_in_network_writes_a_map_and_names_its_digest() {
    let folder = Folder::new();
    let ran = reflex_map(&folder);
    let digest = digest_of(&folder, "reflex.map");
    assert_eq!(ran.header(), ("none".to_owned(), format!("reflex {digest}")));
    assert!(ran.out.contains("| 0    | pools  |"), "{}", ran.out);
    assert!(ran.out.ends_with("wrote reflex.map\n"), "{}", ran.out);
    assert_eq!(folder.names(), ["reflex.map"]);
}

#[test]
fn compile_writes_equal_files_each_time_and_other_ones_for_another_policy() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.good("compile reflex -o again.map");
    folder.good("compile reflex --policy mixed -o mixed.map");
    assert!(folder.read("reflex.map") == folder.read("again.map"));
    assert!(folder.read("reflex.map") != folder.read("mixed.map"));
}

#[test]
fn compile_rounds_weights_to_fewer_bits() {
    let folder = Folder::new();
    folder.good("compile reflex --weight-bits 4 -o four.map");
    for bits in [1, 9] {
        let part = format!("{bits} is not in 2..=8");
        refused(&folder, &format!("compile reflex --weight-bits {bits} -o b.map"), &[&part]);
    }
    folder.good("compile reflex --weight-bits 8 -o eight.map");
    folder.good("compile reflex -o reflex.map");
    let inspected = |map: &str| -> Value {
        serde_json::from_str(&folder.good(&format!("inspect {map} --json")).out).unwrap()
    };
    assert_eq!(inspected("four.map")["policy"], "nearest-4");
    assert!(folder.read("eight.map") == folder.read("reflex.map"));
}

#[test]
fn inspect_lists_the_ports_and_when_biases_must_spike() {
    let folder = Folder::new();
    let ports = "ports: in (24 lines), bias (2 lines: line by line on for 16 steps of a decision, \
                 from step 0, 1 on)";
    assert!(reflex_map(&folder).out.contains(ports));
    assert!(folder.good("inspect reflex.map").out.contains(ports));
}

#[test]
fn drivers_of_one_name_are_told_apart_by_what_was_typed() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.good("compile reflex --neurons-per-core 1 -o wide.map");
    folder.good("drive reflex.map wide.map reflex --trials 1 --json r.json");
    let drivers = folder.json("r.json")["drivers"].clone();
    let label = |index: usize| drivers[index]["label"].as_str().unwrap().to_owned();
    assert_eq!(label(0), "reflex chip (nearest), reflex.map");
    assert_eq!(label(1), "reflex chip (nearest), wide.map");
    assert_eq!(label(2), "reflex float");
}

#[test]
fn compile_of_san_with_its_weights_reports_the_published_scale() {
    let Some(weights) = shared_text("san/san_sddpg_bw5.safetensors") else { return };
    let folder = Folder::new();
    let ran = folder.good(&format!("compile san --weights {weights} --policy san -o san.map"));
    assert!(ran.out.contains("layer fc1: 466.178 mantissas per unit"), "{}", ran.out);
}

#[test]
fn a_built_in_network_is_found_beside_a_folder_of_its_name() {
    let Some(weights) = shared_text("san/san_sddpg_bw5.safetensors") else { return };
    let folder = Folder::new();
    std::fs::create_dir(folder.path("san")).unwrap();
    folder.good(&format!("compile san --weights {weights} -o san.map"));
}

#[test]
fn compile_takes_a_chip_file_and_spreads_the_network_over_its_smaller_cores() {
    let folder = Folder::new();
    let chip = include_str!("../../hw_model/chips/loihi1.toml");
    let small = chip
        .replace("name = \"loihi1\"", "name = \"small\"")
        .replace("compartments_per_core = 1024", "compartments_per_core = 2");
    folder.write("small.toml", small);
    let ran = folder.good("compile reflex --chip small.toml -o small.map");
    assert!(ran.out.contains("cores 4/128"), "{}", ran.out);
    let about: Value = serde_json::from_str(&folder.good("inspect small.map --json").out).unwrap();
    assert_eq!(about["chip"], "small");
    // Results say which chip it was.
    folder.good("compile reflex -o big.map");
    let ran = folder.good("drive small.map big.map --trials 1 --ticks-max 5 --json r.json");
    assert!(ran.out.contains("| reflex chip (nearest, small) |"), "{}", ran.out);
    assert!(ran.out.contains("| reflex chip (nearest)        |"), "{}", ran.out);
    let drivers = &folder.json("r.json")["drivers"];
    assert_eq!((&drivers[0]["chip"], &drivers[1]["chip"]), (&"small".into(), &"loihi1".into()));
}

#[test]
fn cores_that_are_asked_for_make_decisions_faster_and_change_no_flight() {
    let folder = Folder::new();
    let cores_and_time = |line: &str| {
        folder.good(&format!("compile laser-only {line} -o c.map"));
        let about: Value = serde_json::from_str(&folder.good("inspect c.map --json").out).unwrap();
        folder.good(
            "drive c.map --arena map1 --control-hz 20 --v-max 1 --trials 1 --ticks-max 20 --json r.json",
        );
        let results = folder.json("r.json");
        let driver = results["drivers"][0].clone();
        let time = driver["summary"]["chip"]["costs"]["davies2018"]["time_ps"].as_u64();
        let flown = driver["trials"][0]["trajectory_mm"].clone();
        (about["cores"]["used"].as_u64().unwrap(), time.unwrap(), flown)
    };
    let fewest = cores_and_time("");
    let more = cores_and_time("--cores 40");
    let same_by_neurons = cores_and_time("--neurons-per-core 20");
    let numbers = [&fewest, &more, &same_by_neurons].map(|(cores, time, _)| (*cores, *time));
    assert!(fewest.0 < 10 && (35..=40).contains(&more.0), "{numbers:?}");
    assert!(same_by_neurons.0 >= more.0, "{numbers:?}");
    assert!(more.1 < fewest.1 && more.1 < same_by_neurons.1, "{numbers:?}");
    assert!(more.2.is_array() && more.2 == fewest.2 && more.2 == same_by_neurons.2);
    // Twice the same.
    folder.good("compile laser-only --cores 40 -o a.map");
    folder.good("compile laser-only --cores 40 -o b.map");
    assert_eq!(folder.read("a.map"), folder.read("b.map"));
}

#[test]
fn an_encoder_takes_the_cores_that_are_asked_for() {
    let folder = Folder::new();
    let cores = |line: &str| {
        let ran = folder.good(line);
        let at = ran.out.find("cores ").expect("a line of cores") + 6;
        ran.out[at..].split('/').next().unwrap().parse::<usize>().unwrap()
    };
    let wide = include_str!("../../hw_model/chips/loihi1.toml")
        .replace("name = \"loihi1\"", "name = \"wide\"")
        .replace("cores = 128", "cores = 256")
        .replace("tiles_x = 8", "tiles_x = 16");
    folder.write("wide.toml", wide);
    let fewest = cores("compile eem-san --chip wide.toml -o e.map");
    let more = cores("compile eem-san --chip wide.toml --cores 200 -o e.map");
    assert!(fewest < 128 && (180..=200).contains(&more), "{fewest}, {more}");
}

#[cfg(unix)]
#[test]
fn a_replaced_file_keeps_its_permissions_and_a_protected_one_is_not_replaced() {
    use std::fs::{Permissions, metadata, set_permissions};
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let path = folder.path("r.map");
    folder.good("compile reflex -o r.map");
    set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
    folder.good("compile reflex --policy mixed -o r.map");
    assert_eq!(metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    let there = folder.read("r.map");
    set_permissions(&path, Permissions::from_mode(0o400)).unwrap();
    let ran = folder.run("compile reflex -o r.map");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("r.map: cannot write: it is write-protected"), "{}", ran.err);
    assert_eq!(folder.read("r.map"), there);
}

#[test]
fn a_link_as_output_stays_a_link() {
    let folder = Folder::new();
    folder.write("real.map", "old");
    #[cfg(unix)]
    for (file, link) in [("real.map", "link.map"), ("none.map", "gone.map")] {
        std::os::unix::fs::symlink(folder.path(file), folder.path(link)).unwrap();
    }
    if folder.path("link.map").is_symlink() {
        folder.good("compile reflex -o link.map");
        let ran = folder.run("compile reflex -o gone.map");
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        assert!(ran.err.contains("gone.map: cannot write: it is a link that leads"), "{}", ran.err);
        assert!(folder.path("gone.map").is_symlink() && !folder.path("none.map").exists());
        assert!(folder.path("link.map").is_symlink());
        folder.good("inspect real.map");
    }
}

#[test]
fn inspect_shows_used_and_limit_of_every_core() {
    let folder = Folder::new();
    reflex_map(&folder);
    let ran = folder.good("inspect reflex.map");
    assert_eq!(ran.header().1, format!("reflex {}", digest_of(&folder, "reflex.map")));
    let row = "| 0    | pools  |       6/1024 |  21/4096 |    6/4096 |      22/16384 |     2/7 |       34 |";
    assert!(ran.out.contains(row), "{}", ran.out);
}

#[test]
fn inspect_draws_the_chip_with_every_core() {
    let folder = Folder::new();
    reflex_map(&folder);
    let ran = folder.good("inspect reflex.map --picture chip.svg");
    assert!(ran.out.ends_with("wrote chip.svg\n"), "{}", ran.out);
    let svg = String::from_utf8(folder.read("chip.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.contains("reflex on loihi1: 2 of 128 cores"), "{svg}");
    assert_eq!(svg.matches("<title>").count(), 2 * 128);
}

#[test]
fn compile_tells_of_cores_that_are_left_where_there_are_many() {
    let folder = Folder::new();
    let hint = "as few cores as can be; --cores N, up to 128, shares the layers out over more";
    for (line, expected) in [
        ("compile laser-only -o m.map", true),
        ("compile laser-only --neurons-per-core 64 -o m.map", false),
        ("compile laser-only --cores 9 -o m.map", false),
        ("compile eem-san -o m.map", false),
    ] {
        let out = folder.good(line).out;
        assert_eq!(out.contains(hint), expected, "{line}: {out}");
    }
    let fewer = "124 of the 128 cores asked for are taken: no split over more was found that makes";
    let out = folder.good("compile laser-only --cores 128 -o m.map").out;
    assert!(out.contains(fewer), "{out}");
}

#[test]
fn inspect_says_when_the_biases_of_an_eem_san_must_spike() {
    let folder = Folder::new();
    for (options, ports) in [
        (
            "laser-only",
            "bias (5 lines: each on for 5 steps of a decision: 0 from step 0, 1 from step 1, 2 from step 2, \
             3 from step 3, 4 from step 4)",
        ),
        (
            "eem-san",
            "bias (10 lines: each on for 5 steps of the encoder's: 0 from step 0, 1 from step 1, 2 from \
             step 2, 3 from step 3; or on for 5 steps of a decision: 4 from step 0, 5 from step 0, ",
        ),
        (
            "eem-san --schedule streaming",
            "bias (10 lines: each on to the end of an episode: 0 from step 0, 1 from step 1, 2 from step 2, \
             3 from step 3, 4 from step 5, 5 from step 5, 6 from step 6, ",
        ),
    ] {
        folder.good(&format!("compile {options} -o e.map"));
        let inspected = folder.good("inspect e.map").out;
        assert!(inspected.contains(ports), "{inspected}");
    }
}

#[test]
fn inspect_colours_the_chip_by_what_run_and_drive_counted() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0, 9], &[6, 7]));
    folder.good("run reflex.map --spikes in.npz --json run.json");
    folder.good("drive reflex.map straight --trials 1 --ticks-max 3 --json drive.json");
    for (file, unit) in [("run.json", "chip step"), ("drive.json", "decision")] {
        folder.good(&format!("inspect reflex.map --picture {file}.svg --activity {file}"));
        let svg = String::from_utf8(folder.read(&format!("{file}.svg"))).unwrap();
        assert!(
            svg.contains(&format!("synaptic operations per {unit}, white 0 to dark ")),
            "{svg}"
        );
        assert_eq!(svg.matches("<title>").count(), 3 * 128);
    }
    let (by_core, of_chip) = (
        &folder.json("drive.json")["drivers"][0]["counters_by_core"],
        &folder.json("drive.json")["drivers"][0]["summary"]["chip"]["counters"],
    );
    let spikes = |core: &Value| core["updates_spiking"].as_u64().unwrap_or(0);
    let sum: u64 = by_core.as_array().unwrap().iter().map(spikes).sum();
    assert_eq!(of_chip["updates_spiking"], sum);
}

#[test]
fn what_steps_wait_for_adds_up_to_the_time_of_the_chip() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0, 9], &[6, 7]));
    folder.good("run reflex.map --spikes in.npz --json run.json");
    let drive = "drive reflex.map straight --trials 2 --ticks-max 30 --json drive.json";
    let drove = folder.good(drive).out;
    let driver = &folder.json("drive.json")["drivers"][0];
    let n = driver["summary"]["decisions"].as_f64().unwrap();
    let number = |value: &Value| value.as_u64().unwrap_or(0);
    for table in ["davies2018", "sanafe"] {
        let cost = &driver["summary"]["chip"]["costs"][table];
        let cores_ps = number(&cost["time_ps"]) - number(&cost["barrier_ps"]);
        let layers = driver["slowest_layers_ps"][table].as_object().unwrap();
        assert_eq!(layers.values().map(number).sum::<u64>(), cores_ps);
        let by_core = driver["counters_by_core"].as_array().unwrap();
        let of_core = |core: &Value| number(&core[format!("slowest_ps.{table}")]);
        assert_eq!(by_core.iter().map(of_core).sum::<u64>(), cores_ps);
        let barriers = number(&cost["barrier_ps"]) as f64 / n / 1e6;
        assert!(drove.contains(&format!("barriers {barriers:.1} us (")), "{drove}");
        for (layer, ps) in layers {
            let said = format!(" {layer} {:.1} us (", number(ps) as f64 / n / 1e6);
            assert!(drove.contains(&said), "{drove} does not say{said}");
        }
    }
    for (file, unit) in [("run.json", "chip step"), ("drive.json", "decision")] {
        let inspected = folder.good(&format!("inspect reflex.map --activity {file}")).out;
        let title =
            format!("| syn. ops per {unit} | slowest (us, davies2018) | slowest (us, sanafe) |");
        assert!(inspected.contains(&title), "{inspected}");
    }
}

#[test]
fn a_convolutional_network_goes_through_files_and_gives_the_golden_spikes() {
    let Some(net) = shared("nets/conv.json") else { return };
    let folder = Folder::new();
    folder.good(&format!("compile {} -o conv.map", net.display()));
    let spikes = net.with_extension("npz").display().to_string();
    let ran = folder.good(&format!("run conv.map --spikes {spikes} --steps 100 --threads 2"));
    let golden = json(&net.with_file_name("golden_conv.json"));
    for (name, digest) in golden["sha256_of_t_then_i_as_le_int32"].as_object().unwrap() {
        let row = ran.out.lines().find(|line| line.starts_with(&format!("| {name} ")));
        let row = row.expect("every layer has a row");
        assert!(row.contains(digest.as_str().unwrap()), "{row}");
    }
    let about = folder.good("inspect conv.map").out;
    let layer = "| c2    |   32768 |    64-95 |         1935360 |        275520 |    87360 |";
    assert!(about.contains(layer), "{about}");
    let about: Value = serde_json::from_str(&folder.good("inspect conv.map --json").out).unwrap();
    assert_eq!(about["populations"][0]["cores"], 64);
    let dump = folder.good("inspect conv.map --dump").out;
    assert!(dump.contains("\npopulation c1 core=001 cx=0000..0113/16\n"));
    let parts = CoreMapParts::from_text("dump", &dump, ChipSpec::loihi1()).unwrap();
    assert_eq!(CoreMap::new(parts).unwrap().digest(), digest_of(&folder, "conv.map"));
}

#[test]
fn inspect_json_holds_the_program_and_the_use_of_every_core() {
    let folder = Folder::new();
    reflex_map(&folder);
    let about: Value = serde_json::from_str(&folder.good("inspect reflex.map --json").out).unwrap();
    assert_eq!(about["network"], "reflex");
    assert_eq!(about["cores"]["used"], 2);
    assert_eq!(about["program"]["steps"], 16);
    assert_eq!(about["utilization"][1]["compartments"]["used"], 2);
    assert_eq!(about["ports"][0]["lines"], 24);
}

#[test]
fn inspect_dump_reads_back_to_an_equal_map() {
    let folder = Folder::new();
    reflex_map(&folder);
    let dump = folder.good("inspect reflex.map --dump").out;
    assert!(dump.starts_with("; seed none | revision "), "{}", &dump[..80]);
    let parts = CoreMapParts::from_text("dump", &dump, ChipSpec::loihi1()).unwrap();
    assert_eq!(CoreMap::new(parts).unwrap().digest(), digest_of(&folder, "reflex.map"));
}

/// The golden spikes through one form of `run`.
fn check_mlp_run(folder: &Folder, map: &str, options: &str) -> Value {
    let json_path = shared("nets/mlp.json").expect("checked by the caller");
    let spikes = json_path.with_extension("npz").display().to_string();
    let line = format!("run {map} --spikes {spikes} --steps 5000 -o o.npz --json o.json {options}");
    let ran = folder.good(&line);
    assert!(ran.header().1.starts_with("mlp "), "{}", ran.out);
    let golden = json(&json_path.with_file_name("golden_mlp.json"));
    let got = folder.json("o.json");
    for (name, spikes) in golden["spike_counts"].as_object().unwrap() {
        assert_eq!(got["populations"][name]["spikes"], *spikes, "{options}: {name}");
        let digest = &golden["sha256_of_t_then_i_as_le_int32"][name];
        assert_eq!(got["populations"][name]["sha256"], *digest, "{options}: {name}");
    }
    let counters = got["counters"].as_object().unwrap();
    let synaptic = |(name, n): (&String, &Value)| {
        if name.starts_with("synaptic_ops") { n.as_u64().unwrap() } else { 0 }
    };
    assert_eq!(counters.iter().map(synaptic).sum::<u64>(), 107_030_374, "{options}");
    // 256 neurons at 100 a core: each input goes to three cores.
    let injections = 3 * golden["input_spikes"].as_u64().unwrap();
    assert_eq!(counters["host_injections"], injections, "{options}");
    got
}

#[test]
fn run_gives_the_golden_spikes_by_every_engine_and_thread_count() {
    let Some(net) = shared("nets/mlp.json") else { return };
    let folder = Folder::new();
    let compile = format!("compile {} --neurons-per-core 100 -o mlp.map", net.display());
    folder.good(&compile);
    let event = check_mlp_run(&folder, "mlp.map", "");
    let file = folder.read("o.npz");
    for options in ["--threads 2", "--engine dense"] {
        let other = check_mlp_run(&folder, "mlp.map", options);
        assert_eq!(other["counters"], event["counters"], "{options}");
        assert_eq!(other["counters_by_core"], event["counters_by_core"], "{options}");
        assert!(folder.read("o.npz") == file, "{options}");
    }
    let mut got = Npz::open(&folder.path("o.npz")).unwrap();
    let mut golden = Npz::open(&net.with_file_name("golden_mlp.npz")).unwrap();
    for array in ["l1_t", "l1_i", "l3_t", "l3_i", "out_t", "out_i"] {
        assert!(got.ints(array).unwrap() == golden.ints(array).unwrap(), "{array}");
    }
}

/// Input spikes for the ports of the built-in network.
pub(crate) fn reflex_spikes(steps: &[i32], lines: &[i32]) -> Vec<u8> {
    let array = |name: &str, values: &[i32]| (name.to_owned(), values.to_vec());
    let arrays =
        [array("in_t", steps), array("in_i", lines), array("bias_t", &[]), array("bias_i", &[])];
    spikeloop::npz::to_bytes(&arrays).unwrap()
}

#[test]
fn a_spike_that_is_given_twice_is_one_and_said_to_be() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[3, 0, 3, 3], &[6, 6, 6, 6]));
    let ran = folder.good("run reflex.map --spikes in.npz");
    assert!(ran.out.contains("2 input spikes, 0 of them after the last step"), "{}", ran.out);
    assert!(ran.out.contains("2 more are there already"), "{}", ran.out);
}

#[test]
fn run_without_steps_goes_on_until_the_last_input_is_through() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.write("in.npz", reflex_spikes(&[0, 9], &[6, 7]));
    folder.good("run reflex.map --spikes in.npz --json a.json");
    // Last input step 9, so 10 steps, and one for each of two populations.
    assert_eq!(folder.json("a.json")["steps"], 12);
    let ran = folder.good("run reflex.map --spikes in.npz --steps 5 --json b.json");
    assert_eq!(folder.json("b.json")["counters"]["host_injections"], 1);
    assert!(ran.out.contains("2 input spikes, 1 of them after the last step"), "{}", ran.out);
}

/// A result without what differs from run to run.
fn timeless(folder: &Folder, name: &str) -> Value {
    let mut result = folder.json(name);
    for driver in result["drivers"].as_array_mut().expect("drivers") {
        driver["decisions_per_s"] = Value::Null;
    }
    result
}

#[test]
fn drive_sums_up_its_trials() {
    let folder = Folder::new();
    reflex_map(&folder);
    let ran = folder.good("drive reflex reflex.map straight --trials 3 --seed 7 --json r.json");
    let (seed, maps) = ran.header();
    assert_eq!(seed, "7");
    assert_eq!(maps, format!("reflex chip (nearest) {}", digest_of(&folder, "reflex.map")));
    let result = folder.json("r.json");
    let drivers = result["drivers"].as_array().unwrap();
    assert_eq!(drivers.len(), 3);
    for driver in drivers {
        let (summary, trials) = (&driver["summary"], driver["trials"].as_array().unwrap());
        let number = |value: &Value| value.as_u64().unwrap();
        let ended = ["success", "collision", "time_out"].map(|key| number(&summary[key]));
        assert_eq!((trials.len(), ended.iter().sum::<u64>()), (3, 3), "{}", driver["label"]);
        let decisions: u64 = trials.iter().map(|trial| number(&trial["decisions"])).sum();
        assert_eq!(number(&summary["decisions"]), decisions);
    }
    let chip = &drivers[1]["summary"]["chip"];
    assert!(chip["costs"]["davies2018"]["dynamic_fj"].as_u64().unwrap() > 0);
    let by_trial = |trial: &Value| trial["chip"]["counters"]["updates_active"].as_u64().unwrap();
    let trials = drivers[1]["trials"].as_array().unwrap();
    assert_eq!(chip["counters"]["updates_active"], trials.iter().map(by_trial).sum::<u64>());
    assert!(drivers[0]["summary"]["chip"].is_null());
}

#[test]
fn drive_is_the_same_on_any_number_of_threads() {
    let folder = Folder::new();
    reflex_map(&folder);
    let line = "drive reflex.map --arena courtyard-moving --trials 3 --actuators lag";
    folder.good(&format!("{line} --threads 1 --json one.json"));
    folder.good(&format!("{line} --threads 2 --json two.json"));
    assert_eq!(timeless(&folder, "one.json"), timeless(&folder, "two.json"));
}

#[test]
fn drive_is_the_same_on_both_engines() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.good("drive reflex.map --trials 2 --json event.json");
    folder.good("drive reflex.map --trials 2 --engine dense --json dense.json");
    let (event, mut dense) = (timeless(&folder, "event.json"), timeless(&folder, "dense.json"));
    assert_eq!(dense["drivers"][0]["label"], "reflex chip (nearest, dense)");
    dense["drivers"][0]["label"] = event["drivers"][0]["label"].clone();
    assert_eq!(event, dense);
}

#[test]
fn drive_repeats_with_consecutive_seeds() {
    let folder = Folder::new();
    folder.good("drive straight --trials 1 --seed 4 --repeats 2 --json r.json");
    let result = folder.json("r.json");
    let seeds: Vec<_> = result["drivers"].as_array().unwrap().iter().map(|d| &d["seed"]).collect();
    assert_eq!(seeds, [4, 5]);
}

#[test]
fn drive_takes_the_first_pairs_of_a_file() {
    let (Some(world), Some(pairs)) =
        (shared_text("san/san_evaluation_world.json"), shared_text("san/san_eval_positions.json"))
    else {
        return;
    };
    let folder = Folder::new();
    folder
        .good(&format!("drive straight --arena {world} --pairs {pairs} --trials 2 --json r.json"));
    assert_eq!(folder.json("r.json")["pairs_mm"].as_array().unwrap().len(), 2);
}

/// Panics unless `text` is one element with properly nested elements and quoted attributes.
pub(crate) fn assert_well_formed(text: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut roots = 0;
    for part in text.trim().split('<').skip(1) {
        let (tag, after) = part.split_once('>').expect("every tag ends");
        assert!(tag.matches('"').count() % 2 == 0, "quotes of <{tag}>");
        for entity in after.split('&').skip(1).chain(tag.split('&').skip(1)) {
            assert!(entity.split_once(';').is_some_and(|(name, _)| name.len() < 6), "&{entity}");
        }
        let name = tag.trim_start_matches('/').split([' ', '/']).next().expect("a name");
        roots += usize::from(open.is_empty());
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}>");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        assert!(!open.is_empty() || after.is_empty(), "text {after:?} outside of the root");
    }
    assert_eq!((roots, open.len()), (1, 0), "one root, all closed");
}

#[test]
fn drive_plots_well_formed_svg() {
    let folder = Folder::new();
    folder.good("drive straight reflex --trials 2 --arena courtyard-moving --plot p.svg");
    let svg = String::from_utf8(folder.read("p.svg")).unwrap();
    assert!(svg.starts_with("<svg xmlns="), "{}", &svg[..40]);
    assert_eq!(svg.matches("<polyline").count(), 4);
    assert_well_formed(&svg);
}

#[test]
fn names_with_markup_stay_text_in_the_plot() {
    let folder = Folder::new();
    let arena = r#"{"name": "a<b>&\"", "arena": {"xmin": 0, "xmax": 20, "ymin": 0, "ymax": 20},
        "walls": [{"name": "<w>", "shape": "cylinder", "x": 10, "y": 10, "radius": 3, "height": 1}]}"#;
    folder.write("a.json", arena);
    folder.write("p.json", r#"{"starts": [[2, 10, 0]], "goals": [[18, 10]]}"#);
    folder.good("drive straight --arena a.json --pairs p.json --json r.json --plot p.svg");
    let svg = String::from_utf8(folder.read("p.svg")).unwrap();
    assert!(svg.contains("collision with &lt;w&gt;"), "{svg}");
    assert_well_formed(&svg);
    // An arena has no control characters in its names, but a file of results may.
    let results = String::from_utf8(folder.read("r.json")).unwrap();
    folder.write("r.json", results.replace("a<b>", "a<b\\u0007>"));
    folder.good("report r.json -o r.html");
    let page = String::from_utf8(folder.read("r.html")).unwrap();
    assert!(page.contains("a&lt;b\u{fffd}&gt;") && !page.contains("a<b"), "{page}");
}

#[test]
fn report_puts_every_result_on_one_page() {
    let folder = Folder::new();
    reflex_map(&folder);
    folder.good("drive reflex.map --trials 1 --json a.json");
    folder.good("drive straight --trials 1 --json b.json");
    let ran = folder.good("report a.json b.json -o page.html");
    let digest = digest_of(&folder, "reflex.map");
    assert_eq!(ran.header().1, format!("reflex chip (nearest) {digest}"));
    let page = String::from_utf8(folder.read("page.html")).unwrap();
    for part in ["<h3>a.json</h3>", "<h3>b.json</h3>", "straight to goal", digest.as_str()] {
        assert!(page.contains(part), "{part}");
    }
    // Trajectories of each, and energy and time of the chip.
    assert_eq!(page.matches("<svg ").count(), 4);
}

fn trace_copy(folder: &Folder) -> String {
    let trace = include_str!("../../traces/chip/lif.trace").to_owned();
    folder.write("lif.trace", &trace);
    trace
}

#[test]
fn trace_check_tells_the_first_difference_and_record_mends_it() {
    let folder = Folder::new();
    let good = trace_copy(&folder);
    assert!(folder.good("trace check lif.trace").out.contains("same by "), "the copy is good");
    let changed =
        good.replace("t=0003 core=000 cx=0000 u=-0000112", "t=0003 core=000 cx=0000 u=-0000113");
    assert_ne!(changed, good);
    folder.write("lif.trace", &changed);
    let ran = folder.run("trace check .");
    assert_eq!((ran.code, ran.err.as_str()), (Some(1), ""));
    let line = good.lines().position(|line| line.starts_with("t=0003")).unwrap() + 1;
    assert!(ran.out.contains(&format!("lif.trace:{line}: ")), "{}", ran.out);
    assert!(ran.out.contains("u=-0000113 v=-0000532 s=0 r=00   (expected)"), "{}", ran.out);
    assert!(ran.out.contains("u=-0000112 v=-0000532 s=0 r=00   (got)"), "{}", ran.out);
    assert!(folder.good("trace record lif.trace").out.contains("changed   lif.trace"));
    assert!(folder.good("trace record lif.trace").out.contains("unchanged lif.trace"));
    assert_eq!(folder.read("lif.trace"), good.into_bytes());
    folder.good("trace check lif.trace");
}

#[test]
fn trace_check_of_a_network_trace_goes_through_every_engine() {
    let folder = Folder::new();
    folder.write("r.trace", include_str!("../../traces/net/reflex_mixed.trace"));
    let ran = folder.good("trace check r.trace");
    assert_eq!(ran.header(), ("none".to_owned(), "none".to_owned()));
    assert!(ran.out.contains("engines  r.trace"), "{}", ran.out);
}

#[test]
fn completions_name_every_verb_in_each_shell() {
    let folder = Folder::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = folder.good(&format!("completions {shell}")).out;
        for verb in ["compile", "inspect", "run", "drive", "evaluate", "report", "trace"] {
            assert!(script.contains(verb), "{shell}: {verb}");
        }
    }
}

#[test]
fn demo_compiles_drives_and_reports() {
    let folder = Folder::new();
    let ran = folder.good("demo --network reflex --trials 2 --seed 3 -o out");
    assert_eq!(ran.header().0, "3");
    for file in ["out/reflex.map", "out/reflex.json", "out/reflex.html"] {
        assert!(ran.out.contains(&format!("wrote {file}")), "{}", ran.out);
        assert!(folder.path(file).is_file(), "{file}");
    }
    assert_eq!(folder.json("out/reflex.json")["drivers"].as_array().unwrap().len(), 3);
    assert!(ran.header().1.ends_with(&digest_of(&folder, "out/reflex.map")));
}

#[test]
fn help_and_version_are_no_errors() {
    let folder = Folder::new();
    assert!(folder.good("--version").out.starts_with("spikeloop "));
    for verb in [
        "compile",
        "inspect",
        "run",
        "drive",
        "evaluate",
        "arena",
        "thresholds",
        "camera",
        "demo",
        "report",
        "trace",
        "train",
        "completions",
    ] {
        assert!(folder.good(&format!("{verb} --help")).out.contains("Usage: spikeloop"), "{verb}");
    }
}

#[test]
fn output_without_a_terminal_has_no_escape_codes() {
    let folder = Folder::new();
    let mut command = folder.command();
    command.env_remove("NO_COLOR").args(["drive", "straight", "--trials", "1"]);
    let output = command.output().unwrap();
    assert!(!output.stdout.contains(&0x1b) && !output.stderr.contains(&0x1b));
}

#[cfg(unix)]
mod pipes {
    use std::io::Read;
    use std::process::Stdio;

    use super::*;

    #[test]
    fn a_reader_that_leaves_early_ends_no_run() {
        let folder = Folder::new();
        reflex_map(&folder);
        for line in [
            "inspect reflex.map --dump",
            "completions zsh",
            "drive straight --trials 2 --json r.json",
            "nonsense",
        ] {
            let mut command = folder.command();
            command.args(line.split_whitespace()).stdout(Stdio::piped()).stderr(Stdio::piped());
            let mut child = command.spawn().unwrap();
            drop(child.stdout.take());
            let mut err = String::new();
            child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
            let expected = if line == "nonsense" { 2 } else { 0 };
            assert_eq!(child.wait().unwrap().code(), Some(expected), "{line}: {err}");
            assert!(!err.contains("panicked"), "{line}: {err}");
        }
        assert_eq!(folder.json("r.json")["drivers"].as_array().unwrap().len(), 1);
    }

    #[test]
    fn a_closed_standard_error_is_no_panic() {
        let folder = Folder::new();
        let mut command = folder.command();
        command.args(["inspect", "nothing.map"]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(2));
    }

    #[test]
    fn a_full_disk_behind_standard_output_is_an_error() {
        let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else { return };
        let folder = Folder::new();
        let mut command = folder.command();
        command.args(["completions", "bash"]).stdout(full);
        let output = command.output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(err.starts_with("error: standard output: cannot write: "), "{err}");
    }

    #[test]
    fn a_device_as_output_is_written_to_and_not_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let folder = Folder::new();
        let null = Path::new("/dev/null");
        folder.good("compile reflex -o /dev/null");
        assert!(std::fs::metadata(null).unwrap().file_type().is_char_device());
    }

    #[test]
    fn an_interrupted_run_leaves_no_file() {
        let folder = Folder::new();
        let mut command = folder.command();
        command.args("drive reflex --trials 10000 --json r.json --plot p.svg".split(' '));
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        // The first line is out when the trials begin.
        let mut first = [0; 5];
        child.stdout.as_mut().unwrap().read_exact(&mut first).unwrap();
        child.kill().unwrap();
        assert_eq!(child.wait().unwrap().code(), None);
        assert!(folder.names().is_empty(), "{:?}", folder.names());
    }
}
