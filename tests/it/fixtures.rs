//! Things that several tests need.

use std::path::PathBuf;

use serde_json::Value;
use spikeloop::nn::{Actor, ActorShape, Form, Hsvae, HsvaeShape, Parameters, StateWriter};
use spikeloop::rng::Streams;

/// A file of other people's data, or `None` (said on standard output) where it is not there.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if !file.exists() {
        println!("skipped: needs ../shared/data/{path}");
        return None;
    }
    Some(file)
}

/// A JSON file.
pub(crate) fn json(path: &std::path::Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("readable")).expect("JSON")
}

/// Shape of [`eem_san`]'s auto-encoder: one channel, 128 pixels down to 2, so 4 latent numbers.
fn small_hsvae() -> HsvaeShape {
    HsvaeShape { channels: vec![1; 6], ..HsvaeShape::eem_san() }
}

/// Changes a tensor, by name: its shape and its elements.
pub(crate) type Change<'a> = &'a dyn Fn(&str, &mut Vec<usize>, &mut Vec<f32>);

/// A small untrained EEM-SAN (with `frames`) or laser-only network; `change` sees every tensor, and
/// one that it leaves without dimensions is left out.
pub(crate) fn eem_san(frames: bool, change: Change) -> Vec<u8> {
    network(Form::EEM_SAN, frames, change)
}

/// The same in another form.
pub(crate) fn network(form: Form, frames: bool, change: Change) -> Vec<u8> {
    let dvs = if frames { vec![(-3.0, 3.0); small_hsvae().latent()] } else { Vec::new() };
    let shape =
        ActorShape { form, dvs, population: 3, fused: 5, hidden: vec![7], ..ActorShape::eem_san() };
    let mut state = StateWriter::default();
    let actor = Actor::new(&shape).initial(&Streams::new(5, 0));
    add(&mut state, "actor.", &actor, change);
    if frames {
        add_hsvae(&mut state, "hsvae.", change);
    }
    state.bytes()
}

/// A small untrained auto-encoder as `train hsvae` writes it.
pub(crate) fn hsvae(change: Change) -> Vec<u8> {
    let mut state = StateWriter::default();
    add_hsvae(&mut state, "", change);
    state.bytes()
}

fn add_hsvae(state: &mut StateWriter, prefix: &str, change: Change) {
    let hsvae = Hsvae::new(&small_hsvae()).initial(&Streams::new(6, 0));
    add(state, prefix, &hsvae, change);
    for (name, shape, value) in
        [("threshold", 1, 0.05), ("latent.mean", 4, 0.1), ("latent.deviation", 4, 0.5)]
    {
        add_tensor(state, &format!("{prefix}{name}"), &[shape], &vec![value; shape], change);
    }
    // Left out, as in the files of HSVAE, unless `change` fills it.
    add_tensor(state, &format!("{prefix}kind"), &[], &[], change);
}

fn add(state: &mut StateWriter, prefix: &str, parameters: &Parameters, change: Change) {
    for (name, shape, values) in parameters.tensors() {
        add_tensor(state, &format!("{prefix}{name}"), shape, values, change);
    }
}

fn add_tensor(
    state: &mut StateWriter,
    name: &str,
    shape: &[usize],
    values: &[f32],
    change: Change,
) {
    let (mut shape, mut values) = (shape.to_vec(), values.to_vec());
    change(name, &mut shape, &mut values);
    if !shape.is_empty() {
        state.floats(name, &shape, &values);
    }
}
