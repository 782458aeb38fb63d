use super::*;

fn error_of(text: &str) -> String {
    check_text("x.trace", text).unwrap_err().to_string()
}

#[test]
fn an_unknown_key_names_its_line() {
    let error = error_of("network reflex\nspeed 3\n---\n");
    assert!(error.starts_with("x.trace:2: speed 3; expected network or loop NAME"), "{error}");
}

#[test]
fn a_number_beyond_its_limit_is_refused() {
    let error = error_of("network reflex\ndecisions 10001\n---\n");
    assert!(error.starts_with("x.trace:2: decisions 10001; expected a whole number"), "{error}");
}

#[test]
fn a_trace_needs_a_kind() {
    assert_eq!(
        error_of("seed 1\n"),
        "x.trace:1: network nothing; expected one of `network NAME` and `loop NAME`"
    );
}

#[test]
fn unknown_networks_policies_and_arenas_are_named() {
    assert!(error_of("network nobody\n").starts_with("x.trace: nobody: neither a file"));
    assert!(
        error_of("network reflex\npolicy p\n").starts_with("x.trace: policy p: no such policy")
    );
    assert!(error_of("loop reflex\narena nowhere\n").starts_with("x.trace: "));
}

#[test]
fn what_a_trace_cannot_have_is_refused() {
    let refused = |head: &str, expected: &str| {
        let error = error_of(head);
        assert!(error.starts_with(expected), "{error}");
    };
    refused("network reflex\nschedule held\n", "x.trace: reflex: schedule is for an EEM-SAN");
    refused("network reflex\non_chip loihi9\n", "x.trace: chip loihi9: no such built-in chip");
    refused("network reflex\non_chip no.toml\n", "x.trace: no.toml: ");
    refused("network reflex\nneurons_per_core 0\n", "x.trace:2: neurons_per_core 0; expected 1");
    for line in ["policy fine", "schedule held", "on_chip loihi1", "neurons_per_core 9"] {
        let head = format!("loop reflex\n{line}\ndriver float\nticks 1\n");
        refused(&head, &format!("x.trace:2: {line}; expected no such line"));
    }
}

#[test]
fn a_trace_has_its_own_chip_and_split() {
    let file = std::env::temp_dir().join(format!("spikeloop-chip-{}.toml", std::process::id()));
    let built_in = include_str!("../hw_model/chips/loihi1.toml");
    std::fs::write(&file, built_in.replace("cores = 128", "cores = 64")).unwrap();
    let lines =
        |more: &str| updated_text("x.trace", &format!("network reflex\ndecisions 1\n{more}"));
    let cores = |text: &str| text.lines().filter(|line| line.starts_with("t=0003 ")).count();
    let (plain, split) = (lines("").unwrap(), lines("neurons_per_core 1\n").unwrap());
    assert!(cores(&split) > cores(&plain), "{split}");
    let mine = lines(&format!("on_chip {}\n", file.display())).unwrap();
    let map = |text: &str| text.lines().find(|line| line.starts_with("map ")).map(str::to_owned);
    std::fs::remove_file(&file).unwrap();
    assert_ne!(map(&mine), map(&plain));
}

#[test]
fn a_changed_line_is_found_with_both_sides() {
    let good = updated_text("x.trace", "network reflex\ndecisions 1\n").unwrap();
    assert!(check_text("x.trace", &good).is_ok());
    let at = good.find("t=0003").expect("a line of step 3");
    let mut bad = good.clone();
    bad.replace_range(at..at + 6, "t=9993");
    let error = error_of(&bad);
    assert!(error.contains("- t=9993") && error.contains("+ t=0003"), "{error}");
}

#[test]
fn recording_keeps_the_head_and_is_stable() {
    let head = "; what it is\nloop reflex\nticks 3\n";
    let once = updated_text("x.trace", head).unwrap();
    assert!(once.starts_with(head));
    assert_eq!(updated_text("x.trace", &once).unwrap(), once);
}
