//! Counts times prices: energy and time.
//!
//! Energy is linear in the counts, so it is computed from totals when a report is made. Time is
//! not: in each step the slowest core holds up the barrier, so the engines add
//! [`CostTable::core_time_ps`] of the slowest core and the barrier step by step.

use serde::{Deserialize, Serialize};

use crate::counters::OpCounts;

macro_rules! prices {
    ($(#[$doc:meta])* $name:ident { $($field:ident,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(missing_docs)]
        pub struct $name { $(pub $field: f64,)* }

        impl $name {
            fn numbers(&self) -> Vec<(&'static str, f64)> {
                vec![$((stringify!($field), self.$field),)*]
            }
        }
    };
}

prices! {
    /// Picojoules per operation.
    EnergyPj {
        synaptic_op_dense, synaptic_op_sparse, synaptic_op_kernel,
        update_inactive, update_active, update_spiking,
        message_within_tile, hop_east_west, hop_north_south, message_out, axon_in,
    }
}

prices! {
    /// Nanoseconds per operation of the core that does it.
    TimeNs {
        synaptic_op_dense, synaptic_op_sparse, synaptic_op_kernel,
        update_inactive, update_active, update_spiking,
        message_out, axon_in,
    }
}

/// A named table of prices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostTable {
    /// Name used on the command line and in reports.
    pub name: String,
    /// Where the numbers come from and what they leave out.
    pub source: String,
    /// Duration of a barrier by number of tiles in use: (tiles, ns), tiles increasing; linear in
    /// between, constant outside.
    pub barrier_ns_by_tiles: Vec<(f64, f64)>,
    /// Energy prices.
    pub energy_pj: EnergyPj,
    /// Time prices.
    pub time_ns: TimeNs,
}

/// Energy in femtojoules, by what spent it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Energy {
    /// Synaptic operations and axon handling.
    pub synapses_fj: u64,
    /// Compartment updates and spike generation.
    pub compartments_fj: u64,
    /// Messages and hops.
    pub network_fj: u64,
}

impl Energy {
    /// All dynamic energy.
    pub fn total_fj(&self) -> u64 {
        self.synapses_fj + self.compartments_fj + self.network_fj
    }
}

impl CostTable {
    /// Dynamic energy of `counts`. Static power is not part of it.
    pub fn energy(&self, counts: &OpCounts) -> Energy {
        let p = &self.energy_pj;
        Energy {
            synapses_fj: weigh(&[
                (counts.synaptic_ops_dense, p.synaptic_op_dense),
                (counts.synaptic_ops_sparse, p.synaptic_op_sparse),
                (counts.synaptic_ops_kernel, p.synaptic_op_kernel),
                (counts.axon_deliveries, p.axon_in),
            ]),
            compartments_fj: weigh(&[
                (counts.updates_inactive, p.update_inactive),
                (counts.updates_active, p.update_active),
                (counts.updates_spiking, p.update_spiking),
            ]),
            network_fj: weigh(&[
                (counts.messages, p.message_out),
                (counts.messages_within_tile, p.message_within_tile),
                (counts.hops_east_west, p.hop_east_west),
                (counts.hops_north_south, p.hop_north_south),
            ]),
        }
    }

    /// Operations without a price of energy: 0 in the table.
    pub fn unpriced(&self) -> Vec<&'static str> {
        let prices = self.energy_pj.numbers();
        prices.into_iter().filter(|(_, pj)| *pj == 0.0).map(|(name, _)| name).collect()
    }

    /// How long a core is busy with `counts`, in picoseconds, one operation after the other.
    ///
    /// Hop latencies are left out: messages travel while other work goes on, and no public source
    /// says how much of it they hide.
    pub fn core_time_ps(&self, counts: &OpCounts) -> u64 {
        self.core_times().of(counts)
    }

    /// The prices of [`CostTable::core_time_ps`] in whole picoseconds, for repeated use.
    pub(crate) fn core_times(&self) -> CoreTimes {
        let t = &self.time_ns;
        let prices = [
            t.synaptic_op_dense,
            t.synaptic_op_sparse,
            t.synaptic_op_kernel,
            t.update_inactive,
            t.update_active,
            t.update_spiking,
            t.message_out,
            t.axon_in,
        ];
        CoreTimes { ps: prices.map(milli) }
    }

    /// Duration of one barrier across `tiles` tiles, in picoseconds.
    pub fn barrier_ps(&self, tiles: u32) -> u64 {
        let points = &self.barrier_ns_by_tiles;
        let x = f64::from(tiles);
        let above = points.partition_point(|(at, _)| *at <= x);
        let ns = match (above.checked_sub(1).map(|i| points[i]), points.get(above)) {
            (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
            (Some((_, y)), None) | (None, Some(&(_, y))) => y,
            (None, None) => 0.0,
        };
        milli(ns)
    }

    /// All numbers with their field names, for checks.
    pub(crate) fn numbers(&self) -> Vec<(String, f64)> {
        let named = |part: &'static str, numbers: Vec<(&'static str, f64)>| {
            numbers.into_iter().map(move |(field, value)| (format!("{part}.{field}"), value))
        };
        named("energy_pj", self.energy_pj.numbers())
            .chain(named("time_ns", self.time_ns.numbers()))
            .chain(
                self.barrier_ns_by_tiles
                    .iter()
                    .flat_map(|(tiles, ns)| [*tiles, *ns])
                    .map(|value| ("barrier_ns_by_tiles".to_owned(), value)),
            )
            .collect()
    }
}

/// Time prices of a core's operations, see [`CostTable::core_times`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoreTimes {
    ps: [u64; 8],
}

impl CoreTimes {
    /// Picoseconds that a core is busy with `counts`.
    #[inline(always)]
    pub(crate) fn of(&self, counts: &OpCounts) -> u64 {
        let counts = [
            counts.synaptic_ops_dense,
            counts.synaptic_ops_sparse,
            counts.synaptic_ops_kernel,
            counts.updates_inactive,
            counts.updates_active,
            counts.updates_spiking,
            counts.messages,
            counts.axon_deliveries,
        ];
        counts.iter().zip(&self.ps).map(|(count, ps)| count * ps).sum()
    }
}

/// Thousandths: pJ to fJ, ns to ps.
fn milli(value: f64) -> u64 {
    (value * 1000.0).round() as u64
}

fn weigh(terms: &[(u64, f64)]) -> u64 {
    terms.iter().map(|(count, price)| count * milli(*price)).sum()
}

#[cfg(test)]
#[path = "cost_tests.rs"]
mod tests;
