//! The host's side of the chip: what to inject when, what to read when, and what it means.

pub mod chip_policy;
pub mod deployment;
pub mod eem_san_policy;
pub mod eem_san_program;
mod watch;
mod work;

pub use chip_policy::{ChipPolicy, ChipUse, HostCounts};
pub use deployment::{DecisionProgram, Deployment};
pub use eem_san_policy::EemSanChipPolicy;
pub use eem_san_program::{EemSanProgram, Schedule};
