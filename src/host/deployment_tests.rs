use proptest::prelude::*;

use super::*;
use crate::net::builtin;

fn deployment() -> Deployment {
    let network = builtin::read("reflex", None).unwrap();
    let policy = Policy::named("nearest").unwrap();
    Deployment::compile(&network, &policy, &ChipSpec::loihi1(), Split::Fewest).unwrap()
}

/// The bytes of a file whose content was changed and whose digest fits again.
fn resealed(change: impl FnOnce(&mut DeploymentFile)) -> Vec<u8> {
    let d = deployment();
    let mut file = DeploymentFile {
        network: d.network,
        policy: d.policy,
        map: d.map.parts().clone(),
        program: d.program,
        eem_san: d.eem_san,
        scales: d.scales,
    };
    change(&mut file);
    container::to_bytes(KIND, &file)
}

fn error_of(bytes: &[u8]) -> String {
    Deployment::from_bytes("x.map", bytes).unwrap_err().to_string()
}

#[test]
fn what_was_written_is_read() {
    let written = deployment();
    let read = Deployment::from_bytes("x.map", &written.to_bytes()).unwrap();
    assert_eq!(read.map.digest(), written.map.digest());
    assert_eq!(read.program, written.program);
    assert_eq!(read.to_bytes(), written.to_bytes());
}

#[test]
fn another_version_says_to_compile_again() {
    let mut bytes = deployment().to_bytes();
    bytes[8] = 9;
    assert_eq!(
        error_of(&bytes),
        "x.map: version 9 found, 3 expected; compile the network again with `spikeloop compile`"
    );
}

#[test]
fn an_over_full_core_in_a_file_is_refused() {
    let bytes = resealed(|file| file.map.cores[0].groups[0].len = 1025);
    let error = error_of(&bytes);
    assert!(
        error.starts_with(
            "x.map: core 0 (pools): 1025 compartments, limit 1024 (loihi1.compartments_per_core)"
        ),
        "{error}"
    );
}

#[test]
fn a_program_that_does_not_go_with_the_map_is_refused() {
    type Case = (fn(&mut DecisionProgram), &'static str);
    let cases: [Case; 6] = [
        (|p| p.steps = 0, "0 of 18 steps"),
        (|p| p.input_port = 7, "input port has None lines"),
        (|p| p.bias_port = 9, "bias port has None lines"),
        (|p| p.window_starts.clear(), "windows for 0 populations, the map has 2"),
        (|p| p.output = 0, "output population has Some(6) neurons, 2 expected"),
        (|p| p.bias_starts[0] = 1 << 20, "a window starts at step 1048576"),
    ];
    for (change, expected) in cases {
        let error = error_of(&resealed(|file| change(file.program.as_mut().unwrap())));
        assert!(error.contains(expected), "{error} does not say {expected}");
    }
}

#[test]
fn windows_of_a_direct_and_a_relayed_network_open_one_step_apart() {
    let network = builtin::read("reflex", None).unwrap();
    let policy = Policy::named("nearest").unwrap();
    let relayed = Network { relay: true, ..network };
    let relayed =
        Deployment::compile(&relayed, &policy, &ChipSpec::loihi1(), Split::Fewest).unwrap();
    let (direct, relayed) = (deployment().program.unwrap(), relayed.program.unwrap());
    assert_eq!((direct.output_start(), direct.chip_steps), (2, 18));
    assert_eq!((relayed.output_start(), relayed.chip_steps), (3, 19));
}

proptest! {
    #[test]
    fn damaged_content_behind_a_good_digest_never_panics(at in any::<prop::sample::Index>(), value in any::<u8>()) {
        let good = deployment().to_bytes();
        let mut content = good[52..].to_vec();
        let at = at.index(content.len());
        content[at] = value;
        let mut bytes = good[..12].to_vec();
        bytes.extend_from_slice(&(content.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&sha256(&content));
        bytes.extend_from_slice(&content);
        // What loads must also run.
        if let Ok(read) = Deployment::from_bytes("x.map", &bytes)
            && let Some(program) = &read.program
            && program.chip_steps < 100
        {
            let engine = Box::new(hw_model::EventEngine::new(Arc::clone(&read.map)));
            let mut policy = crate::host::ChipPolicy::new(&read, engine).unwrap();
            policy.decide(&vec![vec![true; 24]; program.steps as usize]);
        }
    }
}

fn sha256(bytes: &[u8]) -> Vec<u8> {
    use sha2::Digest;
    sha2::Sha256::digest(bytes).to_vec()
}

#[test]
fn the_digest_is_of_the_hosts_program_as_well() {
    let deployment = deployment();
    let mut other = deployment.clone();
    other.program.as_mut().unwrap().steps += 1;
    assert_eq!(other.map.digest(), deployment.map.digest());
    assert_ne!(other.digest(), deployment.digest());
    let bare = Deployment { program: None, ..deployment };
    assert_eq!(bare.digest(), bare.map.digest());
}

#[test]
fn a_network_without_a_host_program_is_spread_by_a_run_on_random_spikes() {
    use crate::net::integer::{IntegerPopulation, IntegerProjection, Mantissas};
    let population = |name: &str, neurons, threshold_mantissa| IntegerPopulation {
        name: name.to_owned(),
        neurons,
        threshold_mantissa,
    };
    let projection = |source, target, weights| IntegerProjection {
        sources: vec![source],
        target,
        weights: Mantissas::Dense(weights),
    };
    let net = IntegerNet {
        name: "n".to_owned(),
        decay_current: 2048,
        decay_voltage: 1024,
        populations: vec![
            population("in", 600, None),
            population("busy", 12, Some(10)),
            population("idle", 12, Some(10)),
        ],
        // Nothing reaches the threshold of what the second layer would hear.
        projections: vec![projection(0, 1, vec![4; 7200]), projection(1, 2, vec![0; 144])],
    };
    let cores = |split| {
        let deployment = Deployment::of_integers(net.clone(), &ChipSpec::loihi1(), split).unwrap();
        let on = |population: usize| deployment.map.populations()[population].cores().len();
        [on(0), on(1)]
    };
    assert_eq!(cores(Split::Fewest), [1, 1]);
    assert_eq!(cores(Split::Cores(5)), [4, 1]);
    assert_eq!(cores(Split::NeuronsPerCore(3)), [4, 4]);
}
