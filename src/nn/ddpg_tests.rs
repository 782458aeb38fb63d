use super::*;
use crate::nn::gradient_check::gaussians;
use crate::nn::variant::{Thresholds, VARIANTS, Variant};

fn shapes() -> (ActorShape, CriticShape) {
    let actor = ActorShape {
        laser: vec![(-1.0, 1.0); 3],
        dvs: vec![(-1.0, 1.0); 2],
        population: 5,
        fused: 8,
        hidden: vec![16, 16],
        ..ActorShape::eem_san()
    };
    (actor, CriticShape { observations: 5, actions: 2, hidden: vec![24, 24] })
}

fn learner(settings: DdpgSettings) -> Ddpg {
    let (actor, critic) = shapes();
    Ddpg::new(&settings, &actor, &critic, 5)
}

struct Data {
    observations: Vec<f32>,
    next: Vec<f32>,
    actions: Vec<f32>,
    rewards: Vec<f32>,
    terminal: Vec<f32>,
}

impl Data {
    fn new(rows: usize, terminal: f32) -> Self {
        let actions: Vec<f32> =
            gaussians(3, rows * 2).iter().map(|a| (0.5 + 0.3 * a).clamp(0.0, 1.0)).collect();
        // The left wheel is worth something, the right one costs as much.
        let rewards = actions.chunks(2).map(|a| a[0] - a[1]).collect();
        let (observations, next) = (gaussians(1, rows * 5), gaussians(2, rows * 5));
        Self { observations, next, actions, rewards, terminal: vec![terminal; rows] }
    }

    fn batch(&self) -> Transitions<'_> {
        Transitions {
            observations: &self.observations,
            actions: &self.actions,
            rewards: &self.rewards,
            next_observations: &self.next,
            terminal: &self.terminal,
            judged: None,
            history: None,
        }
    }
}

fn settings(count: usize, threads: usize) -> DdpgSettings {
    DdpgSettings { shards: Shards { count, threads }, ..DdpgSettings::default() }
}

fn after(mut ddpg: Ddpg, updates: usize) -> Ddpg {
    let data = Data::new(10, 0.0);
    (0..updates).for_each(|_| {
        ddpg.update(&data.batch(), &Streams::new(9, 0));
    });
    ddpg
}

#[test]
fn results_depend_on_shards_only_by_rounding_and_not_on_threads() {
    let two = after(learner(settings(2, 1)), 5);
    let threads = after(learner(settings(2, 2)), 5);
    assert_eq!(two.actor, threads.actor);
    assert_eq!(two.critics, threads.critics);
    // Gradients themselves: Adam's first steps enlarge any difference.
    let data = Data::new(10, 0.0);
    let ddpg = learner(settings(1, 1));
    let streams = Streams::new(9, 0);
    let whole = ddpg.actor_shard(&data.batch(), None, &Objective::PLAIN, &streams, 0..10).0;
    let parts = [0..3, 3..10]
        .map(|range| ddpg.actor_shard(&data.batch(), None, &Objective::PLAIN, &streams, range).0);
    let largest = whole.iter().fold(0.0f32, |largest, d| largest.max(d.abs()));
    assert!(largest > 0.0);
    for (sum, whole) in shards::sum(parts.to_vec()).iter().zip(&whole) {
        assert!((sum - whole).abs() <= 1e-4 * largest, "{sum} {whole}");
    }
    let whole = ddpg.critic_shard(&data.batch(), &streams, 0..10).remove(0);
    let parts = [0..3, 3..10].map(|r| ddpg.critic_shard(&data.batch(), &streams, r).remove(0));
    assert!((whole.1 - parts[0].1 - parts[1].1).abs() < 1e-6);
    for (sum, whole) in shards::sum(parts.map(|part| part.0).to_vec()).iter().zip(&whole.0) {
        assert!((sum - whole).abs() < 1e-5, "{sum} {whole}");
    }
}

