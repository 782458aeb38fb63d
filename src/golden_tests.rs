use super::*;

fn error_of(text: &str) -> String {
    check_text("x.trace", text).unwrap_err().to_string()
}

#[test]
fn an_unknown_key_names_its_line() {
    let error = error_of("network reflex\nspeed 3\n---\n");
    assert_eq!(
        error,
        "x.trace:2: speed 3; expected a line KEY VALUE with one of the keys network, loop, policy, \
         weight_bits, schedule, on_chip, neurons_per_core, cores, seed, decisions, driver, arena, trial, \
         ticks, v_max_mm_per_s, actuators, each at most once"
    );
}

#[test]
fn a_number_beyond_its_limit_is_refused() {
    for (head, expected) in [
        (
            "network reflex\ndecisions 10001\n",
            "2: decisions 10001; expected a whole number of 1 to 10000",
        ),
        ("network reflex\ndecisions 0\n", "2: decisions 0; expected a whole number of 1 to 10000"),
        ("loop reflex\nticks 0\n", "2: ticks 0; expected a whole number of 1 to 10000"),
        ("loop reflex\ntrial 10000\n", "2: trial 10000; expected a whole number of 0 to 9999"),
        (
            "loop reflex\nticks 1\nv_max_mm_per_s 0\n",
            "3: v_max_mm_per_s 0; expected a whole number of 1 to 10000",
        ),
        (
            "network reflex\nseed -1\n",
            "2: seed -1; expected a whole number of 0 to 18446744073709551615",
        ),
        ("network reflex\ncores 0\n", "2: cores 0; expected a whole number of 1 to 4294967295"),
    ] {
        assert_eq!(error_of(head), format!("x.trace:{expected}"));
    }
}

#[test]
fn a_trace_needs_a_kind() {
    let error = "x.trace: no line `chip NAME`, `network NAME` or `loop NAME`, one of which says what is \
                 traced; see traces/README.md";
    assert_eq!([error_of("seed 1\n"), error_of("")], [error, error]);
    let error = error_of("network reflex\nloop reflex\n");
    assert!(error.starts_with("x.trace:2: loop reflex; expected no such line, as"), "{error}");
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
    refused(
        "network reflex\nneurons_per_core 9\ncores 9\n",
        "x.trace:3: cores 9; expected no such",
    );
    refused("network reflex\nweight_bits 9\n", "x.trace: weight bits = 9, must be 2..=8");
    refused(
        "loop reflex\nactuators lag-9\n",
        "x.trace:2: actuators lag-9; expected actuators that go (",
    );
    refused(
        "loop reflex\ndecisions 2\n",
        "x.trace:2: decisions 2; expected no such line, which is of n",
    );
    for line in
        ["driver float", "arena map1", "trial 3", "ticks 3", "v_max_mm_per_s 9", "actuators lag"]
    {
        let head = format!("network reflex\n{line}\n");
        refused(
            &head,
            &format!("x.trace:2: {line}; expected no such line, which is of loop traces"),
        );
    }
    for line in [
        "policy fine",
        "weight_bits 4",
        "schedule held",
        "on_chip loihi1",
        "neurons_per_core 9",
        "cores 9",
    ] {
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
    let shared_out = lines("cores 9\n").unwrap();
    assert!((cores(&plain) + 1..=9).contains(&cores(&shared_out)), "{shared_out}");
    assert_ne!(lines("weight_bits 3\n").unwrap(), plain);
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
