//! An auto-encoder that looks at the event frames: its spikes, and what it makes of them.

use std::path::Path;

use spikeloop::files;
use spikeloop::net::EemSan;
use spikeloop::nn::{Hsvae, HsvaeShape, Parameters, StateReader};
use spikeloop::policy::EventFrame;
use spikeloop::reference::FloatEncoder;
use spikeloop::report::tables::plain;
use spikeloop::train;
use spikeloop::world::dvs::picture::Panel;

use crate::cli::Failure;

/// Reconstructions are means of five frames over squares of pixels: dark, where few pixels spike.
const BRIGHTER: f32 = 4.0;

/// HSVAE as `spikeloop train hsvae` writes it: the encoder runs on events, the decoder on demand.
pub(super) struct Watcher {
    encoder: FloatEncoder,
    layers: Vec<String>,
    hsvae: Hsvae,
    parameters: Parameters,
    mean: Vec<f32>,
    deviation: Vec<f32>,
}

/// Spikes of one layer over the whole drive.
#[derive(serde::Serialize)]
pub(super) struct LayerActivity {
    layer: String,
    neurons: usize,
    spikes: u64,
    spikes_per_frame: f64,
    /// Share of neurons that spike in a frame.
    rate_percent: f64,
}

impl Watcher {
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let (file, bytes) = (path.display().to_string(), files::read_bytes(path)?);
        let encoder = EemSan::encoder_from_bytes(&file, &bytes)?;
        let (made_of, decoder) = train::config::made_of(encoder.kind);
        let shape = HsvaeShape {
            encoder: made_of,
            decoder,
            channels: encoder.layers.iter().map(|layer| layer.outputs).collect(),
            ..HsvaeShape::eem_san()
        };
        let hsvae = Hsvae::new(&shape);
        let mut parameters = Parameters::zeros(hsvae.layout());
        let tensors = StateReader::new(&file, &bytes)?;
        tensors.parameters("", &mut parameters)?;
        let latent = [shape.latent()];
        Ok(Self {
            encoder: FloatEncoder::new(&encoder),
            layers: encoder.layers.iter().map(|layer| layer.name.clone()).collect(),
            mean: tensors.floats("latent.mean", &latent)?,
            deviation: tensors.floats("latent.deviation", &latent)?,
            hsvae,
            parameters,
        })
    }

    /// A new episode.
    pub(super) fn reset(&mut self) {
        self.encoder.reset();
    }

    pub(super) fn look(&mut self, frame: &EventFrame) {
        self.encoder.step(frame);
    }

    /// The decoder's picture of the state now, in grey, [`BRIGHTER`] than it is.
    pub(super) fn reconstruction(&self) -> Panel {
        let scales = self.deviation.iter().zip(&self.mean);
        // The encoder gives `mu` with zero mean and unit deviation; the decoder takes it as it was.
        let state = self.encoder.state();
        let latent: Vec<f32> =
            state.iter().zip(scales).map(|(z, (deviation, mean))| z * deviation + mean).collect();
        let pixels = self.hsvae.decode(&self.parameters.values, &latent);
        let shade = |pixel: &f32| (255.0 * BRIGHTER * pixel).round().min(255.0) as u8;
        let shades: Vec<u8> = pixels.iter().map(shade).collect();
        Panel::of_shades(&shades)
    }

    pub(super) fn activity(&self) -> Vec<LayerActivity> {
        let frames = self.encoder.frames().max(1) as f64;
        let neurons = self.encoder.neurons();
        let layers = self.layers.iter().zip(neurons).zip(self.encoder.spikes());
        let activity = |((layer, neurons), spikes): ((&String, usize), &u64)| LayerActivity {
            layer: layer.clone(),
            neurons,
            spikes: *spikes,
            spikes_per_frame: *spikes as f64 / frames,
            rate_percent: 100.0 * *spikes as f64 / frames / neurons as f64,
        };
        layers.map(activity).collect()
    }
}

pub(super) fn activity_table(activity: &[LayerActivity]) -> String {
    let mut table = plain(&["encoder layer", "neurons", "spikes per frame", "rate % per frame"]);
    for layer in activity {
        table.add_row([
            layer.layer.clone(),
            layer.neurons.to_string(),
            format!("{:.1}", layer.spikes_per_frame),
            format!("{:.3}", layer.rate_percent),
        ]);
    }
    table.to_string()
}
