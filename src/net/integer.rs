//! Networks that are integer from the start: a JSON file and an npz file of the same name.
//!
//! Weights are mantissas of 8-bit mixed sign mode, thresholds are mantissas, decays are per 4096.

use std::path::Path;

use serde::Deserialize;

use crate::net::error::NetError;
use crate::npz::{IntArray, Npz};

const NEURONS_MAX: usize = 1 << 20;

/// An integer network, checked for consistency of its parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerNet {
    /// Name.
    pub name: String,
    /// Effective decay of the current per 4096.
    pub decay_current: u16,
    /// Effective decay of the voltage per 4096.
    pub decay_voltage: u16,
    /// Populations in file order.
    pub populations: Vec<IntegerPopulation>,
    /// Projections in file order.
    pub projections: Vec<IntegerProjection>,
}

/// Input lines or LIF neurons.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerPopulation {
    /// Name.
    pub name: String,
    /// Number of neurons or lines.
    pub neurons: usize,
    /// Threshold mantissa; `None` for an input.
    pub threshold_mantissa: Option<u32>,
}

/// All synapses between two populations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerProjection {
    /// Index of the source population.
    pub source: usize,
    /// Index of the target population, a LIF one.
    pub target: usize,
    /// Weight from source `i` to target `n` is `weights[i * targets + n]`.
    pub weights: Vec<i16>,
}

#[derive(Debug, Deserialize)]
struct FileForm {
    name: String,
    delta_u: u16,
    delta_v: u16,
    populations: Vec<PopulationForm>,
    projections: Vec<ProjectionForm>,
}

#[derive(Debug, Deserialize)]
struct PopulationForm {
    name: String,
    n: usize,
    kind: String,
    vth_mant: Option<u32>,
    #[serde(default)]
    bias: i64,
}

#[derive(Debug, Deserialize)]
struct ProjectionForm {
    name: String,
    src: String,
    dst: String,
    kind: String,
    w: String,
}

/// Reads a network; `weights` replaces the npz file beside the description.
///
/// Errors: unreadable files, unknown kinds, names without a population, arrays of another shape.
pub fn read(path: &Path, weights: Option<&Path>) -> Result<IntegerNet, NetError> {
    let text = crate::net::text_of(path)?;
    let weights = weights.map_or_else(|| path.with_extension("npz"), Path::to_path_buf);
    let mut npz = Npz::open(&weights)?;
    from_parts(&path.display().to_string(), &text, &mut npz)
}

/// The same from memory; `file` is the name that errors mention.
pub fn from_parts(file: &str, text: &str, npz: &mut Npz) -> Result<IntegerNet, NetError> {
    let syntax = |message: String| NetError::Syntax { file: file.to_owned(), message };
    let form: FileForm = serde_json::from_str(text).map_err(|e| syntax(e.to_string()))?;
    let populations: Vec<_> =
        form.populations.iter().map(|p| population(file, p)).collect::<Result<_, _>>()?;
    let named = |name: &str| {
        let found = populations.iter().position(|p| p.name == name);
        found.ok_or_else(|| syntax(format!("no population is called {name}")))
    };
    let mut projections = Vec::with_capacity(form.projections.len());
    for p in &form.projections {
        let (source, target) = (named(&p.src)?, named(&p.dst)?);
        if p.kind != "dense" {
            return Err(syntax(format!(
                "projection {}: kind {} found, dense expected; shared convolution kernels are not compiled yet",
                p.name, p.kind
            )));
        }
        if populations[target].threshold_mantissa.is_none() {
            return Err(syntax(format!(
                "projection {}: {} is an input, it has no synapses",
                p.name, p.dst
            )));
        }
        let shape = [populations[source].neurons as u64, populations[target].neurons as u64];
        let weights = dense_weights(file, p, npz.ints(&p.w)?, shape)?;
        projections.push(IntegerProjection { source, target, weights });
    }
    Ok(IntegerNet {
        name: form.name,
        decay_current: form.delta_u,
        decay_voltage: form.delta_v,
        populations,
        projections,
    })
}

fn population(file: &str, form: &PopulationForm) -> Result<IntegerPopulation, NetError> {
    let syntax = |message: String| NetError::Syntax { file: file.to_owned(), message };
    if !(1..=NEURONS_MAX).contains(&form.n) {
        return Err(syntax(format!(
            "population {}: n = {}, must be 1..={NEURONS_MAX}",
            form.name, form.n
        )));
    }
    if form.bias != 0 {
        return Err(syntax(format!(
            "population {}: bias = {}, only 0 is supported",
            form.name, form.bias
        )));
    }
    let threshold_mantissa = match (form.kind.as_str(), form.vth_mant) {
        ("input", _) => None,
        ("lif", Some(threshold)) => Some(threshold),
        ("lif", None) => {
            return Err(syntax(format!("population {}: vth_mant is missing", form.name)));
        }
        (kind, _) => {
            let message =
                format!("population {}: kind {kind} found, input or lif expected", form.name);
            return Err(syntax(message));
        }
    };
    Ok(IntegerPopulation { name: form.name.clone(), neurons: form.n, threshold_mantissa })
}

fn dense_weights(
    file: &str,
    form: &ProjectionForm,
    array: IntArray,
    shape: [u64; 2],
) -> Result<Vec<i16>, NetError> {
    let error = |found: String, expected: String| NetError::Tensor {
        file: file.to_owned(),
        layer: form.dst.clone(),
        tensor: form.w.clone(),
        found,
        expected,
    };
    if array.shape != shape {
        return Err(error(format!("shape {:?}", array.shape), format!("shape {shape:?}")));
    }
    let narrow = |value: &i64| {
        let mantissa =
            i16::try_from(*value).ok().filter(|m| (-256..=254).contains(m) && m % 2 == 0);
        mantissa.ok_or_else(|| {
            error(format!("weight {value}"), "even mantissas in -256..=254".to_owned())
        })
    };
    array.values.iter().map(narrow).collect()
}
