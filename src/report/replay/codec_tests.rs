use proptest::prelude::*;

use super::*;

#[test]
fn base64_is_the_one_of_rfc_4648() {
    let vectors = [
        ("", ""),
        ("f", "Zg=="),
        ("fo", "Zm8="),
        ("foo", "Zm9v"),
        ("foob", "Zm9vYg=="),
        ("fooba", "Zm9vYmE="),
        ("foobar", "Zm9vYmFy"),
    ];
    for (plain, text) in vectors {
        assert_eq!(to_base64(plain.as_bytes()), text);
        assert_eq!(of_base64(text).unwrap(), plain.as_bytes());
    }
}

#[test]
fn each_form_is_taken_where_it_is_shortest() {
    let form = |ones: &[u32]| of_base64(&bits_to_text(ones)).unwrap()[0];
    assert_eq!(form(&[]), PLAIN);
    assert_eq!(form(&(0..200).filter(|i| i % 3 != 1).collect::<Vec<_>>()), PLAIN);
    assert_eq!(form(&[100, 300, 500]), GAPS);
    assert_eq!(form(&(1000..1100).collect::<Vec<_>>()), RUNS);
}

#[test]
fn damaged_text_is_refused() {
    let bits = |bytes: &[u8]| bits_of_text(&to_base64(bytes), 16).unwrap_err();
    assert_eq!(bits(&[]), "no bits");
    assert_eq!(bits(&[3]), "bits of form 3, 0 to 2 expected");
    assert_eq!(bits(&[PLAIN, 0, 0, 1]), "bit 16 of 16");
    assert_eq!(bits(&[GAPS, 3, 12]), "bit 16 of 16");
    assert_eq!(bits(&[RUNS, 15, 2]), "bit 16 of 16");
    assert_eq!(bits(&[RUNS, 15, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]), "bit 16 of 16");
    assert_eq!(bits(&[GAPS, 0x80]), "ends within a number");
    let long = [[GAPS].as_slice(), &[0x81; 9], &[1]].concat();
    assert_eq!(bits(&long), "a number of more than 56 bits");
    assert_eq!(numbers_of_text("A").unwrap_err(), "1 letters of base64, a multiple of 4 expected");
    assert_eq!(
        numbers_of_text("A===").unwrap_err(),
        "4 letters of base64, a multiple of 4 expected"
    );
    assert_eq!(numbers_of_text("AB!=").unwrap_err(), "letter '!' in base64");
}

proptest! {
    #[test]
    fn bits_come_back(mut ones in prop::collection::vec(0u32..5000, 0..400), run in 0u32..600) {
        ones.extend(2000..2000 + run);
        ones.sort_unstable();
        ones.dedup();
        prop_assert_eq!(bits_of_text(&bits_to_text(&ones), 5000).unwrap(), ones.clone());
        for form in [plain(&ones), gaps(&ones), runs(&ones)] {
            prop_assert_eq!(bits_of_text(&to_base64(&form), 5000).unwrap(), ones.clone());
        }
    }

    #[test]
    fn numbers_come_back(numbers in prop::collection::vec(0u64..1 << 53, 0..50)) {
        prop_assert_eq!(numbers_of_text(&numbers_to_text(&numbers)).unwrap(), numbers);
    }

    #[test]
    fn any_text_is_read_or_refused(text in "[A-Za-z0-9+/]{0,40}={0,3}", n in 0u32..2000) {
        if let Ok(ones) = bits_of_text(&text, n) {
            prop_assert!(ones.iter().all(|one| *one < n) && ones.is_sorted());
        }
    }
}
