//! Training of EEM-SAN by driving in random rooms: the auto-encoder (Algorithm 2), then the actor.
//!
//! Training goes in *rounds*. In a round some worlds, each a fresh room, are flown side by side for
//! a number of control ticks, and networks are updated in between. A round begins and ends without
//! any flight under way, so what is left between rounds is networks, optimisers, counters and (for
//! the actor) the replay memory: a checkpoint there is exact, and a run that was killed goes on
//! from its last checkpoint to the same weights, bit for bit.

pub mod actor;
pub mod config;
pub mod end_to_end;
pub mod flight;
pub mod hsvae;
pub mod mover_picture;
mod recent;
pub mod replay;
pub mod rooms;
pub mod selection;

use crate::net::EventEncoder;
use crate::net::eem_san::KERNEL;
use crate::nn::StateWriter;

pub use actor::{ActorReport, ActorTraining, Selected};
pub use config::{ActorConfig, HsvaeConfig, TrainConfigError};
pub use hsvae::{HsvaeReport, HsvaeTraining};

/// Adds an encoder's tensors to a weights file, names beginning with `hsvae.`, for
/// [`crate::net::EemSan::from_bytes`].
pub fn add_encoder(state: &mut StateWriter, encoder: &EventEncoder) {
    for layer in &encoder.layers {
        let shape = [layer.outputs, layer.inputs, KERNEL, KERNEL];
        state.floats(&format!("hsvae.{}.weight", layer.name), &shape, &layer.weights);
        state.floats(&format!("hsvae.{}.bias", layer.name), &[layer.outputs], &layer.bias);
    }
    let readout = &encoder.readout;
    let n = readout.bias.len();
    state.floats("hsvae.mu.weight", &[n, readout.weights.len() / n.max(1)], &readout.weights);
    state.floats("hsvae.mu.bias", &[n], &readout.bias);
    // Mean and deviation are worked into the readout already.
    state.floats("hsvae.latent.mean", &[n], &vec![0.0; n]);
    state.floats("hsvae.latent.deviation", &[n], &vec![1.0; n]);
    if let Some(number) = encoder.kind.number() {
        state.floats("hsvae.kind", &[1], &[number]);
    }
    if encoder.kind.spikes() {
        state.floats("hsvae.threshold", &[1], &[encoder.threshold as f32]);
    }
}

/// `work` on every item, on up to `threads` threads; which thread does what changes no result.
fn on_each<T: Send>(items: &mut [T], threads: usize, work: impl Fn(&mut T) + Sync) {
    let threads = threads.clamp(1, items.len().max(1));
    if threads == 1 {
        items.iter_mut().for_each(work);
        return;
    }
    let share = items.len().div_ceil(threads);
    let scope = crossbeam::thread::scope(|scope| {
        for part in items.chunks_mut(share) {
            let work = &work;
            scope.spawn(move |_| part.iter_mut().for_each(work));
        }
    });
    if let Err(panic) = scope {
        std::panic::resume_unwind(panic);
    }
}

#[cfg(test)]
#[path = "train_tests.rs"]
mod tests;
