//! All traces of the repository. `UPDATE_GOLDEN=1` writes their expectations anew.

use std::path::PathBuf;

use spikeloop::golden;

#[test]
fn every_trace_comes_out_as_recorded_by_every_engine() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("traces");
    for file in golden::find(&folder).unwrap() {
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            golden::record(&file).unwrap();
        }
        if let Err(error) = golden::check(&file) {
            panic!("{error}");
        }
    }
}
