//! The command line of spikeloop.

mod cli;

fn main() -> std::process::ExitCode {
    match cli::run(cli::Args::read()) {
        Ok(verdict) => verdict.into(),
        Err(error) => {
            cli::complain(&error);
            cli::BAD_INPUT.into()
        }
    }
}
