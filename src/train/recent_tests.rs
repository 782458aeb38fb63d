use super::*;
use crate::closed_loop::planner::ACTIONS;
use crate::rng::Streams;

fn step(number: f32, ended: bool) -> Step {
    Step {
        observation: vec![number],
        action: [0.0; 2],
        reward: number,
        next_observation: vec![number + 1.0],
        insight: Vec::new(),
        next_insight: Vec::new(),
        terminal: 0.0,
        ended,
        planned: [0.0; 2],
        costs: [0.0; ACTIONS],
    }
}

/// What a memory holds after some steps of numbers 0, 1, ..., of which two end flights, as texts:
/// observation, what was before it; next observation, what was before that.
fn remembered(ticks: usize, n: usize) -> Vec<String> {
    let mut replay = Replay::new(1, 0, 100).with_history(ticks);
    let mut recent = Recent::default();
    for number in 0..7 {
        let step = step(number as f32, number == 4 || number == 6);
        recent.add(Some(step), n, 0.5, &mut replay);
    }
    assert_eq!(replay.len(), 7);
    let batch = replay.draw(500, &Streams::new(1, 0), 0);
    let mut rows = Vec::new();
    for row in 0..500 {
        let past = |which: usize| {
            let known = batch.pasts[which].known[row] as usize;
            let all = &batch.pasts[which].observations[row * ticks..(row + 1) * ticks];
            all[ticks - known..].to_vec()
        };
        let (seen, next) = (batch.observations[row], batch.next_observations[row]);
        rows.push(format!("{seen} {:?} {next} {:?}", past(0), past(1)));
    }
    rows.sort();
    rows.dedup();
    rows
}

#[test]
fn history_goes_back_to_where_the_flight_began() {
    assert_eq!(
        remembered(2, 1),
        [
            "0 [] 1 [0.0]",
            "1 [0.0] 2 [0.0, 1.0]",
            "2 [0.0, 1.0] 3 [1.0, 2.0]",
            "3 [1.0, 2.0] 4 [2.0, 3.0]",
            "4 [2.0, 3.0] 5 [3.0, 4.0]",
            "5 [] 6 [5.0]",
            "6 [5.0] 7 [5.0, 6.0]",
        ]
    );
}

#[test]
fn history_of_the_next_observation_is_of_the_ticks_before_it() {
    let rows = remembered(2, 3);
    assert_eq!(rows[0], "0 [] 3 [1.0, 2.0]");
    assert_eq!(rows[1], "1 [0.0] 4 [2.0, 3.0]");
    // The flight ends after step 4: fewer rewards, the same ticks.
    assert_eq!(rows[3], "3 [1.0, 2.0] 5 [3.0, 4.0]");
    assert_eq!(rows[5], "5 [] 7 [5.0, 6.0]");
}
