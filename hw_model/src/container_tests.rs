use super::*;

const KIND: Kind = Kind { label: *b"SLTEST\0\0", version: 3, advice: "make it again" };

fn good() -> Vec<u8> {
    to_bytes(KIND, &vec![1u32, 2, 3])
}

fn error_of(bytes: &[u8]) -> String {
    from_bytes::<Vec<u32>>(KIND, "x.map", bytes).unwrap_err().to_string()
}

#[test]
fn what_was_written_is_read() {
    assert_eq!(from_bytes::<Vec<u32>>(KIND, "x.map", &good()).unwrap(), [1, 2, 3]);
}

#[test]
fn a_wrong_label_is_named() {
    assert_eq!(
        error_of(b"PK\x03\x04rest of a zip"),
        r"x.map: not a SLTEST\x00\x00 file (its label is PK\x03\x04rest); make it again"
    );
    assert!(error_of(b"").contains("not a SLTEST"));
}

#[test]
fn a_wrong_version_is_named() {
    let mut bytes = good();
    bytes[8] = 2;
    assert_eq!(error_of(&bytes), "x.map: version 2 found, 3 expected; make it again");
}

#[test]
fn truncation_and_appending_are_named() {
    let bytes = good();
    let short = error_of(&bytes[..bytes.len() - 1]);
    assert!(short.starts_with("x.map: 3 bytes of content, the header says 4"), "{short}");
    let long = error_of(&[bytes.clone(), vec![0]].concat());
    assert!(long.starts_with("x.map: 5 bytes of content, the header says 4"), "{long}");
    assert!(error_of(&bytes[..20]).contains("20 bytes of content, the header says 52"));
}

#[test]
fn every_flipped_bit_is_noticed() {
    let bytes = good();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(from_bytes::<Vec<u32>>(KIND, "x.map", &damaged).is_err(), "bit {bit}");
    }
}

#[test]
fn content_of_another_type_does_not_decode() {
    let bytes = to_bytes(KIND, &vec![1u8; 3]);
    let error = from_bytes::<(String, u64, u64)>(KIND, "x.map", &bytes).unwrap_err().to_string();
    assert!(error.contains("does not decode"), "{error}");
}

#[test]
fn a_failed_write_leaves_nothing_behind() {
    let folder = std::env::temp_dir().join(format!("hw_model_container_{}", std::process::id()));
    std::fs::create_dir_all(folder.join("target")).unwrap();
    // The target is a folder, so the final rename fails.
    assert!(write_atomically(&folder.join("target"), b"x").is_err());
    let left: Vec<_> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["target"]);
    std::fs::remove_dir_all(folder).unwrap();
}
