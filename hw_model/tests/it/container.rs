//! Core maps as files: what was written is read, and hostile content never panics.

use std::sync::Arc;

use hw_model::container::{self, Kind};
use hw_model::engine::SpikeRecord;
use hw_model::trace::{engines, total_lines};
use hw_model::{CoreMap, CoreMapParts};
use proptest::prelude::*;
use serde::{Deserialize, Serialize};

use crate::random_map::{config, recipe, spikes, stimulus};

const KIND: Kind = Kind { label: *b"SLTEST\0\0", version: 1, advice: "make it again" };
const HEADER_BYTES: usize = 52;

/// A map as in the files of `compile`.
#[derive(Debug, Serialize, Deserialize)]
struct Packed(#[serde(with = "hw_model::core_map::packed")] CoreMapParts);

/// `parts` in one of two forms.
fn write(packed: bool, parts: &CoreMapParts) -> Vec<u8> {
    if packed {
        container::to_bytes(KIND, &Packed(parts.clone()))
    } else {
        container::to_bytes(KIND, parts)
    }
}

fn read(packed: bool, bytes: &[u8]) -> Option<CoreMapParts> {
    if packed {
        container::from_bytes(KIND, "x.map", bytes).ok().map(|Packed(parts)| parts)
    } else {
        container::from_bytes(KIND, "x.map", bytes).ok()
    }
}

/// `bytes` with length and digest made to fit their content.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let content = bytes.split_off(HEADER_BYTES);
    bytes[12..20].copy_from_slice(&(content.len() as u64).to_le_bytes());
    let digest = container::sha256_hex(&content);
    for (index, byte) in bytes[20..52].iter_mut().enumerate() {
        *byte = u8::from_str_radix(&digest[2 * index..2 * index + 2], 16).unwrap();
    }
    bytes.extend(content);
    bytes
}

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn a_map_that_was_written_is_read(recipe in recipe(), packed in any::<bool>()) {
        let map = recipe.build();
        let bytes = write(packed, map.parts());
        prop_assert_eq!(&sealed(bytes.clone()), &bytes);
        let read = CoreMap::new(read(packed, &bytes).unwrap()).unwrap();
        prop_assert_eq!(read.digest(), map.digest());
        prop_assert_eq!(read, map);
    }

    #[test]
    fn maps_with_damaged_content_and_a_good_digest_never_panic(
        recipe in recipe(),
        packed in any::<bool>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
        raw in spikes(6),
    ) {
        let mut bytes = write(packed, &recipe.parts());
        for (at, byte) in damage {
            let at = HEADER_BYTES + at.index(bytes.len() - HEADER_BYTES);
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(HEADER_BYTES + cut.index(bytes.len() - HEADER_BYTES));
        }
        if let Some(Ok(map)) = read(packed, &sealed(bytes)).map(CoreMap::new) {
            agree_on(map, &raw)?;
        }
    }
}

/// What passes the checks runs, and the same on every engine.
fn agree_on(map: CoreMap, raw: &[(u64, u32, u32)]) -> Result<(), TestCaseError> {
    // Memory for every line of a huge port is no concern of this test.
    if map.ports().iter().any(|port| port.lines > 100_000) {
        return Ok(());
    }
    let map = Arc::new(map);
    let stimulus = stimulus(&map, 6, raw);
    let results = engines(&map).into_iter().map(|(name, mut engine)| {
        engine.run(&stimulus, &mut SpikeRecord::all(&map));
        (name, total_lines(engine.as_ref()))
    });
    let results: Vec<_> = results.collect();
    for (name, lines) in &results[1..] {
        prop_assert_eq!(lines, &results[0].1, "{}", name);
    }
    Ok(())
}

#[test]
fn most_damaged_maps_are_refused_and_some_run() {
    use proptest::strategy::ValueTree;
    for packed in [false, true] {
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let (mut undecodable, mut refused, mut running) = (0, 0, 0);
        for case in 0..400usize {
            let recipe = recipe().new_tree(&mut runner).unwrap().current();
            let mut bytes = write(packed, &recipe.parts());
            let at = HEADER_BYTES + case * 7919 % (bytes.len() - HEADER_BYTES);
            bytes[at] ^= 1 << (case % 8);
            match read(packed, &sealed(bytes)).map(CoreMap::new) {
                None => undecodable += 1,
                Some(Err(_)) => refused += 1,
                Some(Ok(_)) => running += 1,
            }
        }
        let counts = [undecodable, refused, running];
        assert!(counts.iter().all(|n| *n >= 20), "undecodable, refused, running: {counts:?}");
    }
}
