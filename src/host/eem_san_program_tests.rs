use hw_model::ChipSpec;

use super::*;
use crate::compile::{Policy, Split};
use crate::host::Deployment;
use crate::net::{Controller, builtin};

fn deployment(name: &str) -> Deployment {
    let Controller::EemSan(network) = builtin::open(name, None).unwrap() else {
        panic!("{name} is an EEM-SAN")
    };
    let policy = Policy::named("mixed").unwrap();
    let chip = ChipSpec::loihi1();
    Deployment::compile_eem_san(&network, &policy, &chip, Split::Fewest, Schedule::Held).unwrap()
}

#[test]
fn programs_are_read_as_they_were_written() {
    for name in ["eem-san", "laser-only"] {
        let written = deployment(name);
        let read = Deployment::from_bytes("x.map", &written.to_bytes()).unwrap();
        assert!(read.eem_san == written.eem_san && read.eem_san.is_some());
        assert_eq!(read.takes_frames(), name == "eem-san");
        assert_eq!(read.digest(), written.digest());
        let mut other = read.clone();
        other.eem_san.as_mut().unwrap().laser.mean[0] += 1.0;
        assert_ne!(other.digest(), written.digest(), "the host's weights count");
        assert_eq!(other.map.digest(), written.map.digest());
    }
}

#[test]
fn programs_that_do_not_go_with_the_map_are_refused() {
    let deployment = deployment("eem-san");
    let refused = |change: &dyn Fn(&mut EemSanProgram), text: &str| {
        let mut program = deployment.eem_san.clone().unwrap();
        change(&mut program);
        let problem = program.check(&deployment.map).unwrap_err();
        assert!(problem.contains(text), "{problem}");
    };
    fn phase(program: &mut EemSanProgram) -> &mut EncoderPhase {
        program.encoder.as_mut().unwrap()
    }
    refused(&|p| p.bias_port = 0, "port bias has Some(16384) lines, 10 expected");
    refused(&|p| p.laser.port = 77, "port laser has None lines, 220 expected");
    refused(&|p| p.laser.neurons = 0, "code laser: 220 centres and 220 widths, 22 times 0");
    refused(&|p| p.laser.neurons = u32::MAX, "22 times 4294967295 expected");
    refused(&|p| p.laser.mean[3] = f32::NAN, "code laser: centres must be finite, widths above 0");
    refused(&|p| p.laser.deviation[3] = 0.0, "widths above 0");
    refused(&|p| p.steps = 0, "decision: windows of 0 in 10 steps");
    refused(&|p| p.decision_steps = u32::MAX, "decision: windows of 5 in 4294967295 steps");
    refused(&|p| p.decision[2].start = 6, "decision: a window of 5 from step 6 of 10");
    refused(&|p| p.decision[2].start = 0, "decision: a window of 5 from step 0 of 10");
    refused(&|p| p.decision[2].population = 10, "decision: population 10, the map has 10");
    refused(&|p| p.decision[2].population = 5, "layer 7: population 5, 6 expected");
    refused(&|p| phase(p).layers[1].population = 0, "layer 2: population 0, 1 expected");
    refused(&|p| p.decision.truncate(3), "output population has 256 neurons, 2 expected");
    refused(&|p| p.decision.clear(), "no layers of a decision");
    refused(&|p| p.dvs = None, "an encoder and a code of its state go together");
    refused(&|p| p.encoder = None, "an encoder and a code of its state go together");
    let streaming = |p: &mut EemSanProgram| {
        p.schedule = Schedule::Streaming;
        p.steps = 4;
    };
    refused(&streaming, "streaming needs an encoder of 4 frames per tick");
    refused(&|p| phase(p).frames = 4, "4 frames per tick, 5 expected");
    refused(&|p| phase(p).pixel_port = 1, "port pixels has Some(220) lines, 16384 expected");
    refused(&|p| phase(p).layers.clear(), "no layers of the encoder");
    refused(&|p| phase(p).layers[0].start = 5, "encoder: a window of 5 from step 5 of 9");
    refused(&|p| phase(p).voltage_unit = 0.0, "the voltage unit above 0");
    refused(&|p| phase(p).readout.weights.truncate(3), "readout: 3 weights and 64 biases for 64");
    refused(&|p| phase(p).readout.bias[0] = f32::INFINITY, "readout: numbers must be finite");
    refused(
        &|p| phase(p).readout.bias.truncate(9),
        "code dvs: 640 centres and 640 widths, 9 times",
    );
}
