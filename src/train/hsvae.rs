//! Training of the auto-encoder on what the camera sees in flight (Algorithm 2), HSVAE or one that
//! it is compared with.
//!
//! The paper drives first and learns from what was stored; here every stretch of frames is learned
//! from as soon as it was flown and then forgotten, which needs no storage and never repeats.

use std::ops::Range;

use crate::closed_loop::TrialConfig;
use crate::closed_loop::planner::{Knowledge, Terrain};
use crate::closed_loop::sighted::in_view;
use crate::nn::adam::AdamSettings;
use crate::nn::hsvae::{HsvaeLoss, HsvaeSettings, HsvaeTrainer, Sequences};
use crate::nn::shards::Shards;
use crate::nn::{Rectangular, StateError, StateReader, StateWriter};
use crate::policy::{Action, EventFrame, FRAME_COLUMNS, FRAME_PIXELS, FRAME_ROWS};
use crate::rng::{Streams, stream};
use crate::train::config::{HsvaeConfig, Shows, TrainConfigError};
use crate::train::flight::{Delays, Ends, Flight};
use crate::train::mover_picture::{self, Beyond};
use crate::train::{on_each, rooms};
use crate::world::World;

/// Parts of a batch whose gradients are summed; threads do not change the result.
const SHARDS: usize = 4;

/// Rooms of measurements count from here, far from those of training.
const MEASURE_ROUND: u64 = 1 << 40;

/// The auto-encoder in training.
#[derive(Debug, Clone)]
pub struct HsvaeTraining {
    config: HsvaeConfig,
    trial: TrialConfig,
    threads: usize,
    trainer: HsvaeTrainer,
    round: u64,
    history: Vec<[f32; 4]>,
    latent: Latent,
}

/// Mean and deviation of `mu` over flights.
#[derive(Debug, Clone, PartialEq)]
struct Latent {
    mean: Vec<f32>,
    deviation: Vec<f32>,
}

/// A stretch of frames.
struct Seen {
    /// [ticks * frames, samples, pixels].
    frames: Vec<f32>,
    /// What to show after every tick, [ticks, samples, pixels].
    targets: Vec<f32>,
    /// Samples whose flight ended.
    ended: Vec<usize>,
}

/// Mean squared errors per pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    /// Of the reconstruction from `mu`.
    pub reconstruction: f64,
    /// Of always saying the mean picture of these flights.
    pub mean: f64,
    /// Of repeating the picture before.
    pub previous: f64,
}

