use hw_model::ChipSpec;

use super::*;
use crate::closed_loop::TrialConfig;
use crate::evaluate::{EngineKind, fly, record};
use crate::report::results::DriverResult;
use crate::rng::Streams;
use crate::world::arena::Arena;
use crate::world::pairs::{PairRules, generate_pairs};

/// The built-in network on the chip in a courtyard with movers, for at most 40 ticks.
fn flight(engine: EngineKind) -> (World, Vec<Pair>, TrialConfig, Driver) {
    let world = World::new(Arena::open("courtyard-moving").unwrap());
    let pairs = generate_pairs(&world, 2, PairRules::default(), Streams::new(1, 0)).unwrap();
    let network = crate::net::builtin::read("reflex", None).unwrap();
    let policy = crate::compile::Policy::named("nearest").unwrap();
    let chip = ChipSpec::loihi1();
    let deployment =
        crate::host::Deployment::compile(&network, &policy, &chip, crate::compile::Split::Fewest)
            .unwrap();
    let config = TrialConfig { ticks_max: 40, ..TrialConfig::san() };
    (world, pairs, config, Driver::chip(deployment, engine).unwrap())
}

fn recorded(engine: EngineKind) -> Replay {
    let (world, pairs, config, driver) = flight(engine);
    let record = |trial| record(&world, &pairs, trial, &config, &driver, 3).unwrap();
    Replay::new("r1", &driver, 3, &world, &pairs, &[record(0), record(1)])
}

#[test]
fn recording_changes_nothing() {
    let (world, pairs, config, driver) = flight(EngineKind::Event);
    let flown = fly(&world, &pairs, &config, &driver, 3, 2, &|| ()).unwrap();
    for flown in &flown {
        let recording = record(&world, &pairs, flown.trial, &config, &driver, 3).unwrap();
        assert_eq!(&recording.flown, flown);
        assert!(flown.chip.as_ref().unwrap().counts.synaptic_ops() > 0);
    }
}

#[test]
fn a_replay_holds_what_was_flown() {
    let (world, pairs, config, driver) = flight(EngineKind::Event);
    let flown = fly(&world, &pairs, &config, &driver, 3, 1, &|| ()).unwrap();
    let result = DriverResult::new(&driver, 3, &flown, 1.0);
    let replay = recorded(EngineKind::Event);
    for (episode, trial) in replay.episodes.iter().zip(&result.trials) {
        assert_eq!(episode.poses_mm, trial.trajectory_mm);
        let (last, chip) = (episode.ticks.last().unwrap(), trial.chip.as_ref().unwrap());
        let costs: Vec<_> = replay.cost_tables.iter().map(|name| chip.costs[name]).collect();
        assert_eq!(last.dynamic_fj, costs.iter().map(|c| c.dynamic_fj).collect::<Vec<_>>());
        assert_eq!(last.time_ps, costs.iter().map(|c| c.time_ps).collect::<Vec<_>>());
        let all: Vec<u64> = episode.ticks.iter().flat_map(|tick| tick.cores.clone()).collect();
        let counted = chip.counters.iter().filter(|(name, _)| name.starts_with("synaptic_ops"));
        let counted = counted.map(|(_, n)| n).sum::<u64>() + chip.counters["updates_spiking"];
        assert_eq!(all.iter().sum::<u64>(), counted);
    }
}

#[test]
fn spikes_come_back_layer_by_layer() {
    let (world, pairs, config, driver) = flight(EngineKind::Event);
    let recording = record(&world, &pairs, 0, &config, &driver, 3).unwrap();
    let replay = recorded(EngineKind::Event);
    let mut n = 0;
    for (tick, packed) in recording.ticks.iter().zip(&replay.episodes[0].ticks) {
        let mut first = 0;
        for (layer, steps) in replay.layers.iter().zip(&tick.spikes) {
            for spikes in steps {
                let end = first + layer.neurons;
                let here: Vec<u32> = packed
                    .spikes
                    .iter()
                    .filter(|bit| (first..end).contains(*bit))
                    .map(|bit| bit - first)
                    .collect();
                assert_eq!(&here, spikes);
                n += spikes.len() as u64;
                first = end;
            }
        }
        assert_eq!(packed.layer_spikes, tick.layer_spikes);
    }
    let counted = recording.ticks.iter().flat_map(|tick| &tick.layer_spikes).sum::<u64>();
    assert!(n == counted && n > 0, "{n} spikes of {counted}");
}

