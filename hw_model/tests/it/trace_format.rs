//! The format of trace files: what reads, what is refused, what a failure says.

use std::sync::Arc;

use hw_model::id::CoreId;
use hw_model::trace::{Detail, SEPARATOR, observe, state_digest};
use hw_model::{DenseEngine, EventEngine, Trace};
use proptest::prelude::*;

use crate::random_map::config;

const HEAD: &str = "\
; one compartment that spikes when its input arrives
chip loihi1
detail compartment
core 000 label one
core 000 group cx=0000..0001 decay_u=2048 decay_v=1024 vth=5 bias=0<<0 refractory=2
core 000 format 0 mode=mixed bits=8 exp=0
core 000 list 0 entry format=0 dense first=0: 8
core 000 axon_in 0000 list=0 base=0
port in lines=2
port in line 1 -> core 000 axon 0000
input t=00 port=in line=1
input t=01..03 port=in line=1
run 5
";

/// Worked out by hand: u = 512, 256 + 512, 384 + 512, 448; v is above 320 in step 1 and, after
/// one step of refractory hold, in step 3.
const STATES: [&str; 4] = [
    "t=0001 core=000 cx=0000 u=+0000512 v=+0000000 s=1 r=01",
    "t=0002 core=000 cx=0000 u=+0000768 v=+0000000 s=0 r=00",
    "t=0003 core=000 cx=0000 u=+0000896 v=+0000000 s=1 r=01",
    "t=0004 core=000 cx=0000 u=+0000448 v=+0000000 s=0 r=00",
];

fn recorded() -> String {
    Trace::parse("a.trace", HEAD).unwrap().updated_text().unwrap()
}

fn parse_error(text: &str) -> String {
    Trace::parse("a.trace", text).unwrap_err().to_string()
}

fn error_after(from: &str, to: &str) -> String {
    assert_eq!(HEAD.matches(from).count(), 1, "`{from}` is not there once");
    parse_error(&HEAD.replace(from, to))
}

#[test]
fn recording_writes_states_totals_and_times_below_the_separator() {
    let text = recorded();
    let (head, below) = text.split_once(&format!("{SEPARATOR}\n")).unwrap();
    assert_eq!(head, HEAD);
    let below: Vec<&str> = below.lines().collect();
    assert_eq!(below[..4], STATES);
    assert_eq!(below[4], "total synaptic_ops_dense 3");
    assert!(below.contains(&"total updates_spiking 2"));
    assert!(below.contains(&"total barriers 5"));
    // Four busy steps: 2 x (3.5 + 8.4) with input and spike, 1 x the same without a spike,
    // 8.4 alone, 5.3 at rest; and five barriers of 113 ns.
    assert!(below.contains(&"time davies2018 ps 614400"), "{below:#?}");
    assert_eq!(below.len(), 4 + 19 + 2);
}

#[test]
fn a_recorded_trace_passes_and_updates_to_itself() {
    let trace = Trace::parse("a.trace", &recorded()).unwrap();
    assert_eq!(trace.check_all(), Ok(4));
    assert_eq!(trace.updated_text().unwrap(), recorded());
}

#[test]
fn an_update_rewrites_only_what_stands_below_the_separator() {
    let odd = HEAD.replace("run 5\n", "run 5   ; short  \n\n--- my own line ---\n");
    let updated = Trace::parse("a.trace", &format!("{odd}t=0001 nonsense\n")).unwrap();
    let updated = updated.updated_text().unwrap();
    assert!(updated.starts_with(&odd), "{updated}");
    assert!(!updated.contains("nonsense"));
}

#[test]
fn a_mismatch_names_file_line_engine_both_sides_and_the_remedy() {
    let wrong = recorded().replace("u=+0000448", "u=+0000449");
    let mismatch = Trace::parse("a.trace", &wrong).unwrap().check_all().unwrap_err();
    assert_eq!(
        mismatch.to_string(),
        format!(
            "a.trace:18: dense gives another result
    {}
    {}
    {}
  - {}   (expected)
  + {}   (got)
in all: expected lines missing 1, lines not expected 1
if the new result is right: `spikeloop trace record a.trace` or `UPDATE_GOLDEN=1 cargo test`, \
and say why in traces/README.md",
            STATES[0],
            STATES[1],
            STATES[2],
            STATES[3].replace("448", "449"),
            STATES[3],
        )
    );
}

#[test]
fn a_mismatch_counts_lines_wherever_they_stand_and_compares_totals() {
    let text = recorded();
    let first_state = format!("{}\n", STATES[0]);
    let wrong = text
        .replace(&first_state, "")
        .replace("total synaptic_ops_dense 3", "total synaptic_ops_dense 4")
        .replace("total host_reads 0", "total host_reads 7")
        .replace("time davies2018 ps 614400", "time davies2018 ps 600000");
    let mismatch = Trace::parse("a.trace", &wrong).unwrap().check_all().unwrap_err();
    // The line that was taken out moves all others, which are there all the same.
    assert_eq!((mismatch.missing, mismatch.unexpected), (3, 4));
    let totals: Vec<String> = mismatch.totals.iter().map(ToString::to_string).collect();
    let expected = [
        "total synaptic_ops_dense: 4 -> 3 (-25.00 %)",
        "total host_reads: 7 -> 0 (-100.00 %)",
        "time davies2018 ps: 600000 -> 614400 (+2.40 %)",
    ];
    assert_eq!(totals, expected);
    let said = mismatch.to_string();
    assert!(said.contains("in all: expected lines missing 3, lines not expected 4\n  total syn"));
    let from_zero = text.replace("total synaptic_ops_dense 3", "total synaptic_ops_dense 0");
    let mismatch = Trace::parse("a.trace", &from_zero).unwrap().check_all().unwrap_err();
    assert!(mismatch.to_string().contains("\n  total synaptic_ops_dense: 0 -> 3\nif the new"));
    let twice = text.replace(&first_state, &first_state.repeat(2));
    let mismatch = Trace::parse("a.trace", &twice).unwrap().check_all().unwrap_err();
    assert_eq!((mismatch.missing, mismatch.unexpected), (1, 0));
}

