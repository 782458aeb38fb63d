//! From what was typed to what drives.

use std::path::Path;

use hw_model::ChipSpec;
use spikeloop::closed_loop::planner::Knowledge;
use spikeloop::compile::{Policy, Split};
use spikeloop::evaluate::{Driver, EngineKind};
use spikeloop::host::{Deployment, Schedule};
use spikeloop::net::weight_fault::WeightFault;
use spikeloop::net::{Controller, NetError, builtin};
use spikeloop::report::reproduction::ON_CHIP;
use spikeloop::world::dvs::{CAMERA_DEG, FIELD_OF_VIEW_DEG};

use crate::cli::Failure;
use crate::cli::compile::{POLICY_DEFAULT, refused};

/// Name of the driver that needs no network.
pub(super) const STRAIGHT: &str = "straight";
/// Names of the planner, by what it knows.
const PLANNERS: [(&str, Knowledge); 3] = [
    ("planner", Knowledge::Everything),
    (PLANNER_CAMERA, Knowledge::Camera { field_of_view_deg: CAMERA_DEG }),
    ("planner-laser", Knowledge::Laser),
];
/// The one that may have another lens, `:` and its field of view behind the name.
const PLANNER_CAMERA: &str = "planner-camera";

/// A driver for each name: core maps (chip), networks of any kind (float, or with `chip:` before
/// the name compiled), `straight`, planners.
/// `weights` are for the networks that take some.
pub(super) fn drivers(
    names: &[String],
    weights: Option<&Path>,
    engine: EngineKind,
) -> Result<Vec<Driver>, Failure> {
    check_weights(names, weights)?;
    let drivers = names.iter().map(|name| driver(name, weights, engine));
    let mut drivers = drivers.collect::<Result<Vec<Driver>, Failure>>()?;
    tell_apart(&mut drivers, names);
    Ok(drivers)
}

/// Adds what was typed to labels that several of the drivers have.
fn tell_apart(drivers: &mut [Driver], names: &[String]) {
    let labels: Vec<String> = drivers.iter().map(|driver| driver.label.clone()).collect();
    for (driver, name) in drivers.iter_mut().zip(names) {
        if labels.iter().filter(|label| **label == driver.label).count() > 1 {
            driver.label = format!("{}, {name}", driver.label);
        }
    }
}

/// Errs for weights that none of the drivers takes.
pub(super) fn check_weights(
    names: &[impl AsRef<str>],
    weights: Option<&Path>,
) -> Result<(), Failure> {
    let takes = |name: &str| is_network(name) && builtin::takes_weights(network_of(name));
    match weights {
        Some(weights) if !names.iter().any(|name| takes(name.as_ref())) => Err(format!(
            "{}: weights are for networks with a description, and there is none; leave --weights \
             out",
            weights.display()
        )
        .into()),
        _ => Ok(()),
    }
}

/// The driver of this name with degraded weights, drawn with `seed`.
///
/// Errors: a name that is not a network's.
pub(super) fn degraded_driver(
    name: &str,
    weights: Option<&Path>,
    fault: WeightFault,
    seed: u64,
) -> Result<Driver, Failure> {
    if !is_network(name) {
        return Err(format!(
            "{name}: only the weights of a network can be degraded; leave it out, or give a core \
             map's network with {ON_CHIP} before its name"
        )
        .into());
    }
    network_driver(name, weights, EngineKind::Event, |network| fault.apply(&network, seed))
}

/// The network of this name, changed by `change`, in floats or compiled.
fn network_driver(
    name: &str,
    weights: Option<&Path>,
    engine: EngineKind,
    change: impl FnOnce(Controller) -> Controller,
) -> Result<Driver, Failure> {
    let network = network_of(name);
    let weights = weights.filter(|_| builtin::takes_weights(network));
    let controller = change(builtin::open(network, weights)?);
    if network == name {
        return Ok(Driver::controller(&controller));
    }
    let policy = Policy::named(POLICY_DEFAULT)?;
    let (chip, schedule) = (ChipSpec::loihi1(), Schedule::Held);
    let deployment =
        Deployment::of_controller(&controller, &policy, &chip, Split::Fewest, schedule);
    chip_driver(deployment.map_err(|error| refused(network, &error))?, name, engine)
}

