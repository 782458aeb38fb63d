//! Networks that can be named instead of given as a file.

mod reflex;

use std::path::Path;

use crate::files;
use crate::net::description;
use crate::net::error::NetError;
use crate::net::network::Network;

const SAN: &str = include_str!("builtin/san.toml");

/// Names of the built-in descriptions.
pub const NAMES: [&str; 2] = ["reflex", "san"];

/// Reads a network by its built-in name or from a description file. A file that is called like a
/// built-in network needs its folder: `./san`.
///
/// Errors: as [`description::read`]; an unknown name; a built-in network without its weights.
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
        _ if path.exists() || path.extension().is_some() => description::read(path, weights),
        _ => Err(NetError::Unknown { name: name.to_owned(), known: NAMES.join(", ") }),
    }
}
