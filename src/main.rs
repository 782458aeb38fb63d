//! The command line of spikeloop.

mod cli;

use clap::Parser;

fn main() -> std::process::ExitCode {
    match cli::run(cli::Args::parse()) {
        Ok(verdict) => verdict.into(),
        Err(error) => {
            cli::complain(&error);
            cli::BAD_INPUT.into()
        }
    }
}