#[test]
fn missing_and_surplus_lines_are_mismatches() {
    let text = recorded();
    let short = text.trim_end().rsplit_once('\n').unwrap().0;
    let mismatch = Trace::parse("a.trace", short).unwrap().check_all().unwrap_err();
    assert_eq!((mismatch.line, mismatch.expected.as_deref()), (39, None));
    let long = format!("{text}one more\n");
    let mismatch = Trace::parse("a.trace", &long).unwrap().check_all().unwrap_err();
    assert_eq!((mismatch.expected.as_deref(), mismatch.got), (Some("one more"), None));
    let mismatch = Trace::parse("a.trace", HEAD).unwrap().check_all().unwrap_err();
    assert_eq!((mismatch.line, mismatch.expected), (15, None));
}

#[test]
fn step_detail_counts_and_digests_each_core() {
    let text = HEAD.replace("detail compartment", "detail step");
    let trace = Trace::parse("a.trace", &text).unwrap();
    let lines = trace.run(&mut EventEngine::new(Arc::clone(trace.map())));
    // SHA-256 of nine zero bytes: u, v and refractory count of the one compartment.
    let rest = "t=0000 core=000 spikes=0000 synops=000000 active=0000 state=3e7077fd2f66d689";
    assert_eq!(lines[0], rest);
    assert!(lines[1].starts_with("t=0001 core=000 spikes=0001 synops=000001 active=0001 state="));
    assert_eq!(lines.len(), 5 + 19 + 2);
}

#[test]
fn the_state_digest_sees_every_part_of_the_state() {
    let trace = Trace::parse("a.trace", HEAD).unwrap();
    let mut engine = DenseEngine::new(Arc::clone(trace.map()));
    let mut digests = vec![state_digest(&engine, CoreId(0))];
    for step in 0..3 {
        observe(&mut engine, &trace.stimulus().part(step..step + 1), Detail::Step);
        digests.push(state_digest(&engine, CoreId(0)));
    }
    assert_eq!(digests[0], digests[1]);
    assert!(digests[1] != digests[2] && digests[2] != digests[3]);
}

#[test]
fn every_wrong_line_of_a_trace_is_named() {
    let cases = [
        (
            "detail compartment",
            "detail all",
            "a.trace:3: found `all`, expected `compartment` or `step`, once",
        ),
        (
            "run 5",
            "run 5\ndetail step",
            "a.trace:14: found `step`, expected `compartment` or `step`, once",
        ),
        ("run 5", "", "a.trace:13: found the end of the input, expected `run STEPS`"),
        ("chip loihi1\n", "", "a.trace:12: found the end of the input, expected `chip NAME`"),
        (
            "run 5",
            "run 5\nrun 6",
            "a.trace:14: found `6`, expected a number of steps, at most 100000, once",
        ),
        (
            "run 5",
            "run 100001",
            "a.trace:13: found `100001`, expected a number of steps, at most 100000, once",
        ),
        (
            "run 5",
            "run away",
            "a.trace:13: found `away`, expected a number of steps, at most 100000, once",
        ),
        (
            "run 5",
            "walk 5",
            "a.trace:13: found `walk`, expected `chip`, `detail`, `core`, `population`, `port`, `input`, `run` or `---`",
        ),
        (
            "t=01..03",
            "t=01..06",
            "a.trace:12: found `t=1..6`, expected steps below 5, the length of the run",
        ),
        (
            "t=00 port",
            "t=05 port",
            "a.trace:11: found `t=5..6`, expected steps below 5, the length of the run",
        ),
        ("t=00 port=in", "t=00 port=out", "a.trace:11: found `out`, expected a port of the map"),
        (
            "t=00 port=in line=1",
            "t=00 port=in line=2",
            "a.trace:11: found `line=2`, expected a line below 2",
        ),
        (
            "t=00 port=in",
            "t=x port=in",
            "a.trace:11: found `x`, expected a number in range behind `t=`",
        ),
        (
            "chip loihi1",
            "chip loihi9",
            "a.trace: chip loihi9: no such built-in chip (there is: loihi1)",
        ),
        (
            "vth=5",
            "vth=0",
            "a.trace: core 0 (one), group 0: threshold mantissa = 0, must be 1..=131071; scale the layer's weights and threshold",
        ),
        ("exp=0", "exp=zero", "a.trace:6: found `zero`, expected a number in range behind `exp=`"),
    ];
    for (from, to, expected) in cases {
        assert_eq!(error_after(from, to), expected);
    }
}

proptest! {
    #![proptest_config(config(300))]

    #[test]
    fn mutated_traces_never_panic(
        changes in prop::collection::vec((0..HEAD.len(), "[0-9a-z=:.;\n -]{0,6}", 0..8usize), 1..6),
    ) {
        let mut text = HEAD.to_owned();
        for (at, with, cut) in changes {
            let at = at.min(text.len());
            text.replace_range(at..(at + cut).min(text.len()), &with);
        }
        if let Ok(trace) = Trace::parse("x", &text) {
            // What is accepted runs the same on every engine.
            if trace.stimulus().steps() < 100 {
                trace.updated_text().unwrap();
            }
        }
    }
}
