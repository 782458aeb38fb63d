//! Two references that know nothing of cores: floating point and fixed point, layer by layer.
//!
//! ```text
//! float (Algorithm 1) ~ fixed (the same in chip arithmetic) == DenseEngine == EventEngine
//! ```
//! The first step is measured (`spikeloop agree`), the others are exact and tested.

mod bdett;
pub mod counted;
pub mod eem_san;
pub mod event_encoder;
pub mod fixed;
pub mod fixed_eem_san;
pub mod float;

pub use counted::{CountedEemSan, CountedNetwork};
pub use eem_san::EemSanPolicy;
pub use event_encoder::FloatEncoder;
pub use fixed::FixedNetwork;
pub use fixed_eem_san::FixedEemSan;
pub use float::{FloatNetwork, FloatPolicy};

/// What a decision of a network shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decision {
    /// Spikes of each output neuron over all steps.
    pub output_counts: Vec<u32>,
    /// Spikes of each layer in each step: `layer_counts[layer][step]`.
    pub layer_counts: Vec<Vec<u32>>,
}

impl Decision {
    /// No spikes yet.
    fn new(layers: usize, outputs: usize) -> Self {
        Self { output_counts: vec![0; outputs], layer_counts: vec![Vec::new(); layers] }
    }

    fn add_step(&mut self, layer: usize, spikes: &[bool], last: bool) {
        self.layer_counts[layer].push(spikes.iter().filter(|s| **s).count() as u32);
        if last {
            self.output_counts.iter_mut().zip(spikes).for_each(|(n, s)| *n += u32::from(*s));
        }
    }
}
