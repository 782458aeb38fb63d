use proptest::prelude::*;

use super::*;

fn sample() -> Vec<u8> {
    to_bytes(&[("a".to_owned(), vec![1, -2, 3]), ("b".to_owned(), vec![])]).unwrap()
}

#[test]
fn what_was_written_is_read() {
    let mut npz = Npz::from_bytes("x.npz", sample()).unwrap();
    assert_eq!(npz.ints("a").unwrap(), IntArray { shape: vec![3], values: vec![1, -2, 3] });
    assert_eq!(npz.ints("b").unwrap(), IntArray { shape: vec![0], values: vec![] });
}

#[test]
fn equal_arrays_make_equal_bytes() {
    assert_eq!(sample(), sample());
}

#[test]
fn a_missing_array_is_named() {
    let error = Npz::from_bytes("x.npz", sample()).unwrap().ints("W0").unwrap_err();
    assert_eq!(error.to_string(), "x.npz: array W0: is not there (there is: a, b)");
}

#[test]
fn other_files_are_refused() {
    let error = Npz::from_bytes("x.npz", b"hello".to_vec()).unwrap_err().to_string();
    assert!(error.starts_with("x.npz: not a readable npz archive ("), "{error}");
}

proptest! {
    #[test]
    fn damaged_archives_never_panic(at in 0usize..400, value in any::<u8>(), cut in 0usize..400) {
        let mut bytes = sample();
        let len = bytes.len();
        bytes[at % len] = value;
        for bytes in [bytes.clone(), bytes[..cut.min(len)].to_vec()] {
            if let Ok(mut npz) = Npz::from_bytes("x.npz", bytes) {
                let _ = npz.ints("a");
                let _ = npz.ints("b");
            }
        }
    }
}
