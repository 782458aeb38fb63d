use super::*;
use crate::net::{Controller, builtin};

const HSVAE: &str = include_str!("configs/hsvae.toml");
const TOLD: &str = include_str!("configs/told.toml");
const FRESH: &str = include_str!("configs/fresh_encoder.toml");
const COMPARE: &str = include_str!("configs/compare.toml");
const COMPARE_E2E: &str = include_str!("configs/compare_e2e.toml");
const STREAMING: &str = include_str!("configs/streaming.toml");
const E2E: &str = include_str!("configs/e2e.toml");
const TOLD_ACTOR: &str = include_str!("configs/told_actor.toml");
const ACTORS: [&str; 11] = [
    include_str!("configs/first.toml"),
    include_str!("configs/second.toml"),
    include_str!("configs/third.toml"),
    include_str!("configs/fourth.toml"),
    include_str!("configs/fifth.toml"),
    include_str!("configs/plain.toml"),
    STREAMING,
    E2E,
    COMPARE,
    COMPARE_E2E,
    TOLD_ACTOR,
];

#[test]
fn an_actor_that_is_told_is_the_fifth_stage_with_events_and_without_an_encoder() {
    let told = ActorConfig::from_toml("f.toml", TOLD_ACTOR).unwrap();
    let fifth = ActorConfig::from_toml("f.toml", include_str!("configs/fifth.toml")).unwrap();
    assert!(told.told);
    assert_eq!(ActorConfig { told: false, ..told.clone() }, fifth);
    assert_eq!(told.variant(false).unwrap().name, "eem-san");
    let error = told.variant(true).unwrap_err().to_string();
    assert!(error.ends_with("leave --encoder out"), "{error}");
    let late = TOLD_ACTOR.replacen("told = true", "told = true\nreadout_delay_frames = 1", 1);
    let error = ActorConfig::from_toml("f.toml", &late).unwrap_err().to_string();
    assert!(error.contains("readout_delay_frames must be 0"), "{error}");
}

fn hsvae_error(from: &str, to: &str) -> String {
    assert!(HSVAE.contains(from), "{from:?} is not in the file");
    HsvaeConfig::from_toml("f.toml", &HSVAE.replacen(from, to, 1)).unwrap_err().to_string()
}

fn actor_error(from: &str, to: &str) -> String {
    assert!(ACTORS[0].contains(from), "{from:?} is not in the file");
    ActorConfig::from_toml("f.toml", &ACTORS[0].replacen(from, to, 1)).unwrap_err().to_string()
}

/// One setting of the selection is `bad`, the others are fine.
fn selection_error(bad: &str) -> String {
    let fine = ["every = 1", "n_rooms = 1", "flights_per_room = 1"];
    let named = |setting: &&&str| setting.split(' ').next() != bad.split(' ').next();
    let lines: Vec<&str> = fine.iter().filter(named).copied().chain([bad]).collect();
    actor_error("[flight]", &format!("[selection]\n{}\n[flight]", lines.join("\n")))
}

fn network_error(setting: &str) -> String {
    actor_error("[flight]", &format!("[network]\n{setting}\n[flight]"))
}

#[test]
fn variant_goes_with_the_encoder_or_is_refused() {
    let mut config = ActorConfig::from_toml("f", ACTORS[0]).unwrap();
    let name = |config: &ActorConfig, events: bool| config.variant(events).map(|row| row.name);
    assert_eq!(name(&config, true).unwrap(), "eem-san");
    assert_eq!(name(&config, false).unwrap(), "laser-only");
    for row in VARIANTS {
        config.network.variant = Some(row.name.to_owned());
        assert_eq!(config.variant(row.events).unwrap(), &row);
        let error = config.variant(!row.events).unwrap_err().to_string();
        let part = if row.events { "give one with --encoder" } else { "leave --encoder out" };
        assert!(error.starts_with(&format!("configuration: network.variant {} ", row.name)));
        assert!(error.ends_with(part), "{error}");
    }
    config.network.variant = Some("bdett".to_owned());
    config.action_delay_ticks = 2;
    let error = config.variant(false).unwrap_err().to_string();
    assert!(error.contains("bdett carries a state from tick to tick"), "{error}");
}

#[test]
fn configurations_that_ship_are_read() {
    let shows = |text: &str| HsvaeConfig::from_toml("hsvae.toml", text).unwrap().shows;
    assert_eq!([HSVAE, TOLD].map(shows), [Shows::Frames, Shows::Movers]);
    for text in ACTORS {
        ActorConfig::from_toml("actor", text).unwrap();
    }
}

