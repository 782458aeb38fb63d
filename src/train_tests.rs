use super::*;
use crate::nn::StateReader;
use crate::train::config::Teacher;

const HSVAE: &str = include_str!("train/configs/hsvae.toml");
const THIRD: &str = include_str!("train/configs/third.toml");

fn saved(write: impl FnOnce(&mut StateWriter)) -> Vec<u8> {
    let mut state = StateWriter::default();
    write(&mut state);
    state.bytes()
}

#[test]
fn actor_goes_on_from_a_checkpoint_byte_for_byte() {
    let config = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    let mut whole = ActorTraining::new(&config, None, 1).unwrap();
    let rounds = whole.rounds();
    assert!(rounds >= 2, "the test needs rounds");
    (0..rounds).for_each(|_| {
        whole.run_round(|_| {});
    });
    let mut bytes = saved(|state| ActorTraining::new(&config, None, 2).unwrap().write(state));
    for _ in 0..rounds {
        let mut part = ActorTraining::new(&config, None, 2).unwrap();
        part.read(&StateReader::new("checkpoint", &bytes).unwrap()).unwrap();
        part.run_round(|_| {});
        bytes = saved(|state| part.write(state));
    }
    assert_eq!(saved(|state| whole.write(state)), bytes);
    assert!(whole.updates() > 0 && whole.ticks() > 0);
}

#[test]
fn auto_encoder_goes_on_from_a_checkpoint_byte_for_byte() {
    let mut config = HsvaeConfig::from_toml("f", HSVAE).unwrap().quick();
    config.flight.ticks_per_round = 2;
    let mut whole = HsvaeTraining::new(&config, 1).unwrap();
    (0..2).for_each(|_| {
        whole.run_round(|| {});
    });
    let mut first = HsvaeTraining::new(&config, 2).unwrap();
    first.run_round(|| {});
    let bytes = saved(|state| first.write(state));
    let mut second = HsvaeTraining::new(&config, 2).unwrap();
    second.read(&StateReader::new("checkpoint", &bytes).unwrap()).unwrap();
    second.run_round(|| {});
    assert_eq!(saved(|state| whole.write(state)), saved(|state| second.write(state)));
    let report = second.measure(3);
    assert!(report.frames > 0 && report.targets.mean > 0.0 && report.rates.len() == 4);
    let encoder = crate::net::EemSan::encoder_from_bytes("w", &second.weights()).unwrap();
    assert_eq!(encoder.layers.len(), 4);
}

#[test]
fn exported_actor_and_encoder_are_a_network() {
    let config = HsvaeConfig::from_toml("f", HSVAE).unwrap().quick();
    let weights = HsvaeTraining::new(&config, 1).unwrap().weights();
    let encoder = crate::net::EemSan::encoder_from_bytes("w", &weights).unwrap();
    let config = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    let training = ActorTraining::new(&config, Some(&encoder), 1).unwrap();
    let bytes = saved(|state| {
        training.add_weights(state);
        add_encoder(state, &encoder);
    });
    let network = crate::net::EemSan::from_bytes("n", "w", &bytes).unwrap();
    assert_eq!(network.encoder.as_ref(), Some(&encoder));
    assert_eq!(network.decision.len(), 4);
}

#[test]
fn teacher_with_the_sensors_of_the_actor_teaches_otherwise() {
    let mut config = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    let taught = [Teacher::Everything, Teacher::Sensors].map(|teacher| {
        config.teacher = teacher;
        let mut training = ActorTraining::new(&config, None, 1).unwrap();
        training.run_round(|_| {});
        saved(|state| training.add_weights(state))
    });
    assert_ne!(taught[0], taught[1]);
}
