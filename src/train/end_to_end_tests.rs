use super::*;
use crate::net::EemSan;
use crate::rng::{Streams, stream};
use crate::train::{ActorConfig, ActorTraining, HsvaeConfig, HsvaeTraining, TrainConfigError};

const HSVAE: &str = include_str!("configs/hsvae.toml");
const E2E: &str = include_str!("configs/e2e.toml");

/// An encoder that has hardly learned anything.
fn encoder() -> EventEncoder {
    let config = HsvaeConfig::from_toml("f", HSVAE).unwrap().quick();
    let weights = HsvaeTraining::new(&config, 1).unwrap().weights();
    EemSan::encoder_from_bytes("w", &weights).unwrap()
}

fn config() -> ActorConfig {
    let mut config = ActorConfig::from_toml("f", E2E).unwrap().quick();
    config.phases.truncate(2);
    (config.flight.ticks_per_round, config.flight.ticks_max) = (9, 5);
    config
}

fn written(training: &ActorTraining) -> Vec<u8> {
    let mut state = StateWriter::default();
    training.write(&mut state);
    state.bytes()
}

#[test]
fn training_goes_on_from_a_checkpoint_byte_for_byte_for_every_number_of_threads() {
    let (encoder, config) = (encoder(), config());
    let mut whole = ActorTraining::new(&config, Some(&encoder), 1).unwrap();
    let reports = [whole.run_round(|_| {}), whole.run_round(|_| {})];
    assert!(reports.iter().all(|report| report.ends.total() > 0), "no flight ends");
    assert!(reports.iter().all(|report| report.seen.is_some() && report.rate.unwrap() > 0.0));
    let mut first = ActorTraining::new(&config, Some(&encoder), 2).unwrap();
    first.run_round(|_| {});
    let bytes = written(&first);
    let mut second = ActorTraining::new(&config, Some(&encoder), 2).unwrap();
    second.read(&StateReader::new("checkpoint", &bytes).unwrap()).unwrap();
    second.run_round(|_| {});
    assert_eq!(written(&second), written(&whole));
    assert_eq!(second.weights(), whole.weights());
}

#[test]
fn encoder_learns_at_its_own_rate_and_stays_at_rate_0() {
    let (encoder, mut config) = (encoder(), config());
    config.average = 0.0;
    let learned = |config: &ActorConfig| {
        let mut training = ActorTraining::new(config, Some(&encoder), 1).unwrap();
        let report = training.run_round(|_| {});
        let network = EemSan::from_bytes("n", "w", &training.weights()).unwrap();
        (network, report.rate)
    };
    let (network, rate) = learned(&config);
    let found = network.encoder.unwrap();
    assert!(rate.is_some());
    for (layer, before) in found.layers.iter().zip(&encoder.layers) {
        assert_ne!(layer.weights, before.weights, "{}", layer.name);
    }
    assert_ne!(found.readout, encoder.readout);
    config.phases[0].encoder_rate = 0.0;
    let (control, rate) = learned(&config);
    assert_eq!((control.encoder.as_ref(), rate), (Some(&encoder), None));
    assert_ne!(control.decision, network.decision, "the actor saw the same");
}

#[test]
fn encoders_learn_with_actors_of_other_forms() {
    let (encoder, mut config) = (encoder(), config());
    config.average = 0.0;
    config.flight.ticks_per_round = 3;
    for variant in ["naive", "fixed"] {
        config.network.variant = Some(variant.to_owned());
        let mut training = ActorTraining::new(&config, Some(&encoder), 1).unwrap();
        training.run_round(|_| {});
        let network = EemSan::from_bytes("n", "w", &training.weights()).unwrap();
        assert_ne!(network.encoder.as_ref(), Some(&encoder), "{variant}");
    }
}

#[test]
fn sight_that_learns_sees_what_the_fixed_one_sees() {
    let encoder = encoder();
    let mut fixed = Sight::Fixed(FloatEncoder::new(&encoder));
    let mut learning = EndToEnd::new(&encoder, false).sights(1, true).remove(0);
    let mut draw = Streams::new(1, 0).at(stream::STIMULUS, 0);
    let same = |fixed: &Sight, learning: &Sight| {
        for (fixed, learning) in fixed.state().iter().zip(learning.state()) {
            assert!((fixed - learning).abs() < 1e-3 * fixed.abs().max(1.0), "{fixed} {learning}");
        }
    };
    assert_eq!(fixed.resting_state(), learning.resting_state());
    for number in 0..12 {
        if number == 7 {
            fixed.reset();
            learning.reset();
        }
        let frame = EventFrame::random(&mut draw, 400);
        fixed.step(&frame);
        learning.step(&frame);
        same(&fixed, &learning);
    }
}

#[test]
fn without_an_encoder_or_with_delays_it_is_refused() {
    let error = ActorTraining::new(&config(), None, 1).unwrap_err();
    assert!(matches!(error, TrainConfigError::NoEncoder));
    assert_eq!(
        error.to_string(),
        "end_to_end: no encoder found, one expected to begin with; give --encoder, as `spikeloop \
         train hsvae` writes it"
    );
    for key in ["action_delay_ticks", "readout_delay_frames"] {
        let error = ActorConfig::from_toml("f", &format!("{key} = 1\n{E2E}")).unwrap_err();
        let expected = "f: end_to_end: action_delay_ticks and readout_delay_frames must be 0";
        assert_eq!(error.to_string(), expected);
    }
}
