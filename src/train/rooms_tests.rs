use super::*;
use crate::world::pairs::{PairRules, generate_pairs};

#[test]
fn rooms_are_full_and_every_one_has_trials() {
    let (rules, streams) = (RoomRules::default(), Streams::new(7, 0));
    for number in 0..20 {
        let arena = room(&rules, &streams, number);
        let movers = arena.movers().len();
        assert!(arena.obstacles().len() >= 4 + 5, "{} obstacles", arena.obstacles().len());
        assert!(movers >= 2, "{movers} movers in room {number}");
        let pairs = PairRules { distance_m_min: rules.distance_m_min, clearance_m: 0.5 };
        generate_pairs(&World::new(arena), 5, pairs, Streams::new(1, number)).unwrap();
    }
}

#[test]
fn room_depends_on_its_number_and_seed_alone() {
    let rules = RoomRules::default();
    let of = |seed, number| room(&rules, &Streams::new(seed, 0), number);
    assert_eq!(of(1, 3), of(1, 3));
    assert_ne!(of(1, 3), of(1, 4));
    assert_ne!(of(1, 3), of(2, 3));
}
