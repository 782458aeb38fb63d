//! Things that several tests need.

use std::path::PathBuf;

use serde_json::Value;

/// A file of other people's data, or `None` (said on standard output) where it is not there.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if !file.exists() {
        println!("skipped: needs ../shared/data/{path}");
        return None;
    }
    Some(file)
}

/// A JSON file.
pub(crate) fn json(path: &std::path::Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("readable")).expect("JSON")
}
