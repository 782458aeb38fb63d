use super::*;

fn refuse(text: &str) -> String {
    text.parse::<Actuators>().unwrap_err().to_string()
}

#[test]
fn presets_have_the_lags_of_their_description() {
    let lags = |name: &str| {
        let Actuators { linear, angular } = name.parse().unwrap();
        [linear, angular].map(|lag| (lag.delay_s(), lag.time_constant_s()))
    };
    assert_eq!(lags("ideal"), [(0.0, 0.0), (0.0, 0.0)]);
    assert_eq!(lags("lag"), [(0.1, 0.3), (0.1, 0.3)]);
    assert_eq!(lags("lag-0.4"), [(0.1, 0.4), (0.1, 0.4)]);
    assert_eq!(lags("lag-split-a"), [(0.2, 0.15), (0.1, 0.35)]);
    assert_eq!(lags("lag-split-b"), [(0.3, 0.15), (0.2, 0.3)]);
}

#[test]
fn text_parses_back_and_presets_keep_their_names() {
    for (name, preset) in PRESETS {
        assert_eq!(preset.to_string(), name);
    }
    let own: Actuators = "v:0.07+0.155,w:2+10".parse().unwrap();
    assert_eq!(own.to_string(), "v:0.07+0.155,w:2+10");
    assert_eq!(own.linear.delay_steps(), 7);
    let split_a: Actuators = "v:0.2+0.15,w:0.1+0.35".parse().unwrap();
    assert_eq!(split_a.to_string(), "lag-split-a");
}

#[test]
fn refused_texts_say_what_is_wrong() {
    assert_eq!(
        refuse("slow"),
        "actuators \"slow\": not understood; use ideal, lag, lag-0.4, lag-split-a, lag-split-b or \
         v:0.2+0.15,w:0.1+0.35 (delay+time constant in s of the linear and the angular speed)"
    );
    for text in ["", "v:0.1,w:0.1", "w:0+0,v:0+0", "v:0+0", "v:a+0,w:0+0", "v:0+0,w:0+0,"] {
        assert!(refuse(text).contains("not understood"), "{text}");
    }
    assert_eq!(
        refuse("v:0.015+0,w:0+0"),
        "command delay 0.015 s, must be 0..=2 s (DELAY_S_MAX) in steps of 0.01 s"
    );
    assert!(refuse("v:0+0,w:2.01+0").starts_with("command delay 2.01 s"));
    assert!(refuse("v:nan+0,w:0+0").starts_with("command delay NaN s"));
    assert!(refuse("v:-0.1+0,w:0+0").starts_with("command delay -0.1 s"));
    assert_eq!(
        refuse("v:0+-1,w:0+0"),
        "time constant -1 s, must be 0 or 0.001..=10 s (TIME_CONSTANT_S_MAX)"
    );
    assert!(refuse("v:0+inf,w:0+0").starts_with("time constant inf s"));
}
