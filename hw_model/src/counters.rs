//! Counts of everything the chip does. Integers only; prices are in [`crate::cost`].

use serde::{Deserialize, Serialize};

macro_rules! op_counts {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// Operations of one core or of the whole chip.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
        pub struct OpCounts { $($(#[$doc])* pub $name: u64,)* }

        impl OpCounts {
            /// Every counter with its name, in a fixed order.
            pub fn named(&self) -> Vec<(&'static str, u64)> {
                vec![$((stringify!($name), self.$name),)*]
            }
        }

        impl std::ops::AddAssign<&OpCounts> for OpCounts {
            fn add_assign(&mut self, other: &OpCounts) {
                $(self.$name += other.$name;)*
            }
        }

        impl std::ops::Sub for OpCounts {
            type Output = OpCounts;

            /// What was counted since `earlier`.
            fn sub(self, earlier: OpCounts) -> OpCounts {
                OpCounts { $($name: self.$name - earlier.$name,)* }
            }
        }
    };
}

op_counts! {
    /// Weights added to an accumulator, from dense entries (stored zeros included).
    synaptic_ops_dense,
    /// Weights added to an accumulator, from sparse entries.
    synaptic_ops_sparse,
    /// Weights added to an accumulator, from kernels that several axons share.
    synaptic_ops_kernel,
    /// Compartments visited with no state, no input and no bias.
    updates_inactive,
    /// Compartments updated that did not spike.
    updates_active,
    /// Compartments updated that spiked.
    updates_spiking,
    /// Spikes that arrived on an input axon.
    axon_deliveries,
    /// Spike messages sent, one per target core and axon.
    messages,
    /// Messages whose target core is in the sender's tile.
    messages_within_tile,
    /// Tile borders crossed east-west by messages.
    hops_east_west,
    /// Tile borders crossed north-south by messages.
    hops_north_south,
    /// Chip-wide barriers, one per time step (counted once, not per core).
    barriers,
    /// Spike messages that the host injected.
    host_injections,
    /// Spike counters or states that the host read.
    host_reads,
    /// Compartments whose state the management processor cleared.
    host_resets,
    /// Update-count registers that the management processor wrote to hold or release a core.
    management_writes,
    /// Spikes that arrived on an input axon of a held core and were lost.
    deliveries_while_held,
    /// Spike messages that a faulty network lost on their way, of the host's too.
    messages_lost,
    /// Accumulated inputs that did not fit their register.
    accumulator_overflows,
    /// Currents that did not fit their register.
    current_overflows,
    /// Sums of current and bias that did not fit their register.
    bias_sum_overflows,
    /// Voltages that were clipped.
    voltage_clips,
}

impl OpCounts {
    /// Synaptic operations of all forms.
    pub fn synaptic_ops(&self) -> u64 {
        self.synaptic_ops_dense + self.synaptic_ops_sparse + self.synaptic_ops_kernel
    }

    /// Compartments visited, whatever their state.
    pub fn compartment_updates(&self) -> u64 {
        self.updates_inactive + self.updates_active + self.updates_spiking
    }

    /// Spikes made by compartments.
    pub fn spikes(&self) -> u64 {
        self.updates_spiking
    }

    /// Sum over cores.
    pub fn total<'a>(counts: impl IntoIterator<Item = &'a OpCounts>) -> OpCounts {
        let mut sum = OpCounts::default();
        counts.into_iter().for_each(|c| sum += c);
        sum
    }
}
