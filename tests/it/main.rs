//! Integration tests, one binary.

mod bad_input;
mod cli;
mod closed_loop;
mod conv;
mod eem_san;
mod eem_san_chip;
mod evaluate;
mod fixtures;
mod fuzz;
mod golden;
mod nets;
mod report;
mod reproduce;
mod san;
mod study;
mod table5;
mod tidy;
mod train;
mod variants;
