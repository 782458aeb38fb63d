//! Results as data, tables, pictures and pages. Numbers in, text out: nothing here runs anything.

pub mod activity;
pub mod chip_picture;
pub mod curves;
pub mod energy;
pub mod page;
pub mod plot;
pub mod results;
pub mod success;
pub mod tables;
pub mod thresholds;

pub use results::{DriveResult, DriverResult, Summary};
pub use success::SuccessTable;
