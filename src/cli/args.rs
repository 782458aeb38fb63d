//! What can be typed.

use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::PossibleValuesParser;
use clap::{
    Arg, Args as ClapArgs, Command, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum,
};
use spikeloop::evaluate::{CONDITIONS, DEGRADATIONS};
use spikeloop::nn::variant::VARIANTS;
use spikeloop::report::reproduction::printed::TABLES;
use spikeloop::study::AXES;
use spikeloop::world::arena::EVALUATION_PAIRS;
use spikeloop::world::dvs::CAMERA_DEG;
use spikeloop::world::pairs::PAIRS_MAX;
use spikeloop::world::robot::Actuators;

use crate::cli::reproduce::OTHER_PARTS;

/// Most chip steps of a run: more than two hours of 1 ms steps.
pub(super) const STEPS_MAX: usize = 10_000_000;
const THREADS_MAX: usize = 256;
/// Most control ticks of a comparison.
const TICKS_MAX: usize = 1_000_000;
const REPEATS_MAX: u64 = 1000;
/// Forms of pictures that are not written.
const OTHER_PICTURES: [&str; 7] = ["png", "jpg", "jpeg", "gif", "webp", "pdf", "eps"];

/// Whole numbers from 1 on.
fn up_to<N>(max: N) -> impl Fn(&str) -> Result<N, String> + Clone
where
    N: Copy + Display + FromStr + From<u8> + PartialOrd,
{
    between(N::from(1), max)
}

/// Whole numbers within limits.
fn between<N>(min: N, max: N) -> impl Fn(&str) -> Result<N, String> + Clone
where
    N: Copy + Display + FromStr + PartialOrd,
{
    move |text| {
        let number = text.parse().ok().filter(|number| (min..=max).contains(number));
        number.ok_or_else(|| format!("{text} is not in {min}..={max}"))
    }
}

/// A picture's name, which must not promise what is not written.
fn svg_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let other =
        path.extension().filter(|is| OTHER_PICTURES.iter().any(|it| is.eq_ignore_ascii_case(it)));
    match other {
        Some(_) => Err(format!("{text}: pictures are written as SVG; let the name end in .svg")),
        None => Ok(path),
    }
}

/// Compiles spiking controllers to a Loihi-like chip and flies the closed loop on the emulated
/// chip.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(super) verb: Verb,
}

impl Args {
    /// What was typed. Ends the program with an error if that cannot be understood.
    pub(crate) fn read() -> Self {
        let matches = with_negative_numbers(Self::command()).get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }
}

/// Options take numbers below zero for numbers, not for other options: the error then names what
/// the option allows.
fn with_negative_numbers(command: Command) -> Command {
    let of_arg = |arg: Arg| {
        let is_option = arg.get_long().is_some() && arg.get_action().takes_values();
        if is_option { arg.allow_negative_numbers(true) } else { arg }
    };
    command.mut_args(of_arg).mut_subcommands(with_negative_numbers)
}

