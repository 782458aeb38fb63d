use super::*;
use crate::nn::variant::{Thresholds, VARIANTS};
use crate::nn::{Form, StateReader};
use crate::train::config::Teacher;
use crate::train::rooms::RoomRules;
use crate::train::selection::SelectionConfig;

const TOLD: &str = include_str!("train/configs/told.toml");
const HSVAE: &str = include_str!("train/configs/hsvae.toml");
const THIRD: &str = include_str!("train/configs/third.toml");
const COMPARE: &str = include_str!("train/configs/compare.toml");

fn saved(write: impl FnOnce(&mut StateWriter)) -> Vec<u8> {
    let mut state = StateWriter::default();
    write(&mut state);
    state.bytes()
}

/// The third recipe for a few seconds, with an average of the actor and a selection.
fn averaged(average: f32) -> ActorConfig {
    let mut config = ActorConfig::from_toml("f", THIRD).unwrap();
    let rooms = RoomRules::default();
    config.average = average;
    config.selection = Some(SelectionConfig { every: 1, n_rooms: 9, flights_per_room: 9, rooms });
    config.flight.ticks_max = 60;
    config.quick()
}

fn whole(config: &ActorConfig) -> ActorTraining {
    let mut whole = ActorTraining::new(config, None, 1).unwrap();
    assert!(whole.rounds() >= 2, "the test needs rounds");
    while whole.round() < whole.rounds() {
        whole.run_round(|_| {});
        whole.select();
    }
    whole
}

#[test]
fn actor_goes_on_from_a_checkpoint_byte_for_byte() {
    let plain = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    // Flights that end within a round, so that states begin again.
    let mut bdett = compared("bdett");
    bdett.flight.ticks_max = 4;
    for config in [plain, averaged(0.01), bdett] {
        goes_on_byte_for_byte(&config);
    }
}

fn goes_on_byte_for_byte(config: &ActorConfig) {
    let whole = whole(config);
    let mut bytes = saved(|state| ActorTraining::new(config, None, 2).unwrap().write(state));
    for _ in 0..whole.rounds() {
        let mut part = ActorTraining::new(config, None, 2).unwrap();
        part.read(&StateReader::new("checkpoint", &bytes).unwrap()).unwrap();
        part.run_round(|_| {});
        part.select();
        bytes = saved(|state| part.write(state));
    }
    assert_eq!(saved(|state| whole.write(state)), bytes);
    assert!(whole.updates() > 0 && whole.ticks() > 0);
}

#[test]
fn average_and_selection_change_what_is_saved_and_nothing_that_is_learned() {
    let mut plain = averaged(0.0);
    plain.selection = None;
    let learned = |config: &ActorConfig| {
        let training = whole(config);
        (training.history().to_vec(), training.weights())
    };
    let (plain_history, last) = learned(&plain);
    let (history, average) = learned(&averaged(0.01));
    assert_eq!(history, plain_history);
    assert_ne!(average, last);
    // All of every update: the average is the last actor.
    assert_eq!(learned(&averaged(1.0)), (plain_history, last));
}

#[test]
fn average_begins_with_the_actor_that_training_begins_with() {
    let mut first = averaged(0.01);
    first.seed = 9;
    let first = ActorTraining::new(&first, None, 1).unwrap().weights();
    let mut training = ActorTraining::new(&averaged(0.01), None, 1).unwrap();
    assert_ne!(training.weights(), first);
    training.begin_with(&StateReader::new("w", &first).unwrap()).unwrap();
    assert_eq!(training.weights(), first);
}

#[test]
fn comparisons_come_when_due_and_only_a_better_actor_is_the_best() {
    let mut config = averaged(0.01);
    (config.phases[0].rounds, config.flight.ticks_per_round) = (5, 1);
    let rules = config.selection.as_mut().unwrap();
    rules.every = 2;
    let mut training = ActorTraining::new(&config, None, 1).unwrap();
    assert_eq!(training.select(), None);
    let mut found = Vec::new();
    for _ in 0..5 {
        training.run_round(|_| {});
        found.push(training.select());
        assert_eq!(training.select(), None, "compared twice after one round");
    }
    assert!(found[0].is_none() && found[2].is_none() && found[4].is_none());
    let (first, second) = (found[1].unwrap(), found[3].unwrap());
    assert!(first.best);
    // Nothing was learned in between, and the flights are the same.
    assert_eq!(second, Selected { share: first.share, best: false });
    assert_eq!(training.shares(), vec![first.share; 4]);
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
    assert!(report.explained.is_empty() && report.beyond.is_empty());
    let encoder = crate::net::EemSan::encoder_from_bytes("w", &second.weights()).unwrap();
    assert_eq!(encoder.layers.len(), 4);
}

