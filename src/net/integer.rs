//! Networks that are integer from the start: a JSON file and an npz file of the same name.
//!
//! Weights are mantissas of 8-bit mixed sign mode, thresholds are mantissas, decays are per 4096.
//!
//! A projection of kind `dense` has weights `[sources, targets]`. One of kind `conv2d` has
//! `in_shape` and `out_shape` as `[channels, height, width]`, `kernel`, `stride`, `pad`, and
//! weights `[output channels, input channels, kernel, kernel]`. Projections of equal weights onto
//! one population share them on the chip.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::files::{NAME_LEN_MAX, fits_a_line, fits_a_word};
use crate::net::conv2d::{Conv2d, Shape};
use crate::net::error::NetError;
use crate::npz::{IntArray, Npz};

const NEURONS_MAX: usize = 1 << 20;
/// Largest decay: everything is lost in each step.
const DECAY_MAX: u32 = 4096;

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

/// Synapses onto a population.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerProjection {
    /// Indices of the source populations, of equal size; spikes of any of them go through the
    /// same weights.
    pub sources: Vec<usize>,
    /// Index of the target population, a LIF one.
    pub target: usize,
    /// The weights.
    pub weights: Mantissas,
}

/// Weights of a projection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mantissas {
    /// From source `i` to target `n`: `[i * targets + n]`.
    Dense(Vec<i16>),
    /// A kernel, row-major by output channel, input channel, row, column.
    Conv(Conv2d, Vec<i16>),
}

impl Mantissas {
    /// The stored weights, each once.
    pub fn values(&self) -> &[i16] {
        match self {
            Self::Dense(values) | Self::Conv(_, values) => values,
        }
    }
}

/// Keys that were not asked for.
type Rest = BTreeMap<String, IgnoredAny>;

#[derive(Debug, Deserialize)]
struct FileForm {
    name: String,
    delta_u: u16,
    delta_v: u16,
    populations: Vec<PopulationForm>,
    projections: Vec<ProjectionForm>,
    #[serde(flatten)]
    rest: Rest,
}

impl FileForm {
    /// How it was made and what it is to be run with: notes that mean nothing here.
    const NOTES: &[&str] = &["source", "note", "seed", "steps", "input_p"];
}

#[derive(Debug, Deserialize)]
struct PopulationForm {
    name: String,
    n: usize,
    kind: String,
    vth_mant: Option<u32>,
    #[serde(default)]
    bias: i64,
    #[serde(flatten)]
    rest: Rest,
}

impl PopulationForm {
    const NOTES: &[&str] = &["note", "shape"];
}

#[derive(Debug, Deserialize)]
struct ProjectionForm {
    name: String,
    src: String,
    dst: String,
    kind: String,
    w: String,
    in_shape: Option<[usize; 3]>,
    out_shape: Option<[usize; 3]>,
    kernel: Option<usize>,
    stride: Option<usize>,
    pad: Option<usize>,
    #[serde(flatten)]
    rest: Rest,
}

impl ProjectionForm {
    const NOTES: &[&str] = &["note", "layout"];
}

/// Reads a network; `weights` replaces the npz file beside the description.
///
/// Errors: unreadable files, unknown kinds, names without a population, arrays of another shape.
pub fn read(path: &Path, weights: Option<&Path>) -> Result<IntegerNet, NetError> {
    let text = crate::net::text_of(path)?;
    let file = path.display().to_string();
    // A file of another kind has no weights beside it, and that is not what is wrong with it.
    let form = form_of(&file, &text)?;
    let weights = weights.map_or_else(|| path.with_extension("npz"), Path::to_path_buf);
    let mut npz = Npz::open(&weights)?;
    from_form([&file, &weights.display().to_string()], form, &mut npz)
}

/// The same from memory; `file` is the name that errors mention.
pub fn from_parts(file: &str, text: &str, npz: &mut Npz) -> Result<IntegerNet, NetError> {
    from_form([file, file], form_of(file, text)?, npz)
}

fn form_of(file: &str, text: &str) -> Result<FileForm, NetError> {
    let syntax = |message: String| NetError::Syntax { file: file.to_owned(), message };
    let form: FileForm = serde_json::from_str(text).map_err(|e| syntax(e.to_string()))?;
    check_keys(&form).map_err(syntax)?;
    check_names(&form).map_err(syntax)?;
    for (key, decay) in [("delta_u", form.delta_u), ("delta_v", form.delta_v)] {
        if u32::from(decay) > DECAY_MAX {
            return Err(syntax(format!("{key} = {decay}, must be 0..={DECAY_MAX}")));
        }
    }
    Ok(form)
}