#[derive(Debug, Subcommand)]
pub(super) enum Verb {
    /// Quantize, partition and place a network; write a core map
    Compile(CompileArgs),
    /// Print what a core map uses of the chip
    Inspect(InspectArgs),
    /// Run a core map on given input spikes
    Run(RunArgs),
    /// Drive a robot through an arena with a network (float) or a core map (chip)
    Drive(DriveArgs),
    /// Success rates of networks on maps under conditions, beside the paper's
    Evaluate(EvaluateArgs),
    /// Drive with an event camera; print its statistics, write its events and pictures
    Camera(CameraArgs),
    /// The whole loop in one command: compile, drive float and chip, report
    Demo(DemoArgs),
    /// What the controller can bear: fewer weight bits, narrower registers, faults of the chip
    Study(StudyArgs),
    /// Draw an arena with the tracks of its movers
    Arena(ArenaArgs),
    /// Firing thresholds of networks by layer, as a table and a picture
    Thresholds(ThresholdsArgs),
    /// What a decision costs beside artificial counterparts (Table 5), in four accountings
    Table5(Table5Args),
    /// Compare a compiled EEM-SAN with its float network, layer by layer, on equal observations
    Agree(AgreeArgs),
    /// Put results of other verbs into one HTML page, with trials to play
    Report(ReportArgs),
    /// The paper's tables again, from the weights that ship: success, ablation, degraded, costs
    Reproduce(ReproduceArgs),
    /// Record or check golden traces
    Trace(TraceArgs),
    /// Train the auto-encoder of event frames, or an actor; continues where it was stopped
    Train(TrainArgs),
    /// Round the weights of a trained network to 16 bits, so that the file has half the size
    Halve(HalveArgs),
    /// Print a completion script
    Completions {
        /// Shell to complete for
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, ClapArgs)]
pub(super) struct TrainArgs {
    #[command(subcommand)]
    pub(super) what: TrainVerb,
    /// Configuration (TOML) in place of a built-in one
    #[arg(long, value_name = "FILE", global = true)]
    pub(super) config: Option<PathBuf>,
    /// Folder for checkpoint, weights and curves
    #[arg(long, value_name = "FOLDER", default_value = "out/train", global = true)]
    pub(super) out: PathBuf,
    /// Threads; results do not depend on them [default: all]
    #[arg(long, value_parser = up_to(THREADS_MAX), global = true)]
    pub(super) threads: Option<usize>,
    /// A few seconds of everything, to see that it runs
    #[arg(long, global = true)]
    pub(super) quick: bool,
    /// Seed in place of the configuration's
    #[arg(long, value_name = "N", global = true)]
    pub(super) seed: Option<u64>,
    /// Stop after this many rounds; the same command goes on from there
    #[arg(long, value_name = "N", value_parser = up_to(u64::MAX), global = true)]
    pub(super) rounds: Option<u64>,
    /// Stop when this many rounds are done in all, those of earlier runs included
    #[arg(long, value_name = "N", value_parser = up_to(u64::MAX), global = true, conflicts_with = "rounds")]
    pub(super) until: Option<u64>,
    /// Rounds between checkpoints
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = up_to(u64::MAX), global = true)]
    pub(super) checkpoint_every: u64,
}

/// What `demo` can fly.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum DemoNetwork {
    /// The trained network with event camera, on an evaluation map with moving obstacles
    EemSan,
    /// The hand-wired network, in the courtyard
    Reflex,
}

/// Built-in configurations of the actor's training.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum RecipeArg {
    /// Follow the planner, without events
    First,
    /// Follow the planner, with events if there is an encoder
    Second,
    /// Follow critics that see the movers
    Third,
    /// Follow a planner that knows what the sensors show, then critics
    Fourth,
    /// The same again, with an average of the actor
    Fifth,
    /// As the third, with the delays of a chip that streams; give --encoder and --from
    Streaming,
    /// The encoder learns with the actor, end to end; give --encoder and --from
    E2e,
    /// The paper's: DDPG, one world, no planner
    Plain,
    /// One stage from fresh weights, the same for every network
    Compare,
    /// The same with an encoder that learns with the actor; give --encoder
    CompareE2e,
}

/// Auto-encoders.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum KindArg {
    /// Spiking, with state that lasts
    Hsvae,
    /// Artificial, without memory
    Avae,
    /// Spiking, at rest at the start of each control tick, with a spiking decoder
    Fsvae,
}

#[derive(Debug, Subcommand)]
pub(super) enum TrainVerb {
    /// The auto-encoder of event frames, or one that it is compared with
    Hsvae {
        /// Which one, with its built-in configuration [default: hsvae]
        #[arg(long, value_enum)]
        kind: Option<KindArg>,
    },
    /// An actor: EEM-SAN's if --encoder is given, else the laser-only control's
    Actor {
        /// Network; `naive`, `fixed` and `eem-san` take events and need --encoder
        #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(VARIANTS.map(|v| v.name)))]
        variant: Option<String>,
        /// Thresholds at the start, for good where they are fixed, in place of the configuration's
        #[arg(long, value_name = "X")]
        threshold: Option<f64>,
        /// Of the robot in all flights, in place of the configuration's: ideal, lag, lag-0.4,
        /// lag-split-a, lag-split-b, or v:DELAY+TAU,w:DELAY+TAU in seconds
        #[arg(long, value_name = "PRESET")]
        actuators: Option<Actuators>,
        /// Weights of the auto-encoder, as `train hsvae` writes them, or of an EEM-SAN for its encoder
        #[arg(long, value_name = "FILE")]
        encoder: Option<PathBuf>,
        /// Built-in configuration [default: first]
        #[arg(long, value_enum)]
        recipe: Option<RecipeArg>,
        /// Begin with the actor of this weights file in place of a fresh one
        #[arg(long, value_name = "FILE")]
        from: Option<PathBuf>,
    },
}