#[test]
fn wanted_value_is_reward_and_discounted_target() {
    let ddpg = learner(settings(1, 1));
    let (data, ended) = (Data::new(4, 0.0), Data::new(4, 1.0));
    let streams = Streams::new(9, 0);
    assert_eq!(ddpg.wanted(&ended.batch(), &streams, &(0..4)), ended.rewards);
    let draws = ddpg.draws(&streams, stream::POPULATION_SPIKES_NEXT, &(0..4));
    let acted: ActorTrace<Rectangular> =
        ddpg.actor_layers.forward(&ddpg.actor.target.values, &data.next, &draws);
    let q = ddpg.critic_layers.forward(&ddpg.critics[0].target.values, &data.next, &acted.action);
    for (row, wanted) in ddpg.wanted(&data.batch(), &streams, &(0..4)).iter().enumerate() {
        assert_eq!(*wanted, data.rewards[row] + 0.99 * q.value[row]);
    }
}

#[test]
fn smaller_of_twin_critics_counts() {
    let twin = learner(DdpgSettings { twin_critics: true, ..settings(1, 1) });
    let mut single = twin.clone();
    let mut second = twin.clone();
    single.critics.truncate(1);
    second.critics.remove(0);
    let (data, streams) = (Data::new(6, 0.0), Streams::new(9, 0));
    let [both, first, second] =
        [&twin, &single, &second].map(|d| d.wanted(&data.batch(), &streams, &(0..6)));
    for row in 0..6 {
        assert_eq!(both[row], first[row].min(second[row]));
        assert_ne!(first[row], second[row]);
    }
}

#[test]
fn critic_loss_falls_and_actor_goes_where_value_is() {
    let mut ddpg = learner(DdpgSettings {
        actor: AdamSettings::with_rate(5e-3),
        critic: AdamSettings::with_rate(5e-3),
        ..settings(2, 1)
    });
    // A net this small is nearly silent with the usual weights.
    let layout = ddpg.actor.online.layout().clone();
    for entry in layout.entries().iter().filter(|entry| entry.name.ends_with("weight")) {
        let weights = entry.slot.of_mut(&mut ddpg.actor.online.values);
        weights.iter_mut().for_each(|weight| *weight *= 3.0);
    }
    let data = Data::new(32, 1.0);
    let streams = Streams::new(9, 0);
    let losses: Vec<Losses> = (0..200).map(|_| ddpg.update(&data.batch(), &streams)).collect();
    let (first, last) = (losses[0], losses[199]);
    assert!(last.critic < 0.1 * first.critic, "{first:?} {last:?}");
    assert!(last.actor < -0.5, "{first:?} {last:?}");
    assert_eq!(ddpg.updates(), 200);
}

#[test]
fn targets_follow_by_tau() {
    let before = learner(settings(1, 1));
    let now = after(before.clone(), 1);
    assert_ne!(before.actor.online, now.actor.online);
    let (old, new) = (&before.actor.target.values, &now.actor.online.values);
    for (at, target) in now.actor.target.values.iter().enumerate() {
        assert!((target - (0.99 * old[at] + 0.01 * new[at])).abs() < 1e-6);
    }
}

#[test]
fn a_saved_run_goes_on_byte_for_byte() {
    let twin = DdpgSettings { twin_critics: true, ..settings(2, 2) };
    let halfway = after(learner(twin), 3);
    let mut state = StateWriter::default();
    halfway.write(&mut state);
    let bytes = state.bytes();
    let mut resumed = Ddpg::new(&twin, &shapes().0, &shapes().1, 77);
    resumed.read(&StateReader::new("run", &bytes).unwrap()).unwrap();
    let (resumed, whole) = (after(resumed, 3), after(halfway, 3));
    let [a, b] = [&resumed, &whole].map(|ddpg| {
        let mut state = StateWriter::default();
        ddpg.write(&mut state);
        state.bytes()
    });
    assert!(a == b, "states differ");
    assert_ne!(a, bytes);
}

