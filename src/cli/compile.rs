//! `spikeloop compile`.

use std::path::Path;

use hw_model::ChipSpec;
use spikeloop::compile::Policy;
use spikeloop::files;
use spikeloop::host::Deployment;
use spikeloop::net::{builtin, integer};

use crate::cli::args::CompileArgs;
use crate::cli::output::print_header;
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &CompileArgs) -> Result<Verdict, Failure> {
    let chip = chip(&args.chip)?;
    let deployment = if Path::new(&args.network).extension().is_some_and(|e| e == "json") {
        let net = integer::read(Path::new(&args.network), args.weights.as_deref())?;
        Deployment::of_integers(net, &chip, args.neurons_per_core)?
    } else {
        let network = builtin::read(&args.network, args.weights.as_deref())?;
        let policy = Policy::named(&args.policy)?;
        Deployment::compile(&network, &policy, &chip, args.neurons_per_core)?
    };
    print_header(None, &[(deployment.network.clone(), deployment.map.digest())]);
    for (layer, scale) in &deployment.scales {
        println!("layer {layer}: {scale:.3} mantissas per unit");
    }
    print!("{}", super::inspect::table(&deployment));
    deployment.write(&args.output)?;
    println!("wrote {}", args.output.display());
    Ok(Verdict::Good)
}

/// A built-in chip, or one from a file.
fn chip(name: &str) -> Result<ChipSpec, Failure> {
    let path = Path::new(name);
    if path.extension().is_some() || path.exists() {
        return Ok(ChipSpec::parse(name, &files::read_text(path)?)?);
    }
    Ok(ChipSpec::named(name)?)
}
