use super::*;

fn step(number: f32) -> Step {
    Step {
        observation: vec![number, 1.0],
        action: [2.0, 3.0],
        reward: number,
        next_observation: vec![number + 1.0, 5.0],
        insight: vec![6.0],
        next_insight: vec![7.0],
        terminal: 0.0,
        ended: false,
        planned: [8.0, 9.0],
        costs: [number; ACTIONS],
    }
}

#[test]
fn memory_keeps_the_newest() {
    let mut replay = Replay::new(2, 1, 3);
    (0..5).for_each(|n| replay.push(&step(n as f32), [&Past::new(); 2]));
    assert_eq!((replay.len(), replay.pushed()), (3, 5));
    let batch = replay.draw(200, &Streams::new(1, 0), 0);
    let mut seen = batch.rewards.clone();
    seen.sort_by(f32::total_cmp);
    seen.dedup();
    assert_eq!(seen, [2.0, 3.0, 4.0]);
    for (row, reward) in batch.rewards.iter().enumerate() {
        assert_eq!(batch.observations[2 * row..2 * row + 2], [*reward, 1.0]);
        assert_eq!(batch.next_observations[2 * row..2 * row + 2], [reward + 1.0, 5.0]);
        assert_eq!((batch.insights[row], batch.next_insights[row]), (6.0, 7.0));
        assert_eq!(batch.actions[2 * row..2 * row + 2], [2.0, 3.0]);
        assert_eq!(batch.planned[2 * row..2 * row + 2], [8.0, 9.0]);
        assert_eq!(batch.costs[ACTIONS * row], *reward);
    }
}

#[test]
fn saved_memory_draws_the_same_and_goes_on_the_same() {
    let mut replay = Replay::new(2, 1, 4);
    (0..6).for_each(|n| replay.push(&step(n as f32), [&Past::new(); 2]));
    let mut state = StateWriter::default();
    replay.write(&mut state);
    let bytes = state.bytes();
    let mut read = Replay::new(2, 1, 4);
    read.read(&StateReader::new("f", &bytes).unwrap()).unwrap();
    assert_eq!(read, replay);
    let mut other = Replay::new(3, 1, 4);
    assert!(other.read(&StateReader::new("f", &bytes).unwrap()).is_err());
}

#[test]
fn joined_steps_have_discounted_rewards_and_discount() {
    let steps = [step(1.0), step(2.0), step(4.0)];
    let joined = Step::joined(&steps, 0.5);
    assert_eq!(joined.reward, 1.0 + 0.5 * 2.0 + 0.25 * 4.0);
    assert_eq!(joined.observation, steps[0].observation);
    assert_eq!(joined.next_observation, steps[2].next_observation);
    // Three steps: the rest counts 0.125, of which the update multiplies 0.5 itself.
    assert_eq!(1.0 - joined.terminal, 0.25);
    let last = Step { terminal: 1.0, ended: true, ..step(0.0) };
    assert_eq!(Step::joined([&steps[0], &last], 0.5).terminal, 1.0);
}

#[test]
fn history_is_the_newest_ticks_of_the_flight_padded_in_front() {
    let mut replay = Replay::new(2, 1, 3).with_history(3);
    let past = |numbers: &[f32]| numbers.iter().map(|n| vec![*n, -n]).collect::<Past>();
    replay.push(&step(1.0), [&past(&[5.0]), &past(&[5.0, 6.0, 7.0, 8.0])]);
    let batch = replay.draw(2, &Streams::new(1, 0), 0);
    assert_eq!(batch.costs.len(), 2 * ACTIONS);
    for (pasts, known, ticks) in [
        (&batch.pasts[0], 1.0, [0.0, 0.0, 0.0, 0.0, 5.0, -5.0]),
        (&batch.pasts[1], 3.0, [6.0, -6.0, 7.0, -7.0, 8.0, -8.0]),
    ] {
        assert_eq!(pasts.known, [known; 2]);
        assert_eq!(pasts.observations, [ticks, ticks].concat());
    }
    // A shorter past in the same place leaves nothing of the one before.
    (0..3).for_each(|_| replay.push(&step(2.0), [&Past::new(); 2]));
    let batch = replay.draw(4, &Streams::new(1, 0), 1);
    assert_eq!(batch.pasts[1].known, [0.0; 4]);
    assert!(batch.pasts[1].observations.iter().all(|x| *x == 0.0));
    let mut state = StateWriter::default();
    replay.write(&mut state);
    let bytes = state.bytes();
    let mut read = Replay::new(2, 1, 3).with_history(3);
    read.read(&StateReader::new("f", &bytes).unwrap()).unwrap();
    assert_eq!(read, replay);
}
