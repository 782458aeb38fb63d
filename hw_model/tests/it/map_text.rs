//! The text form of core maps: what is written reads back, what is wrong is named.

use hw_model::{ChipSpec, CoreMap, CoreMapParts};
use proptest::prelude::*;

use crate::random_map::{config, recipe};

const SMALL: &str = "\
chip loihi1
core 000 label fc1[0..3]
core 000 group cx=0000..0002 decay_u=2048 decay_v=1024 vth=233 bias=0<<0 refractory=1
core 000 group cx=0002..0003 decay_u=4096 decay_v=0 vth=131071 bias=-37<<6 refractory=63
core 000 format 0 mode=mixed bits=8 exp=0
core 000 format 1 mode=inhibitory bits=6 exp=-8
core 000 list 0 entry format=0 dense first=0: -12 4 6
core 000 list 0 entry format=1 sparse: 0:-12 2:-4
core 000 list 1 empty
core 000 list 2 entry format=0 sparse:
core 000 axon_in 0000 list=0 base=0
core 000 axon_in 0001 list=2 base=3
core 000 axon_out cx=0001 -> core 001 axon 0000
core 001 label
core 001 group cx=0000..0001 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
core 001 list 0 empty
core 001 axon_in 0000 list=0 base=0
population fc1 core=000 cx=0000..0003
population fc1 core=001 cx=0000..0001
population none empty
port in lines=24
port in line 3 -> core 000 axon 0001
";

fn parse(text: &str) -> Result<CoreMapParts, String> {
    CoreMapParts::from_text("a.map", text, ChipSpec::loihi1()).map_err(|e| e.to_string())
}

fn error_after(from: &str, to: &str) -> String {
    assert_eq!(SMALL.matches(from).count(), 1, "`{from}` is not there once");
    parse(&SMALL.replace(from, to)).unwrap_err()
}

#[test]
fn every_kind_of_fact_reads_and_writes_back_as_it_was() {
    let map = CoreMap::new(parse(SMALL).unwrap()).unwrap();
    assert_eq!(map.to_text(), SMALL);
}

#[test]
fn facts_mean_what_they_say() {
    let parts = parse(SMALL).unwrap();
    let core = &parts.cores[0];
    assert_eq!((core.compartments(), core.groups[1].bias_mantissa), (3, -37));
    assert_eq!((core.groups[1].bias_exponent, core.groups[1].refractory_steps), (6, 63));
    assert_eq!(core.lists[0].entries[0].mantissas(), [-12, 4, 6]);
    let sparse: Vec<_> = core.lists[0].entries[1].synapses().collect();
    assert_eq!(sparse, [(0, -12), (2, -4)]);
    assert_eq!((core.axons_in[1].list, core.axons_in[1].base), (2, 3));
    assert_eq!((core.axons_out[0].compartment.0, core.axons_out[0].core.0), (1, 1));
    assert_eq!((parts.populations[0].len(), parts.populations[1].len()), (4, 0));
    assert_eq!((parts.ports[0].lines, parts.ports[0].targets[0].line), (24, 3));
}

#[test]
fn comments_blank_lines_and_spacing_do_not_matter() {
    let spaced = SMALL.replace('\n', "   ; why\n\n; a comment\n").replace(" cx=", "\t  cx=");
    assert_eq!(parse(&spaced), parse(SMALL));
}

#[test]
fn every_wrong_line_is_named_with_what_was_expected() {
    let cases = [
        ("chip loihi1\n", "", "a.map:21: found no chip, expected `chip loihi1`"),
        ("chip loihi1", "chip two", "a.map:1: found `chip two`, expected `chip loihi1`"),
        ("chip loihi1", "chip loihi1\nchip b", "a.map:2: found `b`, expected one chip only"),
        (
            "core 001 label",
            "core 002 label",
            "a.map:14: found `2`, expected core 1, which is the next",
        ),
        ("core 001 label\n", "", "a.map:14: found `group`, expected `label`, which opens a core"),
        (
            "cx=0002..0003",
            "cx=0003..0004",
            "a.map:4: found `3`, expected first compartment 2, which is the next",
        ),
        (
            "cx=0002..0003",
            "cx=0002..0001",
            "a.map:4: found `0002..0001`, expected a range FIRST..END with FIRST <= END behind `cx=`",
        ),
        (
            "cx=0002..0003",
            "cx=2..70000",
            "a.map:4: found `2..70000`, expected a range within 0..65536",
        ),
        ("decay_u=2048", "decay=2048", "a.map:3: found `decay=2048`, expected `decay_u=NUMBER`"),
        (
            "decay_u=2048",
            "decay_u=-1",
            "a.map:3: found `-1`, expected a number in range behind `decay_u=`",
        ),
        ("bias=-37<<6", "bias=-37", "a.map:4: found `-37`, expected `bias=MANTISSA<<EXPONENT`"),
        ("refractory=63", "refractory=63 x", "a.map:4: found `x`, expected the end of the line"),
        ("refractory=63", "", "a.map:4: found the end of the line, expected `refractory=NUMBER`"),
        (
            "mode=mixed",
            "mode=both",
            "a.map:5: found `both`, expected `mixed`, `excitatory` or `inhibitory`",
        ),
        (
            "format 1 mode",
            "format 2 mode",
            "a.map:6: found `2`, expected format 1, which is the next",
        ),
        ("first=0:", "first=0", "a.map:7: found `0`, expected a `:` behind the number"),
        ("-12 4 6", "-12 4.5 6", "a.map:7: found `4.5`, expected a weight mantissa"),
        ("2:-4", "2", "a.map:8: found `2`, expected `TARGET:MANTISSA`"),
        ("list 1 empty", "list 1 none", "a.map:9: found `none`, expected `entry` or `empty`"),
        (
            "format=0 sparse:",
            "format=0 kernel",
            "a.map:10: found `kernel`, expected `dense first=N:` or `sparse:`",
        ),
        (
            "axon_in 0001",
            "axon_in 0002",
            "a.map:12: found `2`, expected input axon 1, which is the next",
        ),
        ("cx=0001 -> core", "cx=0001 core", "a.map:13: found `core`, expected `->`"),
        (
            "axon_out",
            "axonout",
            "a.map:13: found `axonout`, expected `label`, `group`, `format`, `list`, `axon_in` or `axon_out`",
        ),
        (
            "port in line 3",
            "port out line 3",
            "a.map:22: found `out`, expected the port whose `lines` come before",
        ),
        (
            "population none",
            "populous none",
            "a.map:20: found `populous`, expected `chip`, `core`, `population` or `port`",
        ),
    ];
    for (from, to, expected) in cases {
        assert_eq!(error_after(from, to), expected);
    }
}

