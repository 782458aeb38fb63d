//! Integration tests, one binary.

mod fixtures;
mod san;