/// What a measurement on fresh flights found.
#[derive(Debug, Clone, PartialEq)]
pub struct HsvaeReport {
    /// Against what the decoder was trained to show.
    pub targets: Errors,
    /// Where it shows movers, the share of the variance that it explains by band of
    /// [`mover_picture::BANDS`]; `None` where there is no variance. Empty otherwise.
    pub explained: Vec<(&'static str, Option<f64>)>,
    /// The same of closing and of left less right, beyond what follows from nearness. Empty otherwise.
    pub beyond: Vec<(&'static str, Option<f64>)>,
    /// Against the last frame of every tick.
    pub frames_last: Errors,
    /// Spikes per neuron and frame of each encoder layer; of artificial ones the share of outputs
    /// above 0.
    pub rates: Vec<f64>,
    /// Frames measured.
    pub frames: usize,
}

impl HsvaeTraining {
    /// Fresh networks.
    ///
    /// Errors: settings of the flights out of their limits.
    pub fn new(config: &HsvaeConfig, threads: usize) -> Result<Self, TrainConfigError> {
        let settings = HsvaeSettings {
            adam: AdamSettings::with_rate(config.learning_rate),
            shards: Shards { count: SHARDS, threads },
        };
        let trainer = HsvaeTrainer::new(&settings, &config.shape(), &Streams::new(config.seed, 0));
        let n = trainer.layers().shape().latent();
        let latent = Latent { mean: vec![0.0; n], deviation: vec![1.0; n] };
        let trial = config.flight.trial("configuration", true)?;
        let (config, history) = (config.clone(), Vec::new());
        Ok(Self { config, trial, threads, trainer, round: 0, history, latent })
    }

    /// Rounds done.
    pub fn round(&self) -> u64 {
        self.round
    }

    /// Rounds in all.
    pub fn rounds(&self) -> u64 {
        self.config.rounds
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.trainer.updates()
    }

    /// For every round: means of reconstruction, divergence and rate term, and flights' success.
    pub fn history(&self) -> &[[f32; 4]] {
        &self.history
    }

    /// One round; `updated` is called after every update.
    pub fn run_round(&mut self, mut updated: impl FnMut()) -> Ends {
        let stretches = self.config.updates_per_round();
        let (mut sum, mut ends) = (HsvaeLoss::default(), Ends::default());
        let worlds = self.worlds(self.round);
        let mut flights = self.flights(&worlds, self.round);
        let mut state = self.trainer.layers().rest(flights.len());
        let streams = Streams::new(self.config.seed, 1);
        for stretch in 0..stretches {
            let ticks = self.config.stretch_ticks;
            let seen = self.fly(&mut flights, stretch * ticks as u64, ticks);
            let batch =
                Sequences { samples: flights.len(), frames: &seen.frames, targets: &seen.targets };
            self.trainer.set_learning_rate(self.config.learning_rate_after(self.updates()));
            let loss = self.trainer.update(&batch, &mut state, &streams);
            seen.ended.iter().for_each(|sample| state.clear(*sample, flights.len()));
            sum.reconstruction += loss.reconstruction;
            sum.divergence += loss.divergence;
            sum.rate += loss.rate;
            updated();
        }
        flights.iter().for_each(|flight| ends.add(&flight.ends));
        let mean = |sum: f64| (sum / stretches.max(1) as f64) as f32;
        let success = ends.goal as f32 / ends.total().max(1) as f32;
        let row = [mean(sum.reconstruction), mean(sum.divergence), mean(sum.rate), success];
        self.history.push(row);
        self.round += 1;
        ends
    }

    /// Flies some ticks in rooms that training never sees, and looks how well frames come back.
    /// Mean and deviation of the latent vector are kept for [`HsvaeTraining::weights`].
    pub fn measure(&mut self, ticks: u64) -> HsvaeReport {
        let worlds = self.worlds(MEASURE_ROUND);
        let mut flights = self.flights(&worlds, MEASURE_ROUND);
        let layers = self.trainer.layers().clone();
        let (samples, frames_per_tick) = (flights.len(), layers.shape().frames);
        let mut state = layers.rest(samples);
        let mut sums = Sums::new(layers.shape().latent());
        let movers = self.config.shows == Shows::Movers;
        let step = samples * FRAME_PIXELS;
        let mut target_before: Option<Vec<f32>> = None;
        for tick in 0..ticks {
            let seen = self.fly(&mut flights, tick, 1);
            let values = &self.trainer.parameters.values;
            let trace = layers.encode::<Rectangular>(values, &seen.frames, &mut state);
            let made = layers.decode(values, &trace.mean);
            let last = (frames_per_tick - 1) * step;
            if let Some(before) = target_before.replace(seen.targets.clone()) {
                sums.targets.add(&made, &seen.targets, &before);
                if movers {
                    sums.add_movers(&made, &seen.targets);
                }
                sums.frames.add(&made, &seen.frames[last..], &seen.frames[last - step..last]);
            }
            sums.add(&trace.mean, &trace.rates());
            seen.ended.iter().for_each(|sample| state.clear(*sample, samples));
        }
        let (report, latent) = sums.finish(self.config.shows);
        self.latent = latent;
        report
    }

    fn worlds(&self, round: u64) -> Vec<(World, Terrain)> {
        let n = self.config.flight.worlds as u64;
        let streams = Streams::new(self.config.seed, 0);
        rooms::places(&self.config.rooms, &streams, round * n, n, self.threads)
    }

    fn flights<'w>(&self, worlds: &'w [(World, Terrain)], round: u64) -> Vec<Flight<'w>> {
        let n = worlds.len() as u64;
        let distance_m = self.config.rooms.distance_m_min;
        let flight = |(index, (world, terrain)): (usize, &'w (World, Terrain))| {
            let streams = Streams::new(self.config.seed, (1 << 32) + round * n + index as u64);
            let drive = (&self.trial, Knowledge::Everything);
            let sight = (None, Delays::default());
            Flight::new((world, terrain), drive, distance_m, sight, streams)
        };
        worlds.iter().enumerate().map(flight).collect()
    }

