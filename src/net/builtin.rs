//! Networks that can be named instead of given as a file.

mod reflex;

use std::path::Path;

use crate::files;
use crate::net::controller::Controller;
use crate::net::description;
use crate::net::eem_san::EemSan;
use crate::net::error::NetError;
use crate::net::network::Network;

const SAN: &str = include_str!("builtin/san.toml");

/// Names of the built-in descriptions.
pub const NAMES: [&str; 2] = ["reflex", "san"];

/// Names of the networks that come trained, and their weights in the form of
/// [`EemSan::from_bytes`]. Those called `lag/...` learned on for robots whose wheels lag
/// (`benches/lag.sh`). Those called `compare/ROW` are rows of the paper's tables that had the same
/// steps of training, `benches/compare.sh ROW`; `-2` and `-3` are other seeds of it.
const TRAINED: &[(&str, &[u8])] = &[
    ("eem-san", include_bytes!("weights/eem_san.safetensors")),
    ("laser-only", include_bytes!("weights/laser_only.safetensors")),
    ("lag/eem-san", include_bytes!("weights/lag/eem_san.safetensors")),
    ("lag/laser-only", include_bytes!("weights/lag/laser_only.safetensors")),
    ("compare/san", include_bytes!("weights/compare/san.safetensors")),
    ("compare/san-2", include_bytes!("weights/compare/san-2.safetensors")),
    ("compare/san-3", include_bytes!("weights/compare/san-3.safetensors")),
    ("compare/popsan", include_bytes!("weights/compare/popsan.safetensors")),
    ("compare/popsan-2", include_bytes!("weights/compare/popsan-2.safetensors")),
    ("compare/popsan-3", include_bytes!("weights/compare/popsan-3.safetensors")),
    ("compare/bdett", include_bytes!("weights/compare/bdett.safetensors")),
    ("compare/bdett-2", include_bytes!("weights/compare/bdett-2.safetensors")),
    ("compare/bdett-3", include_bytes!("weights/compare/bdett-3.safetensors")),
    ("compare/e2e", include_bytes!("weights/compare/e2e.safetensors")),
    ("compare/e2e-2", include_bytes!("weights/compare/e2e-2.safetensors")),
    ("compare/e2e-3", include_bytes!("weights/compare/e2e-3.safetensors")),
    ("compare/avae", include_bytes!("weights/compare/avae.safetensors")),
    ("compare/avae-2", include_bytes!("weights/compare/avae-2.safetensors")),
    ("compare/avae-3", include_bytes!("weights/compare/avae-3.safetensors")),
    ("compare/fsvae", include_bytes!("weights/compare/fsvae.safetensors")),
    ("compare/fsvae-2", include_bytes!("weights/compare/fsvae-2.safetensors")),
    ("compare/fsvae-3", include_bytes!("weights/compare/fsvae-3.safetensors")),
    ("compare/naive", include_bytes!("weights/compare/naive.safetensors")),
    ("compare/naive-2", include_bytes!("weights/compare/naive-2.safetensors")),
    ("compare/naive-3", include_bytes!("weights/compare/naive-3.safetensors")),
    ("compare/eem-san", include_bytes!("weights/compare/eem_san.safetensors")),
    ("compare/eem-san-2", include_bytes!("weights/compare/eem_san-2.safetensors")),
    ("compare/eem-san-3", include_bytes!("weights/compare/eem_san-3.safetensors")),
    ("compare/fixed-0.3", include_bytes!("weights/compare/fixed-0.3.safetensors")),
    ("compare/fixed-0.3-2", include_bytes!("weights/compare/fixed-0.3-2.safetensors")),
    ("compare/fixed-0.3-3", include_bytes!("weights/compare/fixed-0.3-3.safetensors")),
    ("compare/learned-0.3", include_bytes!("weights/compare/learned-0.3.safetensors")),
    ("compare/learned-0.3-2", include_bytes!("weights/compare/learned-0.3-2.safetensors")),
    ("compare/learned-0.3-3", include_bytes!("weights/compare/learned-0.3-3.safetensors")),
    ("compare/fixed-0.5", include_bytes!("weights/compare/fixed-0.5.safetensors")),
    ("compare/fixed-0.5-2", include_bytes!("weights/compare/fixed-0.5-2.safetensors")),
    ("compare/fixed-0.5-3", include_bytes!("weights/compare/fixed-0.5-3.safetensors")),
    ("compare/fixed-0.7", include_bytes!("weights/compare/fixed-0.7.safetensors")),
    ("compare/fixed-0.7-2", include_bytes!("weights/compare/fixed-0.7-2.safetensors")),
    ("compare/fixed-0.7-3", include_bytes!("weights/compare/fixed-0.7-3.safetensors")),
    ("compare/learned-0.7", include_bytes!("weights/compare/learned-0.7.safetensors")),
    ("compare/learned-0.7-2", include_bytes!("weights/compare/learned-0.7-2.safetensors")),
    ("compare/learned-0.7-3", include_bytes!("weights/compare/learned-0.7-3.safetensors")),
    ("compare/fixed-0.9", include_bytes!("weights/compare/fixed-0.9.safetensors")),
    ("compare/learned-0.9", include_bytes!("weights/compare/learned-0.9.safetensors")),
    ("compare/laser-only", include_bytes!("weights/compare/laser_only.safetensors")),
    ("compare/laser-only-2", include_bytes!("weights/compare/laser_only-2.safetensors")),
    ("compare/laser-only-3", include_bytes!("weights/compare/laser_only-3.safetensors")),
];

