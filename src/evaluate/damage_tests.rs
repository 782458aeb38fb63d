use super::*;

fn dead(dead_cores: u32, trial: u64) -> Vec<CoreId> {
    let damage = Damage { dead_cores, ..Damage::default() };
    damage.faults(20, &Streams::new(3, trial)).dead_cores().to_vec()
}

#[test]
fn more_dead_cores_hold_the_fewer_and_every_trial_has_its_own() {
    let (two, eight) = (dead(2, 0), dead(8, 0));
    assert_eq!((dead(0, 0).len(), two.len(), eight.len(), dead(20, 0).len()), (0, 2, 8, 20));
    assert!(two.iter().all(|core| eight.contains(core)), "{two:?} {eight:?}");
    assert!((1..10).any(|trial| dead(2, trial) != two));
    assert_eq!(dead(8, 0), eight);
}

#[test]
fn messages_of_every_trial_are_lost_by_a_seed_of_their_own() {
    let damage = Damage { messages_lost_per_million: 10_000, ..Damage::default() };
    let faults = [0, 0, 1].map(|trial| damage.faults(4, &Streams::new(3, trial)));
    assert_eq!(faults[0], faults[1]);
    assert_ne!(faults[0], faults[2]);
}
