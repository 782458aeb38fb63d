use super::*;
use crate::net::{Controller, builtin};
use crate::policy::{Observation, Policy as _};
use crate::reference::EemSanPolicy;
use crate::reference::FloatEncoder;
use crate::train::rooms::{RoomRules, room};

const TICKS: usize = 6;

/// A late flight shows its actor what the float policy with the delays of a chip that streams
/// decides on, and lets no action drive sooner.
#[test]
fn a_late_flight_is_as_late_as_a_chip_that_streams() {
    let Ok(Controller::EemSan(network)) = builtin::open("eem-san", None) else {
        panic!("eem-san is built in")
    };
    let late = Delays {
        action_ticks: network.streamed_ticks(),
        readout_frames: network.streamed_frames(),
    };
    let streams = Streams::new(3, 0);
    let world = World::new(room(&RoomRules::default(), &streams, 0));
    let terrain = Terrain::new(&world);
    let config = TrialConfig { camera: Some(Default::default()), ..TrialConfig::eem_san(1.0) };
    let encoder = network.encoder.as_ref().map(FloatEncoder::new);
    let drive = (&config, Knowledge::Everything);
    let start = |delays| {
        Flight::new(
            (&world, &terrain),
            drive,
            5.0,
            (encoder.clone().map(Sight::Fixed), delays),
            streams,
        )
    };
    let (mut prompt, mut late_flight) = (start(Delays::default()), start(late));
    let mut policy = EemSanPolicy::streaming(&network);
    policy.start_trial(streams);
    let stand = Action { left: 0.0, right: 0.0 };
    let mut frames = vec![EventFrame::default(); 5];
    let mut seen: Vec<Vec<f32>> = Vec::new();
    for tick in 0..TICKS {
        let mut draw = streams.at(stream::STIMULUS, tick as u64);
        let action = policy.act(&Observation::random(&mut draw, frames.clone()), tick as u64);
        let robot = &prompt.observation()[..ROBOT_STATE];
        seen.push([robot, policy.dvs_state()].concat());
        let waits = tick < late.action_ticks;
        assert_eq!(late_flight.waits(), waits, "tick {tick}");
        assert!(!waits || action == stand, "tick {tick}: {action:?}");
        assert_eq!(late_flight.observation(), &seen[tick.saturating_sub(late.action_ticks)]);
        let drives = Action { left: 0.7, right: 0.9 };
        late_flight.drive(drives);
        assert_eq!(late_flight.last.is_none(), waits, "tick {tick}");
        prompt.drive(if waits { stand } else { drives });
        frames.clone_from(&prompt.frames);
        let places = [&late_flight, &prompt].map(|f| f.trial().robot().pose().rounded_mm_mrad());
        assert_eq!(places[0], places[1], "tick {tick}");
    }
    assert!(seen[TICKS - 1][ROBOT_STATE..] != seen[0][ROBOT_STATE..], "no event was seen");
}