#[test]
fn steps_of_the_auto_encoder_get_shorter_where_they_should() {
    let rates = |text: &str| {
        let config = HsvaeConfig::from_toml("hsvae.toml", text).unwrap();
        let all = config.rounds * config.updates_per_round();
        [0, all / 2, all, 2 * all].map(|updates| config.learning_rate_after(updates))
    };
    assert_eq!(rates(HSVAE), [2e-3; 4]);
    assert_eq!(rates(TOLD), [2e-3, 1e-3, 2e-3 * 0.03, 2e-3 * 0.03]);
}

#[test]
fn bad_numbers_are_refused_with_their_limits() {
    let cases = [
        (hsvae_error("rounds = ", "rounds = 0 #"), "f.toml: rounds is 0, must be 1..=1000000"),
        (
            hsvae_error("[flight]", "learning_rate_end = 1.5\n[flight]"),
            "learning_rate_end is 1.5, must be 0..=1",
        ),
        (
            hsvae_error("[flight]", "shows = \"walls\"\n[flight]"),
            "unknown variant `walls`, expected `frames` or `movers`",
        ),
        (hsvae_error("blur_px = ", "blur_px = 99 #"), "blur_px is 99, must be 1..=31"),
        (hsvae_error("worlds = ", "worlds = 0 #"), "flight.worlds is 0, must be 1..=256"),
        (hsvae_error("exploration = ", "exploration = 2.0 #"), "exploration is 2, must be 0..=1"),
        (actor_error("discount = ", "discount = 1.5 #"), "discount is 1.5, must be 0..=1"),
        (actor_error("critic_neurons = ", "critic_neurons = 0 #"), "critic_neurons is 0, must be"),
        (actor_error("memory = ", "memory = 10 #"), "memory is 10, must be"),
        (
            actor_error("reward_steps = ", "reward_steps = 0 #"),
            "reward_steps is 0, must be 1..=200",
        ),
        (
            actor_error("batch = ", "action_delay_ticks = 11\nbatch = "),
            "action_delay_ticks is 11, must be 0..=10",
        ),
        (actor_error("batch = ", "average = 1.5\nbatch = "), "average is 1.5, must be 0..=1"),
        (network_error("threshold = 1.0"), "network.threshold is 1, must be 0.02..=0.99"),
        (network_error("history_ticks = 17"), "network.history_ticks is 17, must be 0..=16"),
        (network_error("variant = \"ann\""), "network.variant \"ann\": no such network (there"),
        (selection_error("every = 0"), "selection.every is 0, must be 1..=1000000"),
        (selection_error("n_rooms = 0"), "selection.n_rooms is 0, must be 1..=1000"),
        (selection_error("flights_per_room = 0"), "selection.flights_per_room is 0, must be"),
        (
            actor_error(
                "[flight]",
                "[end_to_end]\nstretch_ticks = 0\ndraws = 1\nrate_weight = 0.5\n[flight]",
            ),
            "end_to_end.stretch_ticks is 0, must be 1..=64",
        ),
        (
            actor_error(
                "[flight]",
                "[end_to_end]\nstretch_ticks = 1\ndraws = 1\nrate_weight = -1.0\n[flight]",
            ),
            "end_to_end.rate_weight is -1, must be 0..=1000",
        ),
        (
            actor_error("actor_rate = ", "encoder_rate = 2.0\nactor_rate = "),
            "phases.encoder_rate is 2, must be 0..=1",
        ),
        (actor_error("planner_share = ", "planner_share = -1.0 #"), "planner_share is -1"),
        (actor_error("v_max_m_per_s = ", "v_max_m_per_s = 0.0 #"), "wheel speed (m/s) is 0"),
        (hsvae_error("blur_px = 9", "blur_px = 4"), "blur_px is 4, must be odd"),
    ];
    for (error, part) in cases {
        assert!(error.contains(part), "{error:?} does not say {part:?}");
    }
}