#[derive(Debug, ClapArgs)]
pub(super) struct CompileArgs {
    /// Description file (.toml), EEM-SAN (.safetensors), integer network (.json), or a built-in
    /// name (reflex, san, eem-san, laser-only, lag/..., compare/...)
    pub(super) network: String,
    /// Trained weights (.safetensors) of a description, or .npz for an integer network
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Built-in chip, or a chip file (.toml)
    #[arg(long, default_value = "loihi1", value_name = "NAME|FILE")]
    pub(super) chip: String,
    /// Quantization policy: nearest (the default), fine, diffused, toward-zero, mixed,
    /// san, san-nearest
    #[arg(long, value_name = "NAME")]
    pub(super) policy: Option<String>,
    /// Bits of a stored weight, 8 if not given (mixed signs: with the sign)
    #[arg(long, value_name = "N", value_parser = between(2u8, 8))]
    pub(super) weight_bits: Option<u8>,
    /// How an EEM-SAN's encoder and decision module share the chip's steps: held (the default), or
    /// streaming
    #[arg(long, value_enum)]
    pub(super) schedule: Option<ScheduleArg>,
    /// Most cores to take, as few as can be if not given: more make steps shorter (`study --axis
    /// cores`). They are shared out so that the busiest has the least to do, by a run on random
    /// observations
    #[arg(long, value_name = "N", value_parser = up_to(usize::MAX), conflicts_with = "neurons_per_core")]
    pub(super) cores: Option<usize>,
    /// Largest number of neurons of one layer on a core, as many as fit if not given: fewer take more
    /// cores and make steps shorter (`study --axis neurons-per-core`). Not beside --cores
    #[arg(long, value_name = "N", value_parser = up_to(usize::MAX))]
    pub(super) neurons_per_core: Option<usize>,
    /// Core map to write
    #[arg(short, long, value_name = "MAP")]
    pub(super) output: PathBuf,
}

