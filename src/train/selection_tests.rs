use super::*;
use crate::net::{Controller, builtin};
use crate::train::rooms::room;

fn selection(seed: u64) -> Selection {
    let rooms = RoomRules { movers_per_100_m2: [0.0, 0.0], ..RoomRules::default() };
    let config = SelectionConfig { every: 1, n_rooms: 3, flights_per_room: 2, rooms };
    Selection::new(&config, &TrialConfig::eem_san(1.0), seed, false)
}

fn control() -> EemSan {
    let Ok(Controller::EemSan(network)) = builtin::open("laser-only", None) else {
        panic!("laser-only is built in")
    };
    *network
}

/// Nearly all goals where nothing moves, and none with a decision module that never spikes.
#[test]
fn share_of_a_trained_actor_is_high_and_of_a_mute_one_zero() {
    let (selection, trained) = (selection(1), control());
    let share = selection.share(&trained, 1);
    assert!(share >= 5.0 / 6.0, "{share}");
    assert_eq!(selection.share(&trained, 3), share);
    let mut mute = trained;
    let last = mute.decision.last_mut().unwrap();
    last.weights.iter_mut().for_each(|weight| *weight = 0.0);
    last.bias.iter_mut().for_each(|bias| *bias = -1.0);
    assert_eq!(selection.share(&mute, 1), 0.0);
}

#[test]
fn rooms_are_those_of_the_seed_and_none_that_is_trained_in() {
    let arenas = |seed: u64| -> Vec<_> {
        selection(seed).places.iter().map(|(world, _)| world.arena().clone()).collect()
    };
    assert_eq!(arenas(1), arenas(1));
    assert_ne!(arenas(1), arenas(2));
    let rules = RoomRules { movers_per_100_m2: [0.0, 0.0], ..RoomRules::default() };
    let trained_in = room(&rules, &Streams::new(1, TRIAL), 0);
    assert_ne!(arenas(1)[0].obstacles(), trained_in.obstacles());
}