/// Names that are suggested for one that does not exist, at most.
const SUGGESTIONS: usize = 3;

/// From this likeness on, of 0 to 1, one name may be meant by another.
const LIKE: f64 = 0.6;

/// How the file name of an EEM-SAN ends.
const WEIGHTS_EXTENSION: &str = "safetensors";

/// Whether `name` is a built-in network of either kind.
pub fn is_name(name: &str) -> bool {
    NAMES.contains(&name) || trained(name).is_some()
}

/// Whether `name` is a network that weights can be given for: one with a description.
pub fn takes_weights(name: &str) -> bool {
    !is_eem_san(name) && name != "reflex"
}

/// Reads a network of either kind by its built-in name, from a description file, or from an
/// EEM-SAN's weights (`.safetensors`).
///
/// Errors: as [`read`] and [`EemSan::from_bytes`]; weights for a network that has its own.
pub fn open(name: &str, weights: Option<&Path>) -> Result<Controller, NetError> {
    if let (true, Some(weights)) = (is_eem_san(name), weights) {
        let weights = weights.display().to_string();
        return Err(NetError::Weights { name: name.to_owned(), weights });
    }
    if let Some(bytes) = trained(name) {
        let network = EemSan::from_bytes(name, name, bytes)?;
        return Ok(Controller::EemSan(Box::new(network)));
    }
    if is_eem_san(name) {
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
        let network = EemSan::from_bytes(&stem, name, &files::read_bytes(Path::new(name))?)?;
        return Ok(Controller::EemSan(Box::new(network)));
    }
    match read(name, weights) {
        Err(NetError::Unknown { name, .. }) => {
            let known = suggestions(&name, NAMES.into_iter().chain(trained_names()));
            Err(NetError::Unknown { name, known })
        }
        read => read.map(Controller::Described),
    }
}

/// Reads a network with a description by its built-in name or from a description file. A file that
/// is called like a built-in network needs its folder: `./san`.
///
/// Errors: as [`description::read`]; an unknown name; a built-in network without its weights; an
/// EEM-SAN; an integer network.
pub fn read(name: &str, weights: Option<&Path>) -> Result<Network, NetError> {
    let path = Path::new(name);
    match (name, weights) {
        ("reflex", None) => Ok(reflex::network()),
        ("reflex", Some(weights)) => Err(NetError::Syntax {
            file: weights.display().to_string(),
            message: "the built-in network reflex is wired by hand and takes no weights; leave --weights out".to_owned(),
        }),
        ("san", Some(weights)) => {
            let bytes = files::read_bytes(weights)?;
            description::from_memory("san", SAN, &weights.display().to_string(), &bytes)
        }
        ("san", None) => Err(NetError::NoWeights { file: "san".to_owned() }),
        _ if is_eem_san(name) => Err(NetError::EemSan { name: name.to_owned() }),
        _ if path.extension().is_some_and(|extension| extension == "json") => {
            Err(NetError::Integers { file: name.to_owned() })
        }
        _ if path.exists() || path.extension().is_some() => description::read(path, weights),
        _ => Err(NetError::Unknown { name: name.to_owned(), known: suggestions(name, NAMES) }),
    }
}

/// The few names that are much like `name`, best first; where none is, all of them.
fn suggestions(name: &str, known: impl IntoIterator<Item = &'static str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let mut near: Vec<(f64, &str)> = known
        .iter()
        .map(|there| (strsim::normalized_damerau_levenshtein(name, there), *there))
        .filter(|(likeness, _)| *likeness >= LIKE)
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let near: Vec<&str> = near.iter().take(SUGGESTIONS).map(|(_, there)| *there).collect();
    match near.is_empty() {
        true => format!("there is: {}", known.join(", ")),
        false => format!("did you mean {}?", near.join(" or ")),
    }
}

/// Names of the networks that come trained.
pub fn trained_names() -> impl Iterator<Item = &'static str> {
    TRAINED.iter().map(|(name, _)| *name)
}

fn trained(name: &str) -> Option<&'static [u8]> {
    TRAINED.iter().find(|(known, _)| *known == name).map(|(_, bytes)| *bytes)
}

/// Whether `name` is an EEM-SAN, built in or in a file.
fn is_eem_san(name: &str) -> bool {
    trained(name).is_some()
        || Path::new(name).extension().is_some_and(|extension| extension == WEIGHTS_EXTENSION)
}