#[test]
fn a_stretch_longer_than_a_round_is_refused() {
    let longer = HSVAE.replace("stretch_ticks = 1", "stretch_ticks = 4");
    let error = |ticks: &str| {
        let text = longer.replace("ticks_per_round = 300", &format!("ticks_per_round = {ticks}"));
        HsvaeConfig::from_toml("f.toml", &text).err().map(|error| error.to_string())
    };
    assert_eq!(error("4"), None);
    let text = error("3").unwrap();
    assert!(text.starts_with("f.toml: stretch_ticks is 4, must be 1..=3"), "{text}");
    let quick = HsvaeConfig::from_toml("f.toml", &longer).unwrap().quick();
    assert!(quick.updates_per_round() > 0);
    let e2e = E2E.replace("ticks_per_round = 300", "ticks_per_round = 1");
    let text = ActorConfig::from_toml("f.toml", &e2e).unwrap_err().to_string();
    assert!(text.starts_with("f.toml: end_to_end.stretch_ticks is 2, must be 1..=1"), "{text}");
}

#[test]
fn bad_text_is_refused_with_its_place() {
    assert!(hsvae_error("seed = 1", "sead = 1").contains("unknown field `sead`"));
    assert!(hsvae_error("seed = 1", "seed = ").contains("f.toml: TOML parse error at line"));
    let error = hsvae_error("\"ideal\"", "\"fast\"");
    assert!(error.contains("actuators \"fast\": not understood"), "{error}");
    let error = actor_error("seed = 1", "seed = 1\nteacher = \"nobody\"");
    assert!(
        error.contains("unknown variant `nobody`, expected `everything` or `sensors`"),
        "{error}"
    );
    let rooms = format!("{HSVAE}\n[rooms]\nside_m = [18.0, 12.0]\n");
    assert!(HsvaeConfig::from_toml("f", &rooms).unwrap_err().to_string().contains("missing field"));
}

#[test]
fn the_streaming_recipe_is_as_late_as_a_chip_that_streams() {
    let config = ActorConfig::from_toml("f", STREAMING).unwrap();
    let Ok(Controller::EemSan(network)) = builtin::open("eem-san", None) else {
        panic!("eem-san is built in")
    };
    let (action_ticks, readout_frames) = (network.streamed_ticks(), network.streamed_frames());
    assert_eq!(config.delays(), Delays { action_ticks, readout_frames });
    let third = ActorConfig::from_toml("f", ACTORS[2]).unwrap();
    assert_eq!(third.delays(), Delays::default());
}

#[test]
fn the_recipe_of_e2e_is_that_of_the_comparison_but_for_what_the_encoder_needs() {
    let [of_all, e2e] =
        [COMPARE, COMPARE_E2E].map(|text| ActorConfig::from_toml("f", text).unwrap());
    let mut like = e2e.clone();
    (like.memory, like.network) = (of_all.memory, NetworkConfig::default());
    like.end_to_end = None;
    like.phases.iter_mut().for_each(|phase| phase.encoder_rate = 0.0);
    assert_eq!(like, of_all);
    assert!(e2e.end_to_end.is_some() && e2e.phases.iter().all(|phase| phase.encoder_rate > 0.0));
}

#[test]
fn auto_encoders_differ_only_where_they_say_so() {
    let of_hsvae = HsvaeConfig::from_toml("hsvae.toml", HSVAE).unwrap();
    let mut fresh = HsvaeConfig::from_toml("fresh_encoder.toml", FRESH).unwrap();
    assert_eq!((fresh.rounds, fresh.learning_rate), (1, 0.0));
    (fresh.rounds, fresh.learning_rate) = (of_hsvae.rounds, of_hsvae.learning_rate);
    fresh.flight = of_hsvae.flight.clone();
    assert_eq!(fresh, of_hsvae);
    for (kind, text) in [
        (EncoderKind::Avae, include_str!("configs/avae.toml")),
        (EncoderKind::Fsvae, include_str!("configs/fsvae.toml")),
    ] {
        let mut other = HsvaeConfig::from_toml(kind.name(), text).unwrap();
        assert_eq!(other.kind, kind);
        (other.kind, other.rate_weight) = (of_hsvae.kind, of_hsvae.rate_weight);
        (other.decoder_gain, other.decoder_bias) = (of_hsvae.decoder_gain, of_hsvae.decoder_bias);
        assert_eq!(other, of_hsvae);
    }
}

#[test]
fn rounds_find_their_phase() {
    let config = ActorConfig::from_toml("f", ACTORS[0]).unwrap();
    let first = config.phases[0].rounds;
    assert_eq!(config.phase(0), (&config.phases[0], 0.0));
    assert_eq!(config.phase(first), (&config.phases[1], 0.0));
    assert_eq!(config.phase(config.rounds()), (config.phases.last().unwrap(), 1.0));
}
