//! Verbs of the command line. Everything that prints, reads the clock or writes files is here.

mod agree;
mod arena;
mod args;
mod camera;
mod compile;
mod demo;
mod drive;
mod drivers;
mod evaluate;
mod halve;
mod inspect;
mod output;
mod report;
mod reproduce;
mod run;
mod study;
mod table5;
mod thresholds;
mod trace;
mod train;

pub(crate) use args::Args;
pub(crate) use output::complain;

use args::Verb;

/// Any error: its text goes to the user.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Exit code for input that cannot be used.
pub(crate) const BAD_INPUT: u8 = 2;

/// How a command that could do its work ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As expected: exit code 0.
    Good,
    /// Done, but the result differs from what was expected: exit code 1.
    Differs,
}

impl From<Verdict> for std::process::ExitCode {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Good => Self::from(0),
            Verdict::Differs => Self::from(1),
        }
    }
}

/// Runs the verb that was typed.
pub(crate) fn run(args: Args) -> Result<Verdict, Failure> {
    match args.verb {
        Verb::Agree(args) => agree::run(&args),
        Verb::Compile(args) => compile::run(&args),
        Verb::Inspect(args) => inspect::run(&args),
        Verb::Run(args) => run::run(&args),
        Verb::Drive(args) => drive::run(&args),
        Verb::Evaluate(args) => evaluate::run(&args),
        Verb::Study(args) => study::run(&args),
        Verb::Arena(args) => arena::run(&args),
        Verb::Thresholds(args) => thresholds::run(&args),
        Verb::Camera(args) => camera::run(&args),
        Verb::Demo(args) => demo::run(&args),
        Verb::Table5(args) => table5::run(&args),
        Verb::Report(args) => report::run(&args),
        Verb::Reproduce(args) => reproduce::run(&args),
        Verb::Trace(args) => trace::run(&args),
        Verb::Train(args) => train::run(&args),
        Verb::Halve(args) => halve::run(&args),
        Verb::Completions { shell } => {
            output::completions(shell)?;
            Ok(Verdict::Good)
        }
    }
}