#[test]
fn an_encoder_that_is_told_of_movers_is_judged_by_what_it_says_of_them() {
    let mut config = HsvaeConfig::from_toml("f", TOLD).unwrap().quick();
    config.rounds = 1;
    let mut training = HsvaeTraining::new(&config, 2).unwrap();
    training.run_round(|| {});
    let report = training.measure(40);
    let names: Vec<&str> = report.explained.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["nearness", "closing", "to the left", "to the right"]);
    let names: Vec<&str> = report.beyond.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["closing", "left less right"]);
    // After three updates the decoder shows nothing: that explains at most nothing.
    let (_, nearness) = report.explained[0];
    assert!(nearness.is_some_and(|share| share < 0.05), "{report:?}");
}

#[test]
fn exported_actor_and_encoder_are_a_network() {
    let config = HsvaeConfig::from_toml("f", HSVAE).unwrap().quick();
    let weights = HsvaeTraining::new(&config, 1).unwrap().weights();
    let encoder = crate::net::EemSan::encoder_from_bytes("w", &weights).unwrap();
    let config = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    let training = ActorTraining::new(&config, Some(&encoder), 1).unwrap();
    let network = crate::net::EemSan::from_bytes("n", "w", &training.weights()).unwrap();
    assert_eq!(network.encoder.as_ref(), Some(&encoder));
    assert_eq!(network.decision.len(), 4);
}

/// A network of the table with the recipe for comparing them, for a few seconds.
fn compared(variant: &str) -> ActorConfig {
    let mut config = ActorConfig::from_toml("f", COMPARE).unwrap();
    config.network.variant = Some(variant.to_owned());
    config.quick()
}

#[test]
fn every_network_of_the_table_trains_and_what_it_saves_is_that_network() {
    let config = HsvaeConfig::from_toml("f", HSVAE).unwrap().quick();
    let weights = HsvaeTraining::new(&config, 1).unwrap().weights();
    let encoder = crate::net::EemSan::encoder_from_bytes("w", &weights).unwrap();
    for variant in VARIANTS {
        let mut config = compared(variant.name);
        config.network.threshold = 0.25;
        let encoder = variant.events.then_some(&encoder);
        let mut training = ActorTraining::new(&config, encoder, 2).unwrap();
        let fresh = training.weights();
        if !variant.events {
            training.run_round(|_| {});
            assert!(training.updates() > 0);
            assert_ne!(training.weights(), fresh, "{}", variant.name);
        }
        let weights = training.weights();
        let reader = StateReader::new("w", &weights).unwrap();
        assert_eq!(Form::of(&reader, "actor."), Some(variant.form), "{}", variant.name);
        let network = crate::net::EemSan::from_bytes("n", "w", &weights).unwrap();
        assert_eq!(network.encoder.as_ref(), encoder);
        assert_eq!(network.dynamic.is_some(), variant.name == "bdett");
        if variant.form.thresholds != Thresholds::Learned {
            assert!(network.dense_layers().all(|layer| layer.threshold == 0.25));
        }
    }
}

#[test]
fn history_and_the_state_of_flights_change_what_bdett_learns() {
    let learned = |ticks: usize| {
        let mut config = compared("bdett");
        config.network.history_ticks = ticks;
        let mut training = ActorTraining::new(&config, None, 1).unwrap();
        training.run_round(|_| {});
        training.weights()
    };
    assert_ne!(learned(0), learned(3));
}

#[test]
fn teacher_with_the_sensors_of_the_actor_teaches_otherwise() {
    let mut config = ActorConfig::from_toml("f", THIRD).unwrap().quick();
    let taught = [Teacher::Everything, Teacher::Sensors].map(|teacher| {
        config.teacher = teacher;
        let mut training = ActorTraining::new(&config, None, 1).unwrap();
        training.run_round(|_| {});
        training.weights()
    });
    assert_ne!(taught[0], taught[1]);
}