#[test]
fn state_of_another_shape_is_refused_and_changes_nothing() {
    let mut state = StateWriter::default();
    learner(settings(1, 1)).write(&mut state);
    let bytes = state.bytes();
    let (actor, critic) = shapes();
    let wider = CriticShape { hidden: vec![24, 25], ..critic };
    let mut other = Ddpg::new(&settings(1, 1), &actor, &wider, 6);
    let before = other.clone();
    let error = other.read(&StateReader::new("run", &bytes).unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "run: tensor critic1.2.weight: F32 [24, 26] found, F32 or F16 [25, 26] expected"
    );
    assert_eq!((before.actor, before.critics), (other.actor, other.critics));
}

/// Costs that rise with the distance to an action, and that action.
fn guide_of(actions: &[f32]) -> Vec<f32> {
    let cost = |action: &[f32], at: usize| {
        let (left, right) = ((at / 6) as f32 / 5.0, (at % 6) as f32 / 5.0);
        (left - action[0]).abs() + (right - action[1]).abs()
    };
    actions.chunks(2).flat_map(|action| (0..36).map(move |at| cost(action, at))).collect()
}

#[test]
fn guide_pulls_the_action_towards_the_cheapest() {
    let wanted = [0.8, 0.2, 0.4, 0.6];
    let costs = guide_of(&wanted);
    let guide = Guide { levels: 6, actions: &wanted, costs: &costs };
    let objective = Objective { value: 0.0, imitation: 1.0, cost: 1.0, cost_max: 10.0 };
    let mut d = vec![0.0; 4];
    let loss = guide.follow(&objective, &[0.4, 0.6, 0.4, 0.6], &(0..2), 2.0, &mut d);
    // First row: squares 0.16 + 0.16, cost 0.8, mean over two rows; second row: nothing.
    assert!((loss - (0.32 + 0.8) / 2.0).abs() < 1e-6, "{loss}");
    let expected = [(2.0 * -0.4 - 1.0) / 2.0, (2.0 * 0.4 + 1.0) / 2.0, 0.0, 0.0];
    for (d, expected) in d.iter().zip(expected) {
        assert!((d - expected).abs() < 1e-5, "{d} {expected}");
    }
}

#[test]
fn costs_above_the_limit_have_no_slope() {
    let costs = guide_of(&[1.0, 1.0]);
    let guide = Guide { levels: 6, actions: &[1.0, 1.0], costs: &costs };
    assert_eq!(guide.cost(0, &[0.0, 0.0], 0.5), (0.5, [0.0, 0.0]));
    let (cost, slopes) = guide.cost(0, &[0.8, 1.0], 10.0);
    assert!((cost - 0.2).abs() < 1e-6 && slopes[0] < -0.9, "{cost} {slopes:?}");
}

#[test]
fn critics_may_see_other_things_than_the_actor() {
    let data = Data::new(10, 0.0);
    let (before, after) = (gaussians(7, 30), gaussians(8, 30));
    let batch = Transitions { judged: Some([&before, &after]), ..data.batch() };
    let critic = CriticShape { observations: 3, actions: 2, hidden: vec![8; 2] };
    let mut ddpg = Ddpg::new(&settings(2, 1), &shapes().0, &critic, 1);
    let first = ddpg.update(&batch, &Streams::new(9, 0));
    let swapped = Transitions { judged: Some([&after, &before]), ..data.batch() };
    let mut other = Ddpg::new(&settings(2, 1), &shapes().0, &critic, 1);
    let second = other.update(&swapped, &Streams::new(9, 0));
    assert!(first.critic.is_finite() && first.critic != second.critic);
}

#[test]
fn laser_only_actor_begins_one_with_events() {
    let with_events = shapes().0;
    let alone = ActorShape { dvs: Vec::new(), ..with_events.clone() };
    let critic = |shape: &ActorShape| CriticShape {
        observations: shape.observations(),
        actions: 2,
        hidden: vec![8; 2],
    };
    let teacher = Ddpg::new(&settings(1, 1), &alone, &critic(&alone), 5);
    let mut state = StateWriter::default();
    state.parameters("actor.", &teacher.actor.online);
    let bytes = state.bytes();
    let state = StateReader::new("weights", &bytes).unwrap();
    let mut ddpg = Ddpg::new(&settings(1, 1), &with_events, &critic(&with_events), 6);
    let fresh = ddpg.actor.online.tensor("fuse.dvs.weight").unwrap().to_vec();
    ddpg.begin_with(&state, "actor.").unwrap();
    for name in ["fuse.laser.weight", "decision.1.weight", "population.laser.mean"] {
        let taken = ddpg.actor.online.tensor(name);
        assert_eq!(taken, teacher.actor.online.tensor(name), "{name}");
    }
    let quiet = ddpg.actor.online.tensor("fuse.dvs.weight").unwrap();
    assert!(quiet.iter().zip(&fresh).all(|(quiet, fresh)| (quiet - 0.1 * fresh).abs() < 1e-7));
    assert_eq!(ddpg.actor.target, ddpg.actor.online);
}