/// The name without what says that it is to be compiled.
pub(super) fn network_of(name: &str) -> &str {
    name.strip_prefix(ON_CHIP).unwrap_or(name)
}

/// Whether `name` is a network file, a built-in network, or neither that nor a file.
fn is_network(name: &str) -> bool {
    if name.starts_with(ON_CHIP) || builtin::is_name(name) {
        return true;
    }
    let path = Path::new(name);
    match path.extension() {
        Some(extension) => extension == "toml" || extension == "safetensors",
        None => {
            let known = name == STRAIGHT || planner(name).is_some() || lens(name).is_some();
            !known && (builtin::is_name(name) || !path.exists())
        }
    }
}

fn planner(name: &str) -> Option<Knowledge> {
    PLANNERS.iter().find(|(known, _)| *known == name).map(|(_, knowledge)| *knowledge)
}

/// The field of view in `planner-camera:DEGREES`, as text.
fn lens(name: &str) -> Option<&str> {
    name.strip_prefix(PLANNER_CAMERA)?.strip_prefix(':')
}

/// The planner with a camera of `degrees`; `name` is what errors mention.
fn with_lens(name: &str, degrees: &str) -> Result<Driver, Failure> {
    let (min, max) = FIELD_OF_VIEW_DEG;
    match degrees.parse() {
        Ok(field_of_view_deg) if (min..=max).contains(&f64::from(field_of_view_deg)) => {
            Ok(Driver::planner(Knowledge::Camera { field_of_view_deg }))
        }
        _ => Err(format!(
            "{name}: field of view {degrees}, whole degrees of {min}..={max} expected; give \
             {PLANNER_CAMERA}:{CAMERA_DEG} or another lens"
        )
        .into()),
    }
}

/// A core map by its label, `straight`, or else a network.
fn driver(name: &str, weights: Option<&Path>, engine: EngineKind) -> Result<Driver, Failure> {
    if name == STRAIGHT {
        return Ok(Driver::straight());
    }
    if let Some(knowledge) = planner(name) {
        return Ok(Driver::planner(knowledge));
    }
    if let Some(degrees) = lens(name) {
        return with_lens(name, degrees);
    }
    if is_network(name) {
        return network_driver(name, weights, engine, |network| network);
    }
    if Path::new(name).extension().is_some_and(|extension| extension == "json") {
        return Err(no_program(name));
    }
    chip_driver(Deployment::read(Path::new(name))?, name, engine)
}

fn no_program(name: &str) -> Failure {
    NetError::Integers { file: name.to_owned() }.into()
}

/// A compiled network as a driver; `name` is what errors mention.
pub(super) fn chip_driver(
    deployment: Deployment,
    name: &str,
    engine: EngineKind,
) -> Result<Driver, Failure> {
    Driver::chip(deployment, engine).ok_or_else(|| {
        format!("{name}: a map without encoder and decoder cannot drive; use `spikeloop run`")
            .into()
    })
}

/// Label and digest of each core map among `drivers`.
pub(super) fn maps(drivers: &[Driver]) -> Vec<(String, String)> {
    let digest = |driver: &Driver| Some((driver.label.clone(), driver.deployment()?.map.digest()));
    drivers.iter().filter_map(digest).collect()
}

/// The last of `repeats` seeds from `seed` on; `option` is the name that errors mention.
pub(super) fn last_seed(seed: u64, option: &str, repeats: u64) -> Result<u64, Failure> {
    seed.checked_add(repeats - 1).ok_or_else(|| {
        format!("--seed {seed}, {option} {repeats}: seeds end at {}; take a smaller seed", u64::MAX)
            .into()
    })
}
