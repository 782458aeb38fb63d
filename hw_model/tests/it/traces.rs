//! Every file of `traces/chip` through every engine. `UPDATE_GOLDEN=1` rewrites expectations.

use std::path::{Path, PathBuf};

use hw_model::Trace;
use hw_model::container::write_atomically;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../traces/chip");

fn trace_files() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(FOLDER).expect("traces/chip is there");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.sort();
    files
}

fn check(path: &Path, update: bool) -> Result<(), String> {
    let name = path.file_name().expect("a file").to_string_lossy();
    let place = format!("traces/chip/{name}");
    let text = std::fs::read_to_string(path).map_err(|e| format!("{place}: {e}"))?;
    let trace = Trace::parse(&place, &text).map_err(|e| e.to_string())?;
    if update {
        let updated = trace.updated_text().map_err(|e| e.to_string())?;
        if updated != text {
            write_atomically(path, updated.as_bytes()).map_err(|e| e.to_string())?;
        }
        return Ok(());
    }
    match trace.check_all() {
        Ok(engines) => {
            assert_eq!(engines, 4, "{place}");
            Ok(())
        }
        Err(mismatch) => Err(mismatch.to_string()),
    }
}

#[test]
fn every_trace_comes_out_of_every_engine() {
    let update = std::env::var_os("UPDATE_GOLDEN").is_some();
    let files = trace_files();
    assert!(files.len() >= 12, "{} traces in {FOLDER}", files.len());
    let failures: Vec<String> = files.iter().filter_map(|path| check(path, update).err()).collect();
    assert!(failures.is_empty(), "\n{}", failures.join("\n\n"));
}

#[test]
fn every_trace_holds_only_its_map_in_the_written_form() {
    for path in trace_files() {
        let text = std::fs::read_to_string(&path).expect("readable");
        let trace = Trace::parse("x", &text).expect("parses");
        let written = trace.map().to_text();
        let missing: Vec<&str> = written.lines().filter(|l| !text.contains(l)).collect();
        assert!(missing.is_empty(), "{}: {missing:?}", path.display());
    }
}
