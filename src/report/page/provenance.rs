//! What is needed to make everything again.

use crate::report::document::{Content, Item, Report};
use crate::report::page::html::{Section, paragraph, table};
use crate::report::tables::plain;

pub(super) fn section(report: &Report) -> Section {
    let mut rows = plain(&["file", "holds", "of", "seed", "revision", "sha-256"]);
    for item in &report.items {
        for [of, seed, revision, digest] in origins(item) {
            let verb = format!("spikeloop {}", item.content.verb());
            rows.add_row([item.file.clone(), verb, of, seed, revision, digest]);
        }
    }
    let note = "Each line is of a driver, network or map. Digests are of core maps where a chip \
                drove, else of the network.";
    let body = match report.items.is_empty() {
        true => String::new(),
        false => paragraph(note) + &table(&rows),
    };
    Section { id: "provenance", title: "Seeds, revisions, digests", body }
}

/// (of what, seed, revision, digest) of everything in an item, each once.
fn origins(item: &Item) -> Vec<[String; 4]> {
    let none = || "none".to_owned();
    let or_none = |digest: &Option<String>| digest.clone().unwrap_or_else(none);
    let mut origins: Vec<[String; 4]> = match &item.content {
        Content::Drive(result) => {
            let of = |d: &crate::report::DriverResult| {
                let digest = d.map_digest.as_ref().or(d.digest.as_ref()).cloned();
                [d.label.clone(), d.seed.to_string(), result.revision.clone(), or_none(&digest)]
            };
            result.drivers.iter().map(of).collect()
        }
        Content::Replay(r) => {
            let map = r.chip.as_ref().map(|chip| chip.map_digest.clone());
            let digest = or_none(&map.or(r.digest.clone()));
            vec![[r.driver.clone(), r.seed.to_string(), r.revision.clone(), digest]]
        }
        Content::Success(success) => {
            let of = |cell: &crate::report::success::Cell| {
                let (network, map) = (cell.network.clone(), &cell.arena_digest);
                let digest = cell.core_map_digest.as_ref().or(cell.network_digest.as_ref());
                let digest = or_none(&digest.cloned());
                [
                    [network, cell.seed.to_string(), cell.revision.clone(), digest],
                    [cell.map.clone(), none(), cell.revision.clone(), map.clone()],
                ]
            };
            success.cells.iter().flat_map(of).collect()
        }
        Content::Table5(r) => {
            vec![[r.network.clone(), r.seed.to_string(), r.revision.clone(), none()]]
        }
        Content::Agreement(r) => {
            let digest = r.map_digest.clone();
            vec![[r.network.clone(), r.seed.to_string(), r.revision.clone(), digest]]
        }
        Content::Chip(plan) => {
            vec![[plan.network.clone(), none(), none(), plan.map_digest.clone()]]
        }
        Content::Study(study) => {
            let s = &study.settings;
            let of = |tried: &crate::report::study::Tried, digest: &str| {
                let (seed, revision) = (s.seed.to_string(), tried.revision.clone());
                [s.network.clone(), seed, revision, digest.to_owned()]
            };
            let float = study.float.iter().map(|tried| of(tried, &s.network_digest));
            let flown = study.points.iter().filter_map(|point| point.flown());
            float.chain(flown.map(|chip| of(&chip.tried, chip.map_digest()))).collect()
        }
        // Its cells are those of the success table beside it.
        Content::Reproduction(_) => Vec::new(),
        Content::Thresholds(r) => {
            let of = |t: &crate::report::thresholds::Thresholds| {
                [t.network.clone(), none(), r.revision.clone(), or_none(&t.digest)]
            };
            r.thresholds.iter().map(of).collect()
        }
    };
    origins.sort_unstable();
    origins.dedup();
    origins
}