#[derive(Debug, ClapArgs)]
pub(super) struct InspectArgs {
    /// Core map
    pub(super) map: PathBuf,
    /// Print JSON
    #[arg(long, conflicts_with = "dump")]
    pub(super) json: bool,
    /// Print the whole map as text
    #[arg(long)]
    pub(super) dump: bool,
    /// Draw the chip, its cores coloured by layer and by use of synapse memory
    #[arg(long, value_name = "FILE.svg", value_parser = svg_path, conflicts_with_all = ["json", "dump"])]
    pub(super) picture: Option<PathBuf>,
    /// Say what the layers did, and which of them steps waited for, and colour the picture by it as well:
    /// result of `run`, `drive` or `agree --json`
    #[arg(long, value_name = "RESULT.json", conflicts_with_all = ["json", "dump"])]
    pub(super) activity: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum ScheduleArg {
    /// One after the other, equal to Algorithm 1
    Held,
    /// A chip step per event frame; actions come two control ticks late
    Streaming,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum EngineArg {
    /// Event-driven
    Event,
    /// Dense fixed-point reference
    Dense,
}

#[derive(Debug, ClapArgs)]
pub(super) struct RunArgs {
    /// Core map
    pub(super) map: PathBuf,
    /// Input spikes (.npz): arrays PORT_t (steps) and PORT_i (lines) for each port that `inspect`
    /// lists; nothing is added, not even what a network's biases need
    #[arg(long, value_name = "IN.npz")]
    pub(super) spikes: PathBuf,
    /// Chip steps; the default is the last input step and one more for each population
    #[arg(long, value_name = "N", value_parser = up_to(STEPS_MAX))]
    pub(super) steps: Option<usize>,
    /// Engine
    #[arg(long, value_enum, default_value = "event")]
    pub(super) engine: EngineArg,
    /// Threads of the event engine at most, fewer where they have too little to do (the dense one
    /// has one); the result is the same for any number
    #[arg(long, default_value_t = 1, value_name = "K", value_parser = up_to(THREADS_MAX))]
    pub(super) threads: usize,
    /// Spikes to write (.npz): arrays POPULATION_t and POPULATION_i
    #[arg(short, long, value_name = "OUT.npz")]
    pub(super) output: Option<PathBuf>,
    /// Counts and digests to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct DriveArgs {
    /// What drives, each in turn on the same trials: core maps (chip), description files (.toml),
    /// EEM-SANs (.safetensors) or built-in names (float), `straight`, `planner` (knows
    /// everything), `planner-camera`, `planner-laser` (know what sensors show of the movers;
    /// `planner-camera:120` has another lens);
    /// chip:NETWORK compiles one first, for loihi1 by the policy nearest
    #[arg(required = true, value_name = "MAP|NETWORK")]
    pub(super) drivers: Vec<String>,
    /// Weights of the networks with descriptions, in place of those that the descriptions name
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Arena file, or a built-in name (courtyard, courtyard-moving, map1, map2, train1..train4)
    #[arg(long, default_value = "courtyard", value_name = "FILE|NAME")]
    pub(super) arena: String,
    /// Leave out the arena's movers
    #[arg(long = "static")]
    pub(super) without_movers: bool,
    /// Start and goal of each trial; drawn from the seed when not given
    #[arg(long, value_name = "FILE")]
    pub(super) pairs: Option<PathBuf>,
    /// Number of trials; all pairs of the file, or 200
    #[arg(long, value_name = "N", value_parser = up_to(PAIRS_MAX))]
    pub(super) trials: Option<usize>,
    /// Seed of all random streams
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Number of seeds, from --seed on
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = up_to(REPEATS_MAX))]
    pub(super) repeats: u64,
    /// Fastest wheel speed
    #[arg(long, default_value_t = 0.5, value_name = "M_PER_S")]
    pub(super) v_max: f64,
    /// ideal, lag, lag-0.4, lag-split-a, lag-split-b, or v:DELAY+TAU,w:DELAY+TAU in seconds
    #[arg(long, default_value = "ideal", value_name = "PRESET")]
    pub(super) actuators: Actuators,
    /// Control ticks per second (SAN 10, EEM-SAN 20)
    #[arg(long, default_value_t = 10, value_name = "HZ")]
    pub(super) control_hz: u32,
    /// Control ticks before a trial is out of time
    #[arg(long, default_value_t = 1000, value_name = "N")]
    pub(super) ticks_max: u64,
    /// Leave out the 1 % action noise of SAN's evaluation
    #[arg(long)]
    pub(super) no_action_noise: bool,
    /// Engine for core maps
    #[arg(long, value_enum, default_value = "event")]
    pub(super) engine: EngineArg,
    /// Threads, each flying trials of its own; all cores by default
    #[arg(long, value_name = "K", value_parser = up_to(THREADS_MAX))]
    pub(super) threads: Option<usize>,
    /// Result file
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
    /// Picture of the trajectories (.svg)
    #[arg(long, value_name = "FILE", value_parser = svg_path)]
    pub(super) plot: Option<PathBuf>,
    /// Write down a trial of the last driver, tick by tick, for `report` to play; it is flown once
    /// more for that
    #[arg(long, value_name = "FILE")]
    pub(super) replay: Option<PathBuf>,
    /// Trial to write down, from 0; may be given several times [default: the first that reached
    /// the goal, or 0]
    #[arg(long = "replay-trial", value_name = "N", requires = "replay")]
    pub(super) replay_trials: Vec<usize>,
}

