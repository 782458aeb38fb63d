//! Results as data, tables, pictures and pages. Numbers in, text out: nothing here runs anything.

pub mod curves;
pub mod chip_picture;
pub mod page;
pub mod plot;
pub mod results;
pub mod tables;

pub use results::{DriveResult, DriverResult, Summary};