    /// Flies a stretch. A flight that ends within it is followed by the next one, which keeps the
    /// state of the encoder until the end of the stretch. The blank frames before a flight's first tick are not
    /// shown.
    fn fly(&self, flights: &mut [Flight<'_>], first_tick: u64, ticks: usize) -> Seen {
        let samples = flights.len();
        let per_tick = self.trainer.layers().shape().frames;
        let mut frames = vec![0.0; ticks * per_tick * samples * FRAME_PIXELS];
        let mut targets = Vec::with_capacity(ticks * samples * FRAME_PIXELS);
        let before: Vec<usize> = flights.iter().map(Flight::number).collect();
        for tick in 0..ticks {
            on_each(flights, self.threads, |flight| {
                explore(flight, first_tick + tick as u64, self.config.exploration);
            });
            for (sample, flight) in flights.iter().enumerate() {
                for (index, frame) in flight.frames.iter().take(per_tick).enumerate() {
                    let row = (tick * per_tick + index) * samples + sample;
                    fill(frame, &mut frames[row * FRAME_PIXELS..(row + 1) * FRAME_PIXELS]);
                }
            }
            match self.config.shows {
                Shows::Frames => {
                    let first = tick * per_tick * samples * FRAME_PIXELS;
                    let seen = &frames[first..first + per_tick * samples * FRAME_PIXELS];
                    targets.extend(self.targets(seen, samples));
                }
                // After a flight that ended, the start of the next one.
                Shows::Movers => {
                    let mut picture = [0.0; FRAME_PIXELS];
                    for flight in flights.iter() {
                        mover_picture::draw(in_view(flight.trial()), &mut picture);
                        targets.extend(picture);
                    }
                }
            }
        }
        let ended = (0..samples).filter(|sample| flights[*sample].number() != before[*sample]);
        Seen { ended: ended.collect(), frames, targets }
    }

    /// What the decoder should show after a tick, [samples, pixels]: the last frame, or the mean
    /// of the tick's frames, blurred.
    fn targets(&self, frames: &[f32], samples: usize) -> Vec<f32> {
        let step = samples * FRAME_PIXELS;
        let width = self.config.blur_px;
        if width <= 1 {
            return frames[frames.len() - step..].to_vec();
        }
        let mut mean = vec![0.0f32; step];
        let share = step as f32 / frames.len() as f32;
        for frame in frames.chunks_exact(step) {
            mean.iter_mut().zip(frame).for_each(|(sum, pixel)| *sum += share * pixel);
        }
        mean.chunks_exact_mut(FRAME_PIXELS).for_each(|image| blur(image, width));
        mean
    }

    /// Adds everything that the next round depends on.
    pub fn write(&self, state: &mut StateWriter) {
        self.trainer.write(state);
        state.count("round", self.round);
        let rows: Vec<f32> = self.history.iter().flatten().copied().collect();
        state.floats("history", &[self.history.len(), 4], &rows);
    }

    /// Takes over what [`HsvaeTraining::write`] wrote.
    ///
    /// Errors: a tensor is missing or has another shape.
    pub fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let round = state.count("round")?;
        let rows = state.floats("history", &[round as usize, 4])?;
        self.trainer.read(state)?;
        self.round = round;
        self.history = rows.chunks_exact(4).map(|r| [r[0], r[1], r[2], r[3]]).collect();
        Ok(())
    }

    /// The weights, for [`crate::net::EemSan::encoder_from_bytes`]. Call
    /// [`HsvaeTraining::measure`] before.
    pub fn weights(&self) -> Vec<u8> {
        let mut state = StateWriter::default();
        state.parameters("", &self.trainer.parameters);
        let n = self.latent.mean.len();
        state.floats("latent.mean", &[n], &self.latent.mean);
        state.floats("latent.deviation", &[n], &self.latent.deviation);
        if let Some(number) = self.config.kind.number() {
            state.floats("kind", &[1], &[number]);
        }
        if self.config.kind.spikes() {
            state.floats("threshold", &[1], &[self.trainer.layers().shape().threshold]);
        }
        state.bytes()
    }
}

/// The planner drives, with noise in its hand.
fn explore(flight: &mut Flight<'_>, tick: u64, exploration: f64) {
    let mut draw = flight.streams().at(stream::EXPLORATION, (1 << 32) + tick);
    let planned = flight.planned();
    let mut mix =
        |a: f64| (draw.gaussian() * exploration + (1.0 - exploration) * a).clamp(0.0, 1.0);
    flight.drive(Action { left: mix(planned.left), right: mix(planned.right) });
}

/// Means over squares of `width` pixels, first along rows, then along columns; outside is dark.
fn blur(image: &mut [f32], width: usize) {
    let side = FRAME_COLUMNS;
    let reach = width / 2;
    for stride in [1, side] {
        for line in 0..side {
            let first = if stride == 1 { line * side } else { line };
            let old: Vec<f32> = (0..side).map(|n| image[first + n * stride]).collect();
            for n in 0..side {
                let near = &old[n.saturating_sub(reach)..(n + reach + 1).min(side)];
                image[first + n * stride] = near.iter().sum::<f32>() / (2 * reach + 1) as f32;
            }
        }
    }
}

fn fill(frame: &EventFrame, pixels: &mut [f32]) {
    frame.active().for_each(|pixel| pixels[pixel] = 1.0);
}

/// Sums of squared errors.
struct ErrorSums {
    /// Of what was made, row by row.
    made: Vec<f64>,
    before: f64,
    pixel: Vec<[f64; 2]>,
    pictures: usize,
}