/// How many flights a cell of the success table has.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(super) struct FlightsArgs {
    /// Trials per map: the first pairs of the evaluation
    #[arg(long, default_value_t = EVALUATION_PAIRS, value_name = "N", value_parser = up_to(PAIRS_MAX))]
    pub(super) trials: usize,
    /// First seed of the random streams; the pairs have a seed of their own
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Number of seeds
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = up_to(REPEATS_MAX))]
    pub(super) seeds: u64,
    /// Threads, each flying trials of its own; all cores by default
    #[arg(long, value_name = "K", value_parser = up_to(THREADS_MAX))]
    pub(super) threads: Option<usize>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct EvaluateArgs {
    /// What drives: everything that `drive` takes; chip:NETWORK compiles it first, for loihi1 by the
    /// policy nearest (compile it with others, and give the core map)
    #[arg(default_values = ["eem-san", "laser-only", "straight"], value_name = "NETWORK")]
    pub(super) networks: Vec<String>,
    /// Weights of the networks that take some
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Arena file or built-in name; may be given several times
    #[arg(long = "map", default_values = ["map1", "map2"], value_name = "FILE|NAME")]
    pub(super) maps: Vec<String>,
    /// Condition, all by default; may be given several times
    #[arg(
        long = "condition",
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(CONDITIONS.map(|condition| condition.name))
    )]
    pub(super) conditions: Vec<String>,
    /// Fly degraded as well, each condition with this; may be given several times
    #[arg(
        long,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(DEGRADATIONS.map(|degradation| degradation.name))
    )]
    pub(super) degraded: Vec<String>,
    #[command(flatten)]
    pub(super) flights: FlightsArgs,
    /// ideal, lag, lag-0.4, lag-split-a, lag-split-b, or v:DELAY+TAU,w:DELAY+TAU in seconds
    #[arg(long, default_value = "ideal", value_name = "PRESET")]
    pub(super) actuators: Actuators,
    /// Control ticks before a trial is out of time
    #[arg(long, default_value_t = 1000, value_name = "N")]
    pub(super) ticks_max: u64,
    /// Keeps every finished cell of the table; a run that finds it goes on after the last one
    #[arg(long, value_name = "FILE")]
    pub(super) state: Option<PathBuf>,
    /// Table to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
    /// Folder for pictures of the trajectories (.svg), one for each network, map and condition
    #[arg(long, value_name = "FOLDER")]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct StudyArgs {
    /// EEM-SAN or laser-only weights (.safetensors), description file (.toml), or a built-in name
    #[arg(default_value = "eem-san", value_name = "NETWORK")]
    pub(super) network: String,
    /// Trained weights (.safetensors) of a description
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// What to vary, everything by default; may be given several times
    #[arg(
        long = "axis",
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(AXES.map(|axis| axis.name))
    )]
    pub(super) axes: Vec<String>,
    /// Arena file or built-in name
    #[arg(long, default_value = "map1", value_name = "FILE|NAME")]
    pub(super) map: String,
    /// Condition
    #[arg(
        long,
        default_value = CONDITIONS[0].name,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(CONDITIONS.map(|condition| condition.name))
    )]
    pub(super) condition: String,
    /// Trials of every point, all the same ones: the first pairs of the evaluation
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = up_to(PAIRS_MAX))]
    pub(super) trials: usize,
    /// Seed of all random streams, faults included; the pairs have a seed of their own
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Control ticks before a trial is out of time
    #[arg(long, default_value_t = 1000, value_name = "N")]
    pub(super) ticks_max: u64,
    /// Threads, each flying trials of its own; all cores by default
    #[arg(long, value_name = "K", value_parser = up_to(THREADS_MAX))]
    pub(super) threads: Option<usize>,
    /// Keeps every finished point; a run that finds it goes on after the last one
    #[arg(long, value_name = "FILE")]
    pub(super) state: Option<PathBuf>,
    /// Study to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
    /// Picture to write (.svg): a plot for each axis
    #[arg(long, value_name = "FILE", value_parser = svg_path)]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct ArenaArgs {
    /// Arena file, or a built-in name (courtyard, courtyard-moving, map1, map2, train1..train4)
    #[arg(value_name = "FILE|NAME")]
    pub(super) arena: String,
    /// Picture to write (.svg)
    #[arg(short, long, value_name = "FILE", value_parser = svg_path)]
    pub(super) output: PathBuf,
}

