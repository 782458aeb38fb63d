//! What the closed form needs to know of a run.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Inputs of one layer, sums over its calls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// Inputs that are not 0, each group of a fused pair by itself.
    pub arrivals: u64,
    /// Inputs that are not 0, times the windows inside the picture that hold them: 4 inside, 2 at
    /// an edge, 1 in a corner; 1 for a fully connected layer.
    pub reached: u64,
    /// The part of `reached` in calls with any input outside of -1, 0, 1.
    pub reached_by_reals: u64,
}

/// A module over some control ticks.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Activity {
    /// Inputs of each layer; of an encoder the readout comes last, of a decision module the
    /// branches first.
    pub layers: Vec<Traffic>,
    /// Spikes of each layer of neurons; empty for an artificial module.
    pub fired: Vec<u64>,
    /// Membranes that changed in a step, the first step of each tick left out.
    pub membranes_changed: u64,
}

impl Traffic {
    /// One call with inputs that are not 0 for `arrivals`, reach `reached` windows.
    pub fn call(arrivals: u64, reached: u64, reals: bool) -> Self {
        Self { arrivals, reached, reached_by_reals: if reals { reached } else { 0 } }
    }

    /// `reached` by calls with inputs of -1, 0, 1 alone.
    pub(super) fn reached_by_bits(&self) -> u64 {
        self.reached - self.reached_by_reals
    }
}

impl Activity {
    /// Nothing yet, for `layers` layers of which `spiking` are of neurons.
    pub fn new(layers: usize, spiking: usize) -> Self {
        Self {
            layers: vec![Traffic::default(); layers],
            fired: vec![0; spiking],
            membranes_changed: 0,
        }
    }
}

impl AddAssign for Traffic {
    fn add_assign(&mut self, other: Self) {
        self.arrivals += other.arrivals;
        self.reached += other.reached;
        self.reached_by_reals += other.reached_by_reals;
    }
}

impl AddAssign<&Activity> for Activity {
    /// Panics when the modules differ in their layers; an empty one takes any.
    fn add_assign(&mut self, other: &Self) {
        if self.layers.is_empty() {
            *self = Self::new(other.layers.len(), other.fired.len());
        }
        assert_eq!(self.layers.len(), other.layers.len(), "layers of the activity");
        self.layers.iter_mut().zip(&other.layers).for_each(|(sum, layer)| *sum += *layer);
        self.fired.iter_mut().zip(&other.fired).for_each(|(sum, fired)| *sum += fired);
        self.membranes_changed += other.membranes_changed;
    }
}
