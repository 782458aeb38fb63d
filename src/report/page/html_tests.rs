use super::*;

#[test]
fn numbers_stand_on_the_right_in_groups_and_names_do_not() {
    let digest = "42ccae22f0022b528d871f00958e22830c58eb2a54d087a6dcdba0c35a1cf63b";
    let mut made = Table::new();
    made.set_header(["driver", "seed", "operations", "energy (uJ)", "sha-256"]);
    made.add_row(["2 <b>", "20261125", "10127714", "282.70", digest]);
    made.add_row(["straight", "1", "-", "1234", digest]);
    let html = table(&made);
    for part in [
        "<th>driver</th><th class=\"n\">seed</th><th class=\"n\">operations</th>",
        "<th>sha-256</th>",
        "<td>2 &lt;b&gt;</td><td class=\"n\">20261125</td><td class=\"n\">10,127,714</td>",
        "<td class=\"n\">282.70</td>",
        "<td class=\"n\">-</td><td class=\"n\">1234</td>",
    ] {
        assert!(html.contains(part), "{part} in {html}");
    }
    assert_eq!(html.matches(&format!("<td class=\"digest\">{digest}</td>")).count(), 2);
}

#[test]
fn figures_are_told_from_words() {
    for number in ["0", "0/2", "12.5 %", "-0.031", "1,024"] {
        assert!(is_number(number), "{number}");
    }
    for word in ["", "-", "none", "d6f6b6ed3345", "4 of 5", "1e5"] {
        assert!(!is_number(word), "{word}");
    }
    let groups = ["1234", "12345", "57135905", "0.12345"].map(grouped);
    assert_eq!(groups, ["1234", "12,345", "57,135,905", "0.12345"]);
}
