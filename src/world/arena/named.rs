//! The arenas that come with the program.
//!
//! `courtyard` is open; `map1` (a depot) and `map2` (a park) are for evaluation, 20 x 20 m, each
//! with eleven movers in the directions and at the speeds of EEM-SAN's table of obstacle speeds;
//! `train1` to `train4` are rooms of 12 x 12 m and rising difficulty, the last two with movers.

use super::Arena;

/// Name and JSON text. The files are of this project's own design.
const NAMED: [(&str, &str); 8] = [
    ("courtyard", include_str!("../arenas/courtyard.json")),
    ("courtyard-moving", include_str!("../arenas/courtyard-moving.json")),
    ("map1", include_str!("../arenas/map1.json")),
    ("map2", include_str!("../arenas/map2.json")),
    ("train1", include_str!("../arenas/train1.json")),
    ("train2", include_str!("../arenas/train2.json")),
    ("train3", include_str!("../arenas/train3.json")),
    ("train4", include_str!("../arenas/train4.json")),
];

/// Start/goal pairs of an evaluation on a map (EEM-SAN: 200, at least 6 m apart).
pub const EVALUATION_PAIRS: usize = 200;

/// Seed of those pairs: `generate_pairs` with its default rules and trial 0 of this seed, in the
/// map with its movers. `spikeloop drive --arena map1` without further options flies them.
pub const EVALUATION_SEED: u64 = 1;

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