/// Errors name the description and the file of the weights.
fn from_form(
    [file, weights_file]: [&str; 2],
    form: FileForm,
    npz: &mut Npz,
) -> Result<IntegerNet, NetError> {
    let syntax = |message: String| NetError::Syntax { file: file.to_owned(), message };
    let populations: Vec<_> =
        form.populations.iter().map(|p| population(file, p)).collect::<Result<_, _>>()?;
    let named = |name: &str| {
        let found = populations.iter().position(|p| p.name == name);
        found.ok_or_else(|| syntax(format!("no population is called {name}")))
    };
    let mut projections: Vec<IntegerProjection> = Vec::with_capacity(form.projections.len());
    let mut names: Vec<&ProjectionForm> = Vec::with_capacity(form.projections.len());
    for p in &form.projections {
        let (source, target) = (named(&p.src)?, named(&p.dst)?);
        let wrong = |problem: String| syntax(format!("projection {}: {problem}", p.name));
        if populations[target].threshold_mantissa.is_none() {
            return Err(wrong(format!("{} is an input, it has no synapses", p.dst)));
        }
        let sizes = [populations[source].neurons, populations[target].neurons];
        let conv = convolution(p, sizes).map_err(wrong)?;
        // The same weights onto the same target are stored once.
        let known = names.iter().zip(&mut projections).find(|(name, known)| {
            name.w == p.w
                && known.target == target
                && populations[known.sources[0]].neurons == sizes[0]
                && match known.weights {
                    Mantissas::Dense(_) => conv.is_none(),
                    Mantissas::Conv(there, _) => conv == Some(there),
                }
        });
        if let Some((first, known)) = known {
            if known.sources.contains(&source) {
                let (from, onto, weights) = (&p.src, &p.dst, &p.w);
                return Err(wrong(format!(
                    "from {from} onto {onto} with weights {weights}, as projection {}; leave one out, \
                     or give the sum of both",
                    first.name
                )));
            }
            known.sources.push(source);
            continue;
        }
        let shape = match &conv {
            None => sizes.map(|n| n as u64).to_vec(),
            Some(conv) => conv.weights_shape().map(|n| n as u64).to_vec(),
        };
        let values = weights_of(weights_file, p, npz.ints(&p.w)?, &shape)?;
        let weights = match conv {
            None => Mantissas::Dense(values),
            Some(conv) => Mantissas::Conv(conv, values),
        };
        projections.push(IntegerProjection { sources: vec![source], target, weights });
        names.push(p);
    }
    Ok(IntegerNet {
        name: form.name,
        decay_current: form.delta_u,
        decay_voltage: form.delta_v,
        populations,
        projections,
    })
}

/// Errs for a key that nothing reads, so that a misspelt one cannot be lost.
fn check_keys(form: &FileForm) -> Result<(), String> {
    let populations = form.populations.iter().map(|p| ("population", &p.name, &p.rest));
    let populations = populations
        .map(|(what, name, rest)| (format!("{what} {name:?}"), rest, PopulationForm::NOTES));
    let projections = form
        .projections
        .iter()
        .map(|p| (format!("projection {:?}", p.name), &p.rest, ProjectionForm::NOTES));
    let file = std::iter::once(("the file".to_owned(), &form.rest, FileForm::NOTES));
    for (place, rest, notes) in file.chain(populations).chain(projections) {
        if let Some(key) = rest.keys().find(|key| !notes.contains(&key.as_str())) {
            return Err(format!("{place}: unknown key {key:?}; correct or remove it"));
        }
    }
    Ok(())
}

/// Errs for names that tables and pictures could not show, and for populations of one name.
fn check_names(form: &FileForm) -> Result<(), String> {
    let populations = form.populations.iter().map(|p| ("population", &p.name));
    let projections = form.projections.iter().map(|p| ("projection", &p.name));
    for (what, name) in [("the file", &form.name)].into_iter().chain(populations).chain(projections)
    {
        if !fits_a_line(name) {
            return Err(format!(
                "{what}: name {name:?}, must be 1..={NAME_LEN_MAX} characters on one line"
            ));
        }
    }
    if let Some(population) = form.populations.iter().find(|p| !fits_a_word(&p.name)) {
        return Err(format!(
            "population {:?}: must be of visible ASCII characters without ';', as it names cores; \
             rename it",
            population.name
        ));
    }
    for (index, population) in form.populations.iter().enumerate() {
        if form.populations[..index].iter().any(|other| other.name == population.name) {
            return Err(format!(
                "population {:?}: name given twice; projections could mean either",
                population.name
            ));
        }
    }
    Ok(())
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
        ("lif", Some(0)) => {
            return Err(syntax(format!(
                "population {}: vth_mant = 0, must be 1 or more",
                form.name
            )));
        }
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

/// The convolution of a projection between populations of `sizes`, or `None` when it has none.
///
/// Errors, in words: another kind, a missing number, shapes that do not go together.
fn convolution(form: &ProjectionForm, sizes: [usize; 2]) -> Result<Option<Conv2d>, String> {
    match form.kind.as_str() {
        "dense" => return Ok(None),
        "conv2d" => {}
        kind => return Err(format!("kind {kind} found, dense or conv2d expected")),
    }
    let missing = |key: &str| format!("{key} is missing, a conv2d has it");
    let shape = |name: &str, shape: Option<[usize; 3]>| match shape {
        Some([channels, height, width]) => Ok(Shape { channels, height, width }),
        None => Err(missing(name)),
    };
    let (input, output) = (shape("in_shape", form.in_shape)?, shape("out_shape", form.out_shape)?);
    let kernel = form.kernel.ok_or_else(|| missing("kernel"))?;
    let stride = form.stride.ok_or_else(|| missing("stride"))?;
    let pad = form.pad.ok_or_else(|| missing("pad"))?;
    for (key, size) in [("kernel", kernel), ("stride", stride)] {
        if size == 0 {
            return Err(format!("{key} = 0, must be 1 or more"));
        }
    }
    let conv = Conv2d::new(input, output.channels, [kernel, kernel], stride, pad)?;
    if conv.output() != output {
        return Err(format!("out_shape {output}, but the convolution gives {}", conv.output()));
    }
    let named =
        [("in_shape", input, &form.src, sizes[0]), ("out_shape", output, &form.dst, sizes[1])];
    for (key, shape, population, neurons) in named {
        if shape.neurons() != neurons {
            let has = shape.neurons();
            return Err(format!("{key} {shape} is {has} neurons, but {population} has {neurons}"));
        }
    }
    Ok(Some(conv))
}

fn weights_of(
    file: &str,
    form: &ProjectionForm,
    array: IntArray,
    shape: &[u64],
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