#[test]
fn a_replay_is_the_same_each_time_and_on_both_engines() {
    let event = recorded(EngineKind::Event);
    assert_eq!(event, recorded(EngineKind::Event));
    let dense = recorded(EngineKind::Dense);
    assert_eq!(dense.driver, "reflex chip (nearest, dense)");
    assert_eq!(Replay { driver: event.driver.clone(), ..dense }, event);
}

#[test]
fn event_frames_come_back_column_by_column() {
    let mut frame = EventFrame::default();
    let pixels = [(0, 0), (0, 127), (5, 3), (5, 4), (127, 127)];
    pixels.iter().for_each(|(x, y)| frame.set(*x, *y));
    assert_eq!(pixels_by_column(&frame), pixels.map(|(x, y)| (x * 128 + y) as u32));
}

#[test]
fn json_goes_there_and_back() {
    let replay = recorded(EngineKind::Event);
    let text = serde_json::to_string(&replay).unwrap();
    assert_eq!(Replay::from_json("r.json", &text).unwrap(), replay);
}

#[test]
fn damaged_replays_are_refused_with_their_place() {
    type Damage = fn(&mut Replay);
    let damages: [(Damage, &str); 10] = [
        (|r| r.format = 3, "r.json: format 3 found, 2 expected; drive again"),
        (|r| r.frame_size = [1025, 1], "frame_size, layers: frames of 1025 x 1 pixels"),
        (|r| r.layers[0].steps = 1 << 20, "neurons in 1048576 steps of a tick"),
        (|r| r.chip.as_mut().unwrap().mesh.tiles_x = 0, "chip: "),
        (|r| r.episodes[1].poses_mm.truncate(40), "trial 1: 40 ticks, 40 poses and 41 places"),
        (|r| r.episodes[0].movers_mm[2].clear(), "trial 0, tick 2: "),
        (|r| r.episodes[0].ticks[3].spikes.push(1 << 20), "trial 0, tick 3: spikes: place 1048576"),
        (|r| r.episodes[0].ticks[3].frames = vec![vec![16_384]], "frames: place 16384 of 16384"),
        (|r| r.episodes[0].ticks[4].cores.clear(), "tick 4: 0 numbers of cores, 4"),
        (|r| r.episodes[0].ticks[5].time_ps.truncate(1), "tick 5: 1 numbers of time_ps, 2"),
    ];
    let good = recorded(EngineKind::Event);
    for (damage, part) in damages {
        let mut replay = good.clone();
        damage(&mut replay);
        let text = serde_json::to_string(&replay).unwrap();
        let error = Replay::from_json("r.json", &text).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let text = serde_json::to_string(&good).unwrap().replace(r#""ticks":""#, r#""ticks":"!"#);
    let error = Replay::from_json("r.json", &text).unwrap_err().to_string();
    assert!(error.contains("ticks: base64: Invalid symbol 33"), "{error}");
    assert!(Replay::from_json("r.json", "{}").unwrap_err().to_string().contains("not a replay"));
}

#[test]
fn a_still_picture_shows_arena_chip_and_spikes() {
    let replay = recorded(EngineKind::Event);
    let svg = frame_picture(&replay, 0, 20);
    for part in
        ["tick 20 of 40", "core 0 pools", "data:image/png;base64,iVBORw0KGgo", "(davies2018)"]
    {
        assert!(svg.contains(part), "{part}");
    }
    assert_eq!(frame_picture(&replay, 0, 1000), frame_picture(&replay, 0, 39));
}

#[test]
fn a_driver_without_a_network_is_recorded_too() {
    let (world, pairs, config, _) = flight(EngineKind::Event);
    let driver = Driver::straight();
    let recording = record(&world, &pairs, 0, &config, &driver, 3).unwrap();
    let replay = Replay::new("r1", &driver, 3, &world, &pairs, &[recording]);
    let text = serde_json::to_string(&replay).unwrap();
    assert_eq!(Replay::from_json("r.json", &text).unwrap(), replay);
    assert!(frame_picture(&replay, 0, 5).contains("tick 5 of"));
    let planner = Driver::planner(crate::closed_loop::planner::Knowledge::Everything);
    let error = record(&world, &pairs, 0, &config, &planner, 3).unwrap_err().to_string();
    assert!(error.contains("cannot be recorded; record another driver"), "{error}");
    assert!(planner.layers().is_empty());
}