#[test]
fn an_actor_with_events_is_taken_whole_by_one_of_its_form() {
    let (shape, critic) = shapes();
    for form in VARIANTS.iter().filter(|variant| variant.events).map(|variant| variant.form) {
        let shape = ActorShape { form, ..shape.clone() };
        let teacher = Ddpg::new(&settings(1, 1), &shape, &critic, 5);
        let mut state = StateWriter::default();
        state.parameters("actor.", &teacher.actor.online);
        let bytes = state.bytes();
        let state = StateReader::new("weights", &bytes).unwrap();
        let mut ddpg = Ddpg::new(&settings(1, 1), &shape, &critic, 6);
        assert_ne!(ddpg.actor.online, teacher.actor.online);
        ddpg.begin_with(&state, "actor.").unwrap();
        assert_eq!(ddpg.actor.online, teacher.actor.online, "{form}");
        assert_eq!(ddpg.actor.target, ddpg.actor.online);
    }
}

#[test]
fn actor_of_another_form_is_refused_and_nothing_is_changed() {
    let (shape, critic) = shapes();
    let fixed = Form { thresholds: Thresholds::Fixed, ..Form::EEM_SAN };
    let other = ActorShape { form: fixed, ..shape };
    let mut state = StateWriter::default();
    let other = Ddpg::new(&settings(1, 1), &other, &critic, 5);
    state.parameters("actor.", &other.actor.online);
    let bytes = state.bytes();
    let mut ddpg = learner(settings(1, 1));
    let before = ddpg.actor.clone();
    let weights = StateReader::new("w", &bytes).unwrap();
    let error = ddpg.begin_with(&weights, "actor.").unwrap_err().to_string();
    assert_eq!(
        error,
        "w: holds an actor with population code, middle fusion, fixed thresholds, one with \
         population code, middle fusion, learned thresholds is trained; give weights of that kind, \
         or none"
    );
    assert_eq!(ddpg.actor, before);
}

#[test]
fn an_update_runs_through_what_was_seen_before_and_no_farther_than_the_trial() {
    let (shape, critic) = shapes();
    let form = Variant::named("bdett").unwrap().form;
    let data = Data::new(10, 0.0);
    let pasts =
        [1.0, 3.0].map(|scale| gaussians(4, 10 * 2 * 5).iter().map(|x| scale * x).collect());
    let updated = |past: &Vec<f32>, known: f32, shards: Shards| {
        let settings = DdpgSettings { shards, ..settings(1, 1) };
        let mut ddpg = Ddpg::new(&settings, &ActorShape { form, ..shape.clone() }, &critic, 5);
        let known = [known; 10];
        let history = History { ticks: 2, observations: past, known: &known };
        let batch = Transitions { history: Some([history; 2]), ..data.batch() };
        let losses = ddpg.update(&batch, &Streams::new(9, 0));
        (ddpg.actor.online.values, losses.critic)
    };
    let shards = |threads| Shards { count: 2, threads };
    let [near, far]: [Vec<f32>; 2] = pasts;
    assert_ne!(updated(&near, 2.0, shards(1)), updated(&far, 2.0, shards(1)));
    assert_eq!(updated(&near, 0.0, shards(1)), updated(&far, 0.0, shards(1)));
    assert_eq!(updated(&near, 2.0, shards(1)), updated(&near, 2.0, shards(2)));
}
