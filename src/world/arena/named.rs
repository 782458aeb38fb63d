//! The arenas that come with the program.

use super::Arena;

/// Name and JSON text. The files are of this project's own design.
const NAMED: [(&str, &str); 2] = [
    ("courtyard", include_str!("../arenas/courtyard.json")),
    ("courtyard-moving", include_str!("../arenas/courtyard-moving.json")),
];

impl Arena {
    /// A built-in arena; `None` for a name that [`list_named`] does not have.
    pub fn named(name: &str) -> Option<Self> {
        let (name, text) = NAMED.iter().find(|(known, _)| *known == name)?;
        Some(Self::from_json(text.as_bytes(), name, None).expect("built-in arenas are tested"))
    }
}

/// Names of the built-in arenas.
pub fn list_named() -> [&'static str; NAMED.len()] {
    NAMED.map(|(name, _)| name)
}

#[cfg(test)]
#[path = "named_tests.rs"]
mod tests;
