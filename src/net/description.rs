//! Network description files (TOML) and the weights they point to (safetensors).

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::files::{self, NAME_LEN_MAX, fits_a_line, fits_a_word};
use crate::net::encoder::{RATE_INPUTS, RateEncoder};
use crate::net::error::NetError;
use crate::net::network::{Layer, Network, RELAY_NAMES};
use crate::net::tensors::{self, TensorReader};

/// Version of the description format.
const FORMAT: u32 = 1;
/// Outputs that the rate decoder needs: left and right wheel.
const RATE_OUTPUTS: usize = 2;
const NEURONS_MAX: usize = 1 << 20;
const STEPS_MAX: u32 = 1 << 12;
const LAYERS_MAX: usize = 256;

/// A description file as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    format: u32,
    name: String,
    weights: Option<PathBuf>,
    steps: u32,
    #[serde(default)]
    relay: bool,
    encoder: EncoderDescription,
    decoder: DecoderDescription,
    keep_current: f64,
    keep_voltage: f64,
    threshold: f64,
    layers: Vec<LayerDescription>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum EncoderDescription {
    Rate(RateEncoder),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum DecoderDescription {
    /// Spike count / T of two neurons: left wheel, right wheel.
    Rate {},
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct LayerDescription {
    name: String,
    neurons: usize,
    weight: String,
    bias: Option<String>,
    keep_current: Option<f64>,
    keep_voltage: Option<f64>,
    threshold: Option<f64>,
}

/// The weights file that a description names, where it can be read.
pub(super) fn named_weights(path: &Path) -> Option<PathBuf> {
    let text = crate::net::text_of(path).ok()?;
    let description = parse(&path.display().to_string(), &text).ok()?;
    Some(beside(path, &description.weights?))
}

/// A file that a description names, from where the description is.
fn beside(path: &Path, named: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(named)
}

/// Reads a description file and its weights; `weights` replaces the file that it names.
///
/// Errors: unreadable files, unknown keys, numbers out of range, tensors of another name, shape or
/// type, weights that are not finite.
pub fn read(path: &Path, weights: Option<&Path>) -> Result<Network, NetError> {
    let file = path.display().to_string();
    let text = crate::net::text_of(path)?;
    let description = parse(&file, &text)?;
    let named = description.weights.as_ref();
    let weights = match (weights, named) {
        (Some(given), _) => given.to_path_buf(),
        (None, Some(named)) => beside(path, named),
        (None, None) => return Err(NetError::NoWeights { file }),
    };
    let bytes = files::read_bytes(&weights)?;
    build(&file, description, &weights.display().to_string(), &bytes)
}

/// The same from memory: the text of a description and the bytes of its weights, with the names
/// that errors mention.
pub fn from_memory(
    file: &str,
    text: &str,
    weights_file: &str,
    weights: &[u8],
) -> Result<Network, NetError> {
    build(file, parse(file, text)?, weights_file, weights)
}

fn parse(file: &str, text: &str) -> Result<Description, NetError> {
    let description: Description = toml::from_str(text)
        .map_err(|e| NetError::Syntax { file: file.to_owned(), message: e.to_string() })?;
    check(file, &description)?;
    Ok(description)
}

fn check(file: &str, d: &Description) -> Result<(), NetError> {
    let value = |place: &str, what, value: String, limit: &str| NetError::Value {
        file: file.to_owned(),
        place: place.to_owned(),
        what,
        value,
        limit: limit.to_owned(),
    };
    if d.format != FORMAT {
        return Err(value("header", "format", d.format.to_string(), "1"));
    }
    if !(1..=STEPS_MAX).contains(&d.steps) {
        return Err(value("header", "steps", d.steps.to_string(), &format!("1..={STEPS_MAX}")));
    }
    if !fits_a_line(&d.name) {
        let limit = format!("1..={NAME_LEN_MAX} characters on one line");
        return Err(value("header", "name", format!("{:?}", d.name), &limit));
    }
    if d.layers.len() > LAYERS_MAX {
        return Err(value(
            "layers",
            "number",
            d.layers.len().to_string(),
            &format!("1..={LAYERS_MAX}"),
        ));
    }
    let EncoderDescription::Rate(encoder) = &d.encoder;
    for (what, scale) in encoder.scales() {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(value("encoder", what, scale.to_string(), "positive and finite"));
        }
    }
    for layer in &d.layers {
        if !fits_a_word(&layer.name) {
            let limit = format!("1..={NAME_LEN_MAX} visible ASCII characters, no blank and no ';'");
            return Err(value("layer", "name", format!("{:?}", layer.name), &limit));
        }
        if d.relay && RELAY_NAMES.contains(&layer.name.as_str()) {
            let limit = "another name (the relay neurons of `relay = true` have this one)";
            return Err(value("layer", "name", layer.name.clone(), limit));
        }
        if !(1..=NEURONS_MAX).contains(&layer.neurons) {
            let limit = format!("1..={NEURONS_MAX}");
            return Err(value(
                &format!("layer {}", layer.name),
                "neurons",
                layer.neurons.to_string(),
                &limit,
            ));
        }
        let keeps = [
            ("keep_current", layer.keep_current.unwrap_or(d.keep_current)),
            ("keep_voltage", layer.keep_voltage.unwrap_or(d.keep_voltage)),
        ];
        for (what, keep) in keeps {
            if !(0.0..=1.0).contains(&keep) {
                return Err(value(
                    &format!("layer {}", layer.name),
                    what,
                    keep.to_string(),
                    "in 0..=1",
                ));
            }
        }
        let threshold = layer.threshold.unwrap_or(d.threshold);
        if !(threshold > 0.0 && threshold.is_finite()) {
            let limit =
                "positive and finite (a chip threshold is unsigned); train it to stay above 0";
            return Err(value(
                &format!("layer {}", layer.name),
                "threshold",
                threshold.to_string(),
                limit,
            ));
        }
    }
    let outputs = d.layers.last().map_or(0, |layer| layer.neurons);
    if outputs != RATE_OUTPUTS {
        return Err(value("last layer", "neurons", outputs.to_string(), "2 for the rate decoder"));
    }
    Ok(())
}

fn build(
    file: &str,
    d: Description,
    weights_file: &str,
    weights: &[u8],
) -> Result<Network, NetError> {
    let tensors = tensors::open(weights_file, weights)?;
    let EncoderDescription::Rate(encoder) = d.encoder;
    let DecoderDescription::Rate {} = d.decoder;
    let mut inputs = RATE_INPUTS;
    let mut layers = Vec::with_capacity(d.layers.len());
    for layer in d.layers {
        let tensor = TensorReader { file: weights_file, layer: &layer.name, tensors: &tensors };
        layers.push(Layer {
            weights: tensor.read(&layer.weight, &[layer.neurons, inputs])?,
            bias: match &layer.bias {
                Some(bias) => tensor.read(bias, &[layer.neurons])?,
                None => vec![0.0; layer.neurons],
            },
            inputs,
            neurons: layer.neurons,
            keep_current: layer.keep_current.unwrap_or(d.keep_current),
            keep_voltage: layer.keep_voltage.unwrap_or(d.keep_voltage),
            threshold: layer.threshold.unwrap_or(d.threshold),
            name: layer.name,
        });
        inputs = layers.last().map_or(0, |layer: &Layer| layer.neurons);
    }
    let duplicate =
        layers.iter().enumerate().find(|(i, l)| layers[..*i].iter().any(|m| m.name == l.name));
    if let Some((_, layer)) = duplicate {
        return Err(NetError::Syntax {
            file: file.to_owned(),
            message: format!("two layers are called {}; give each a name of its own", layer.name),
        });
    }
    Ok(Network { name: d.name, steps: d.steps, encoder, relay: d.relay, layers })
}

#[cfg(test)]
#[path = "description_tests.rs"]
mod tests;
