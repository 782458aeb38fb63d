//! Integration tests, one binary.

mod closed_loop;
mod fixtures;
mod golden;
mod nets;
mod san;
mod tidy;
