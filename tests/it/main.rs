//! Integration tests, one binary.

mod fixtures;
mod golden;
mod nets;
mod san;
mod tidy;
