//! Rules of the repository that can be read off its files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` whose name ends in `.extension`.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                open.push(entry);
            } else if entry.extension().is_some_and(|e| e == extension) {
                found.push(entry);
            }
        }
    }
    assert!(!found.is_empty(), "no .{extension} files in {folder}");
    found.sort();
    found
}

fn sources() -> Vec<(String, String)> {
    let folders = ["src", "hw_model/src", "hw_model/tests", "tests", "benches"];
    let all = folders.iter().flat_map(|folder| files(folder, "rs"));
    let name = |path: &Path| path.strip_prefix(root()).unwrap().display().to_string();
    all.map(|path| (name(&path), std::fs::read_to_string(&path).unwrap())).collect()
}

/// Rooms of the main crate and the rooms that each may use.
const ROOMS: [(&str, &[&str]); 21] = [
    ("elementary", &[]),
    ("files", &[]),
    ("floats", &[]),
    ("rng", &[]),
    ("npz", &["files"]),
    ("nn", &["elementary", "floats", "rng"]),
    ("policy", &["rng"]),
    ("world", &["files", "npz", "policy", "rng"]),
    ("closed_loop", &["policy", "rng", "world"]),
    ("net", &["files", "floats", "npz", "policy", "rng"]),
    ("coding", &["net", "policy", "rng"]),
    ("compile", &["files", "net", "policy"]),
    ("cost", &["net"]),
    ("reference", &["coding", "compile", "cost", "elementary", "net", "policy", "rng"]),
    ("host", &["coding", "compile", "cost", "net", "policy", "rng"]),
    ("train", &["closed_loop", "coding", "net", "nn", "policy", "reference", "rng", "world"]),
    ("evaluate", &["closed_loop", "coding", "host", "net", "policy", "reference", "rng", "world"]),
    ("study", &["compile", "evaluate", "host", "net"]),
    ("report", &["closed_loop", "cost", "evaluate", "host", "policy", "study", "world"]),
    (
        "golden",
        &[
            "closed_loop",
            "coding",
            "compile",
            "files",
            "host",
            "net",
            "policy",
            "reference",
            "rng",
            "world",
        ],
    ),
    ("cli", &[]),
];

#[test]
fn rooms_use_only_what_they_may() {
    let declared = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for line in declared.lines().filter_map(|line| line.strip_prefix("pub mod ")) {
        let room = line.trim_end_matches(';');
        assert!(ROOMS.iter().any(|(name, _)| *name == room), "{room} is not in the table of rooms");
    }
    for (file, text) in sources() {
        let Some(inside) = file.strip_prefix("src/") else { continue };
        let room = inside.split(['/', '.']).next().unwrap().trim_end_matches("_tests");
        let Some((_, allowed)) = ROOMS.iter().find(|(name, _)| *name == room && *name != "cli")
        else {
            continue;
        };
        if file.ends_with("_tests.rs") {
            continue;
        }
        for used in text.split("crate::").skip(1) {
            let used: String =
                used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let fine = used == room || allowed.contains(&used.as_str());
            assert!(fine, "{file}: {room} must not use {used}");
        }
    }
}

#[test]
fn the_chip_knows_no_network() {
    let manifest = std::fs::read_to_string(root().join("hw_model/Cargo.toml")).unwrap();
    for dependency in ["spikeloop", "nalgebra", "parry2d", "rand", "clap"] {
        let named = manifest.lines().any(|line| line.starts_with(dependency));
        assert!(!named, "hw_model must not depend on {dependency}");
    }
}

#[test]
fn banned_words_do_not_occur() {
    // Split, so that this file does not contain them.
    let everywhere = [
        ["mul_", "add("].concat(),
        ["Std", "Rng"].concat(),
        ["Small", "Rng"].concat(),
        ["thread_", "rng"].concat(),
        ["#[ig", "nore"].concat(),
        ["should_", "panic"].concat(),
        ["to", "do!("].concat(),
    ];
    let clock = ["Inst", "ant::now"].concat();
    for (file, text) in sources() {
        for word in &everywhere {
            assert!(!text.contains(word.as_str()), "{file} contains {word}");
        }
        let may_read_the_clock = file.starts_with("src/cli/") || file.starts_with("benches/");
        assert!(may_read_the_clock || !text.contains(&clock), "{file} reads the clock");
    }
}

#[test]
fn every_source_file_is_a_module_of_another() {
    let all = sources();
    for (file, _) in &all {
        let path = Path::new(file);
        let stem = path.file_stem().unwrap().to_str().unwrap();
        if ["main", "lib", "build", "spikeloop"].contains(&stem) {
            continue;
        }
        let named = |text: &str| {
            text.contains(&format!("mod {stem};")) || text.contains(&format!("\"{stem}.rs\""))
        };
        assert!(all.iter().any(|(_, text)| named(text)), "{file} belongs to no module");
    }
}

fn documents() -> Vec<PathBuf> {
    let named = [
        "README.md",
        "src/ARCHITECTURE.md",
        "src/GLOSSARY.md",
        "hw_model/README.md",
        "traces/README.md",
    ];
    named.iter().map(|name| root().join(name)).collect()
}

#[test]
fn relative_links_in_documents_lead_somewhere() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.starts_with("http") || target.starts_with('#') || target.contains("::") {
                continue;
            }
            let file = document.parent().unwrap().join(target.split('#').next().unwrap());
            assert!(file.exists(), "{}: {target} is not there", document.display());
        }
    }
}

#[test]
fn nothing_names_a_place_on_one_machine() {
    let places = [["/wo", "rk/"].concat(), ["/ro", "ot/"].concat(), ["/ho", "me/"].concat()];
    let texts = documents()
        .into_iter()
        .chain(files("traces", "trace"))
        .chain(files("hw_model/chips", "toml"));
    let texts =
        texts.map(|path| (path.display().to_string(), std::fs::read_to_string(&path).unwrap()));
    for (file, text) in texts.chain(sources()) {
        for place in &places {
            assert!(!text.contains(place.as_str()), "{file} contains {place}");
        }
    }
}

#[test]
fn every_name_in_the_glossary_is_in_the_source() {
    let glossary = std::fs::read_to_string(root().join("src/GLOSSARY.md")).unwrap();
    let sources: String = sources().into_iter().map(|(_, text)| text).collect();
    let mut checked = BTreeSet::new();
    for row in glossary.lines().filter(|line| line.starts_with('|')) {
        let Some(cell) = row.split('|').nth(2) else { continue };
        for name in cell.split('`').skip(1).step_by(2) {
            for part in name.split("::") {
                assert!(
                    sources.contains(part),
                    "GLOSSARY.md: {part} (of {name}) is not in the source"
                );
            }
            checked.insert(name.to_owned());
        }
    }
    assert!(checked.len() > 20, "only {} names found in the glossary", checked.len());
}
