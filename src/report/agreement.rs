//! Chip beside float network, layer by layer: what `agree` found.

use std::collections::BTreeMap;

use comfy_table::Table;
use hw_model::CoreMap;
use serde::{Deserialize, Serialize};

use crate::evaluate::{Agreement, Comparison};
use crate::report::results::counters_by_core;
use crate::report::tables::plain;

/// What `agree --json` writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AgreementResult {
    /// Revision of the program.
    pub revision: String,
    /// The float network as it was typed.
    pub network: String,
    /// SHA-256 of the core map.
    pub map_digest: String,
    /// Quantization policy of the core map; empty in results of before it was written down.
    #[serde(default)]
    pub policy: String,
    /// Decisions that the chip made.
    #[serde(default)]
    pub decisions: u64,
    /// What each core did, in core order: the counters that are not 0.
    #[serde(default)]
    pub counters_by_core: Vec<BTreeMap<String, u64>>,
    /// The arena as it was typed.
    pub arena: String,
    /// Fastest wheel speed; `None` in results of before it was written down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub v_max_m_per_s: Option<f64>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Trials flown to fill the ticks.
    pub trials: usize,
    /// By how many chip steps each layer is compared later than on the float network.
    #[serde(default)]
    pub delays_steps: Vec<u64>,
    /// What was counted.
    pub agreement: Agreement,
}

impl AgreementResult {
    /// What `comparison` found in `trials` trials of `seed` with the core map `map`. Names: revision,
    /// network, policy of the core map, arena.
    pub fn new(
        [revision, network, policy, arena]: [&str; 4],
        map: &CoreMap,
        v_max_m_per_s: f64,
        seed: u64,
        trials: usize,
        comparison: &Comparison,
    ) -> Self {
        let used = comparison.chip_use();
        Self {
            revision: revision.to_owned(),
            network: network.to_owned(),
            map_digest: map.digest(),
            policy: policy.to_owned(),
            decisions: used.decisions,
            counters_by_core: counters_by_core(map, &used.by_core, &used.slowest_ps),
            arena: arena.to_owned(),
            v_max_m_per_s: Some(v_max_m_per_s),
            seed,
            trials,
            delays_steps: comparison.delays().to_vec(),
            agreement: comparison.agreement().clone(),
        }
    }
}

/// `-` where nothing spiked.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.3}", 100.0 * share))
}

/// Spikes of every layer on both sides.
pub fn agreement_table(agreement: &Agreement) -> Table {
    let mut table = plain(&[
        "layer",
        "neurons",
        "float spikes",
        "chip spikes",
        "in both",
        "same step (%)",
        "same tick (%)",
        "rate (%)",
    ]);
    for layer in &agreement.layers {
        let sites = (layer.neurons as f64 * layer.steps as f64).max(1.0);
        table.add_row([
            layer.layer.clone(),
            layer.neurons.to_string(),
            layer.float.to_string(),
            layer.chip.to_string(),
            layer.both.to_string(),
            percent(layer.share()),
            percent(layer.share_in_tick()),
            format!("{:.3}", 100.0 * layer.float as f64 / sites),
        ]);
    }
    table
}

/// How far the actions are apart.
pub fn actions_line(agreement: &Agreement, trials: usize) -> String {
    let (ticks, n) = (agreement.ticks, agreement.ticks.max(1) as f64);
    format!(
        "actions equal in {} of {ticks} ticks of {trials} trials, mean difference {:.4}, largest \
         {:.2} (of the wheel's range)",
        agreement.equal_actions,
        agreement.action_difference_sum / n,
        agreement.action_difference_max
    )
}

#[cfg(test)]
#[path = "agreement_tests.rs"]
mod tests;
