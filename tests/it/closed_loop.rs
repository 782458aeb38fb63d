//! Published weights in their own world: a sample of what `benches/published.sh` measures whole.

use hw_model::ChipSpec;
use spikeloop::closed_loop::{Outcome, TrialConfig};
use spikeloop::compile::{Policy, Split};
use spikeloop::evaluate::{Driver, EngineKind, Flown, fly};
use spikeloop::host::Deployment;
use spikeloop::net::builtin;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs, read_pairs};

use crate::fixtures::shared;

fn successes(flown: &[Flown]) -> usize {
    flown.iter().filter(|flown| flown.outcome.outcome == Outcome::Success).count()
}

fn chip(network: &spikeloop::net::Network, policy: &str, engine: EngineKind) -> Driver {
    let policy = Policy::named(policy).unwrap();
    let deployment =
        Deployment::compile(network, &policy, &ChipSpec::loihi1(), Split::Fewest).unwrap();
    Driver::chip(deployment, engine).unwrap()
}

#[test]
fn san_reaches_the_goal_in_nearly_all_of_twenty_published_trials() {
    let (Some(weights), Some(world), Some(pairs)) = (
        shared("san/san_sddpg_bw5.safetensors"),
        shared("san/san_evaluation_world.json"),
        shared("san/san_eval_positions.json"),
    ) else {
        return;
    };
    let world = World::new(Arena::open(world.to_str().unwrap()).unwrap());
    let pairs: Vec<Pair> = read_pairs(&pairs).unwrap().into_iter().take(20).collect();
    let network = builtin::read("san", Some(&weights)).unwrap();
    for driver in [Driver::float(&network), chip(&network, "san", EngineKind::Event)] {
        let flown = fly(&world, &pairs, &TrialConfig::san(), &driver, 1, 2, &|| ()).unwrap();
        assert!(successes(&flown) >= 18, "{}: {} of 20", driver.label, successes(&flown));
    }
}

#[test]
fn trials_do_not_depend_on_threads_engine_or_their_number() {
    let world = World::new(Arena::named("courtyard-moving").unwrap());
    let rules = PairRules::default();
    let pairs = generate_pairs(&world, 4, rules, spikeloop::rng::Streams::new(5, 0)).unwrap();
    let network = builtin::read("reflex", None).unwrap();
    let config = TrialConfig { ticks_max: 80, ..TrialConfig::san() };
    let fly = |engine, pairs: &[Pair], threads| {
        let driver = chip(&network, "nearest", engine);
        fly(&world, pairs, &config, &driver, 5, threads, &|| ()).unwrap()
    };
    let one = fly(EngineKind::Event, &pairs, 1);
    assert_eq!(fly(EngineKind::Event, &pairs, 3), one);
    assert_eq!(fly(EngineKind::Dense, &pairs, 2), one);
    assert_eq!(fly(EngineKind::Event, &pairs[..2], 1), one[..2]);
}

#[test]
fn the_straight_driver_fails_more_often_than_the_reflex_network() {
    let world = World::new(Arena::named("courtyard").unwrap());
    let rules = PairRules::default();
    let pairs = generate_pairs(&world, 30, rules, spikeloop::rng::Streams::new(1, 0)).unwrap();
    let network = builtin::read("reflex", None).unwrap();
    let fly = |driver: &Driver| {
        successes(&fly(&world, &pairs, &TrialConfig::san(), driver, 1, 2, &|| ()).unwrap())
    };
    let (straight, float) = (fly(&Driver::straight()), fly(&Driver::float(&network)));
    let on_chip = fly(&chip(&network, "nearest", EngineKind::Event));
    assert!(straight < 10 && float >= 24, "straight {straight}, float {float} of 30");
    assert!(on_chip.abs_diff(float) <= 3, "chip {on_chip}, float {float} of 30");
}