#[derive(Debug, ClapArgs)]
pub(super) struct ThresholdsArgs {
    /// EEM-SANs (.safetensors), description files (.toml) or built-in names
    #[arg(required = true, value_name = "NETWORK")]
    pub(super) networks: Vec<String>,
    /// Weights of the networks that take some
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Picture to write (.svg)
    #[arg(short, long, value_name = "FILE", value_parser = svg_path)]
    pub(super) output: Option<PathBuf>,
    /// Thresholds to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct HalveArgs {
    /// A trained network (.safetensors)
    #[arg(value_name = "FILE")]
    pub(super) weights: PathBuf,
    /// File to write (.safetensors)
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
}

#[derive(Debug, ClapArgs)]
pub(super) struct CameraArgs {
    /// Arena file, or a built-in name (courtyard, courtyard-moving, map1, map2, train1..train4)
    #[arg(long, default_value = "map1", value_name = "FILE|NAME")]
    pub(super) arena: String,
    /// What drives: description file, EEM-SAN (.safetensors) or built-in name (float), or
    /// `straight`
    #[arg(long, default_value = "reflex", value_name = "straight|NETWORK")]
    pub(super) driver: String,
    /// Weights of the network
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Seed of all random streams
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Simulated time of each condition, in whole seconds
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = up_to(2000u64))]
    pub(super) seconds: u64,
    /// Fastest wheel speed
    #[arg(long, default_value_t = 1.0, value_name = "M_PER_S")]
    pub(super) v_max: f64,
    /// Horizontal field of view
    #[arg(long, default_value_t = f64::from(CAMERA_DEG), value_name = "DEG")]
    pub(super) field_of_view: f64,
    /// Deviation of ln intensity over the surfaces that stand still
    #[arg(long, default_value_t = 0.5, value_name = "LN")]
    pub(super) contrast: f64,
    /// The same over movers
    #[arg(long, default_value_t = 1.0, value_name = "LN")]
    pub(super) mover_contrast: f64,
    /// Events of the drive to write (.npz): arrays t (us), x, y, p and duration (us)
    #[arg(long, value_name = "OUT.npz")]
    pub(super) events: Option<PathBuf>,
    /// Folder for pictures of the drive, one per control tick: the view with its events, then
    /// five event frames, then the reconstruction by --encoder, four times as bright
    #[arg(long, value_name = "FOLDER")]
    pub(super) frames: Option<PathBuf>,
    /// Auto-encoder of event frames (.safetensors) that watches: its spikes are counted
    #[arg(long, value_name = "FILE")]
    pub(super) encoder: Option<PathBuf>,
    /// Statistics to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct Table5Args {
    /// EEM-SAN (.safetensors), built-in name, or `untrained` (its sizes with random weights)
    #[arg(default_value = "eem-san", value_name = "NETWORK")]
    pub(super) network: String,
    /// Arena file, or a built-in name (courtyard, courtyard-moving, map1, map2, train1..train4)
    #[arg(long, default_value = "map1", value_name = "FILE|NAME")]
    pub(super) arena: String,
    /// Simulated time to drive for, in whole seconds
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = up_to(2000u64))]
    pub(super) seconds: u64,
    /// Seed of all random streams, and of random weights
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Fastest wheel speed
    #[arg(long, default_value_t = 1.0, value_name = "M_PER_S")]
    pub(super) v_max: f64,
    /// Counts, rates and ratios to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct AgreeArgs {
    /// Core map of an EEM-SAN or its laser-only control
    pub(super) map: PathBuf,
    /// The network that it was compiled from: weights (.safetensors) or built-in name
    pub(super) network: String,
    /// Arena file, or a built-in name (courtyard, courtyard-moving, map1, map2, train1..train4)
    #[arg(long, default_value = "map1", value_name = "FILE|NAME")]
    pub(super) arena: String,
    /// Control ticks to compare; the float network drives, one trial after the other
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = up_to(TICKS_MAX))]
    pub(super) ticks: usize,
    /// Seed of all random streams
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Fastest wheel speed
    #[arg(long, default_value_t = 1.0, value_name = "M_PER_S")]
    pub(super) v_max: f64,
    /// Engine
    #[arg(long, value_enum, default_value = "event")]
    pub(super) engine: EngineArg,
    /// Counts to write
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct DemoArgs {
    /// Folder with SAN's published weights, world and pairs: drive these instead of a built-in
    /// network
    #[arg(long, value_name = "FOLDER", conflicts_with = "network")]
    pub(super) san: Option<PathBuf>,
    /// Built-in network
    #[arg(long, value_enum, default_value_t = DemoNetwork::EemSan)]
    pub(super) network: DemoNetwork,
    /// Number of trials [default: 20 of eem-san, 200 of the others]
    #[arg(long, value_name = "N", value_parser = up_to(PAIRS_MAX))]
    pub(super) trials: Option<usize>,
    /// Seed of all random streams
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Folder for the core map, the results and the report
    #[arg(short, long, default_value = "out", value_name = "FOLDER")]
    pub(super) output: PathBuf,
}

