//! Training mathematics: layers with hand-written backward passes, the networks made of them,
//! their optimiser, and their state as bytes.
//!
//! All parameters of a network live in one flat vector, [`Parameters`]; a layer is only its sizes
//! and the places of its tensors there. Gradients are flat vectors of the same length. So Adam,
//! soft updates, sums over shards, saving and loading are loops that know no network.
//!
//! Activations are row-major, features last. Over the steps of a spiking network they are
//! `[step][sample][feature]`: no layer feeds back, so each layer runs all its steps at once, one
//! matrix product and one scan.
//!
//! Results depend on the number of shards, a setting of the trainer, and never on the number of
//! threads. They may differ between machines in the last bits, because the matrix product picks
//! its instructions at run time.

pub mod activation;
pub mod actor;
pub mod adam;
pub mod bdett;
pub mod conv;
pub mod critic;
pub mod ddpg;
pub mod gemm;
pub mod hsvae;
pub mod init;
pub mod lif;
pub mod linear;
pub mod parameters;
pub mod population;
pub mod rate;
pub mod shards;
pub mod soft_update;
pub mod spike;
pub mod spiking_encoder;
pub mod state;
pub mod threshold;
pub mod vae;
pub mod variant;

#[cfg(test)]
mod gradient_check;

pub use actor::{Actor, ActorShape, ActorState, History};
pub use adam::{Adam, AdamSettings};
pub use bdett::Bdett;
pub use critic::{Critic, CriticShape};
pub use ddpg::{Ddpg, DdpgSettings, Guide, Losses, Objective, Transitions};
pub use hsvae::{DecoderKind, EncoderKind, Hsvae, HsvaeShape};
pub use parameters::{Layout, Parameters, Slot};
pub use spike::{Rectangular, Smooth, Spike};
pub use spiking_encoder::{SpikingEncoder, SpikingEncoderShape};
pub use state::{StateError, StateReader, StateWriter};
pub use variant::{Form, Variant};
