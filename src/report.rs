//! Results as data, tables, pictures and pages. Numbers in, text out: nothing here runs anything.

pub mod activity;
pub mod agreement;
pub mod bars;
pub mod chip_picture;
pub mod chip_plan;
pub mod contacts;
pub mod curves;
pub mod document;
pub mod energy;
pub mod interval;
pub mod page;
pub mod plot;
pub mod replay;
pub mod reproduction;
pub mod results;
pub mod study;
pub mod study_picture;
pub mod success;
pub mod table5;
pub mod table_file;
pub mod tables;
pub mod thresholds;

pub use document::Report;
pub use results::{DriveResult, DriverResult, Summary};
pub use study::StudyTable;
pub use success::SuccessTable;
