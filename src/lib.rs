#![doc = include_str!("ARCHITECTURE.md")]

pub mod closed_loop;
pub mod coding;
pub mod compile;
pub mod evaluate;
pub mod files;
pub mod golden;
pub mod host;
pub mod net;
pub mod nn;
pub mod npz;
pub mod policy;
pub mod reference;
pub mod report;
pub mod rng;
pub mod train;
pub mod world;