#[derive(Debug, ClapArgs)]
pub(super) struct ReportArgs {
    /// What other verbs wrote: `drive` (--json, --replay), `evaluate`, `table5`, `agree`,
    /// `thresholds`, `study` and `report` (--json), `reproduction.json` of `reproduce`, and what
    /// `inspect --json` prints
    #[arg(required = true, value_name = "RESULT.json")]
    pub(super) results: Vec<PathBuf>,
    /// Page to write (.html); needed unless --json or --picture is given
    #[arg(short, long, value_name = "OUT", required_unless_present_any = ["json", "picture"])]
    pub(super) output: Option<PathBuf>,
    /// The same for programs; `report` takes it as well
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,
    /// A still picture (.svg) of the first replay
    #[arg(long, value_name = "FILE", value_parser = svg_path)]
    pub(super) picture: Option<PathBuf>,
    /// Control tick of the picture [default: the middle of the trial]
    #[arg(long, value_name = "N", requires = "picture")]
    pub(super) tick: Option<usize>,
}

#[derive(Debug, ClapArgs)]
pub(super) struct ReproduceArgs {
    /// Only this part; may be given several times
    #[arg(long = "only", value_name = "PART", value_parser = PossibleValuesParser::new(parts()))]
    pub(super) parts: Vec<String>,
    #[command(flatten)]
    pub(super) flights: FlightsArgs,
    /// ideal, lag, lag-0.4, lag-split-a, lag-split-b, or v:DELAY+TAU,w:DELAY+TAU in seconds: of the
    /// robot in all trials (operations are counted with ideal ones); give each its own folder
    #[arg(long, default_value = "ideal", value_name = "PRESET")]
    pub(super) actuators: Actuators,
    /// Folder for results, and for what is flown already: the same command goes on from there
    #[arg(short, long, value_name = "FOLDER", default_value = "out/reproduce")]
    pub(super) output: PathBuf,
    /// No trials: tables of what is flown already; what the costs need is still compiled and counted
    #[arg(long)]
    pub(super) as_flown: bool,
}

fn parts() -> Vec<&'static str> {
    TABLES.iter().map(|table| table.name).chain(OTHER_PARTS).collect()
}

#[derive(Debug, ClapArgs)]
pub(super) struct TraceArgs {
    #[command(subcommand)]
    pub(super) verb: TraceVerb,
}

#[derive(Debug, Subcommand)]
pub(super) enum TraceVerb {
    /// Write the expectation of each trace anew
    Record {
        /// Trace files or folders; `traces` by default
        paths: Vec<PathBuf>,
    },
    /// Compare each trace with what every engine does now
    Check {
        /// Trace files or folders; `traces` by default
        paths: Vec<PathBuf>,
    },
}
