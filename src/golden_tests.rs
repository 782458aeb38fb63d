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