#[test]
fn scattered_neurons_are_written_as_ranges_with_a_step() {
    let text = |populations: &str| {
        SMALL
            .replace("population fc1 core=000 cx=0000..0003\n", populations)
            .replace("cx=0002..0003 decay", "cx=0002..0050 decay")
    };
    let stepped = text("population fc1 core=000 cx=0003..0032/7\n");
    let map = CoreMap::new(parse(&stepped).unwrap()).unwrap();
    let firsts: Vec<u16> = map.populations()[0].slices.iter().map(|s| s.first.0).collect();
    assert_eq!(firsts, [3, 10, 17, 24, 31, 0]);
    assert_eq!(map.to_text(), stepped);
    // The end need not be that of the last one; two alone are written one by one.
    let loose = parse(&text("population fc1 core=000 cx=3..38/7\n")).unwrap();
    assert_eq!(&loose, map.parts());
    let two = text("population fc1 core=000 cx=0..3/2\n");
    let apart = "population fc1 core=000 cx=0000..0001\npopulation fc1 core=000 cx=0002..0003\n";
    assert_eq!(CoreMap::new(parse(&two).unwrap()).unwrap().to_text(), text(apart));
    for step in ["0", "1", "-2", "x", "", "65536", "2/2"] {
        let error = parse(&text(&format!("population fc1 core=000 cx=0..9/{step}\n")));
        let expected =
            format!("a.map:18: found `0..9/{step}`, expected a step of 2..=65535 behind the `/`");
        assert_eq!(error.unwrap_err(), expected);
    }
    let far = parse(&text("population fc1 core=000 cx=60000..120000/2\n")).unwrap();
    assert!(CoreMap::new(far).is_err());
}

#[test]
fn what_is_quoted_in_an_error_is_short_and_printable() {
    let error = parse(&format!("\u{1b}[2J{}", "x".repeat(500))).unwrap_err();
    assert!(error.starts_with("a.map:1: found `\\u{1b}[2Jxxx"), "{error}");
    assert!(error.len() < 160, "{error}");
}

proptest! {
    #![proptest_config(config(150))]

    #[test]
    fn any_map_reads_back_from_its_text(recipe in recipe()) {
        let map = recipe.build();
        let text = map.to_text();
        let parts = CoreMapParts::from_text("x", &text, map.chip().clone()).unwrap();
        prop_assert_eq!(&parts, map.parts());
        prop_assert_eq!(CoreMap::new(parts).unwrap().to_text(), text);
    }

    #[test]
    fn random_text_never_panics(text in "[a-z0-9=.:;<> \\-\n\\PC]{0,300}") {
        let _ = parse(&text).map(CoreMap::new);
    }

    #[test]
    fn shuffled_words_never_panic(
        words in prop::collection::vec(
            prop::sample::select(SMALL.split_inclusive([' ', '\n', '=', '.']).collect::<Vec<_>>()),
            0..200,
        ),
    ) {
        let _ = parse(&words.concat()).map(CoreMap::new);
    }

    #[test]
    fn mutated_text_never_panics(
        changes in prop::collection::vec((0..SMALL.len(), "[0-9a-z=:.;\n -]{0,6}", 0..8usize), 1..6),
    ) {
        let mut text = SMALL.to_owned();
        for (at, with, cut) in changes {
            let at = at.min(text.len());
            let end = (at + cut).min(text.len());
            text.replace_range(at..end, &with);
        }
        if let Ok(Ok(map)) = parse(&text).map(CoreMap::new) {
            // What is accepted is also written back in a form that is accepted.
            prop_assert_eq!(&parse(&map.to_text()).unwrap(), map.parts());
        }
    }
}