impl ErrorSums {
    fn new() -> Self {
        let pixel = vec![[0.0; 2]; FRAME_PIXELS];
        Self { made: vec![0.0; FRAME_ROWS], before: 0.0, pixel, pictures: 0 }
    }

    fn add(&mut self, made: &[f32], wanted: &[f32], before: &[f32]) {
        let square = |a: &[f32], b: &[f32]| -> f64 {
            a.iter().zip(b).map(|(a, b)| f64::from((a - b) * (a - b))).sum()
        };
        let rows = made.chunks_exact(FRAME_COLUMNS).zip(wanted.chunks_exact(FRAME_COLUMNS));
        for (sum, (made, wanted)) in (0..FRAME_ROWS).cycle().zip(rows) {
            self.made[sum] += square(made, wanted);
        }
        self.before += square(before, wanted);
        for picture in wanted.chunks_exact(FRAME_PIXELS) {
            for ([sum, squares], pixel) in self.pixel.iter_mut().zip(picture) {
                *sum += f64::from(*pixel);
                *squares += f64::from(pixel * pixel);
            }
            self.pictures += 1;
        }
    }

    fn finish(&self) -> Errors {
        let pixels = (self.pictures.max(1) * FRAME_PIXELS) as f64;
        Errors {
            reconstruction: self.made.iter().sum::<f64>() / pixels,
            mean: self.square_of_mean(0..FRAME_ROWS) / pixels,
            previous: self.before / pixels,
        }
    }

    /// Sum of the squared errors of the mean picture in these rows.
    fn square_of_mean(&self, rows: Range<usize>) -> f64 {
        let n = self.pictures.max(1) as f64;
        let pixels = rows.start * FRAME_COLUMNS..rows.end * FRAME_COLUMNS;
        self.pixel[pixels].iter().map(|[sum, squares]| squares - sum * (sum / n)).sum()
    }

    /// Share of the variance of these rows that what was made explains.
    fn explained(&self, rows: Range<usize>) -> Option<f64> {
        let all = self.square_of_mean(rows.clone());
        (all > 0.0).then(|| 1.0 - self.made[rows].iter().sum::<f64>() / all)
    }
}

/// Sums over a measurement.
struct Sums {
    targets: ErrorSums,
    frames: ErrorSums,
    beyond: Beyond,
    latent: Vec<[f64; 2]>,
    latents: usize,
    rates: Vec<f64>,
    ticks: usize,
}

impl Sums {
    fn new(latent: usize) -> Self {
        Self {
            targets: ErrorSums::new(),
            frames: ErrorSums::new(),
            beyond: Beyond::default(),
            latent: vec![[0.0; 2]; latent],
            latents: 0,
            rates: Vec::new(),
            ticks: 0,
        }
    }

    fn add(&mut self, mean: &[f32], rates: &[f64]) {
        for row in mean.chunks_exact(self.latent.len()) {
            for ([sum, squares], value) in self.latent.iter_mut().zip(row) {
                *sum += f64::from(*value);
                *squares += f64::from(value * value);
            }
            self.latents += 1;
        }
        self.rates.resize(rates.len(), 0.0);
        self.rates.iter_mut().zip(rates).for_each(|(sum, rate)| *sum += rate);
        self.ticks += 1;
    }

    fn add_movers(&mut self, made: &[f32], wanted: &[f32]) {
        let pictures = made.chunks_exact(FRAME_PIXELS).zip(wanted.chunks_exact(FRAME_PIXELS));
        pictures.for_each(|(made, wanted)| self.beyond.add(made, wanted));
    }

    fn finish(self, shows: Shows) -> (HsvaeReport, Latent) {
        let n = self.latents.max(1) as f64;
        let mean: Vec<f64> = self.latent.iter().map(|[sum, _]| sum / n).collect();
        let deviation = self.latent.iter().zip(&mean).map(|([_, squares], mean)| {
            (squares / n - mean * mean).max(0.0).sqrt().max(1e-3) as f32
        });
        let latent = Latent {
            deviation: deviation.collect(),
            mean: mean.iter().map(|mean| *mean as f32).collect(),
        };
        let explained = |(name, rows): &(&'static str, Range<usize>)| {
            (*name, self.targets.explained(rows.clone()))
        };
        let (bands, beyond) = match shows {
            Shows::Frames => (&[][..], Vec::new()),
            Shows::Movers => (&mover_picture::BANDS[..], self.beyond.explained().to_vec()),
        };
        let report = HsvaeReport {
            targets: self.targets.finish(),
            explained: bands.iter().map(explained).collect(),
            beyond,
            frames_last: self.frames.finish(),
            rates: self.rates.iter().map(|sum| sum / self.ticks.max(1) as f64).collect(),
            frames: self.frames.pictures,
        };
        (report, latent)
    }
}
