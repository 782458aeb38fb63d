use super::*;
use proptest::prelude::*;

fn file(tensors: &[(&str, Dtype, Vec<usize>, Vec<u8>)]) -> Vec<u8> {
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        (*name, TensorView::new(*dtype, shape.clone(), bytes).unwrap())
    });
    serialize(views, None).unwrap()
}

fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn floats(file: &[u8], name: &str) -> Vec<f32> {
    read(&SafeTensors::deserialize(file).unwrap().tensor(name).unwrap()).unwrap()
}

/// 0.1 lies between the 16-bit numbers 0x2e66 and 0x2e67, 2^-14 is the least that is normal, 2^-25 is
/// half of the least above 0, 65519 rounds to the largest.
#[test]
fn weights_are_rounded_and_the_rest_stays() {
    let weights = [0.1, -0.1, 2f32.powi(-14), 2f32.powi(-25), 65519.0, -0.0];
    let (small, count) = (bytes_of(&[0.1, 1e9]), 7u64.to_le_bytes().to_vec());
    let before = file(&[
        ("w", Dtype::F32, vec![2, 3], bytes_of(&weights)),
        ("bias", Dtype::F32, vec![2], small.clone()),
        ("steps", Dtype::U64, vec![1], count.clone()),
    ]);
    let after = halved("f", &before).unwrap();
    let tensors = SafeTensors::deserialize(&after.bytes).unwrap();
    let w = tensors.tensor("w").unwrap();
    assert_eq!((w.dtype(), w.shape()), (Dtype::F16, &[2, 3][..]));
    assert_eq!(w.data(), [0x66, 0x2e, 0x66, 0xae, 0, 4, 0, 0, 0xff, 0x7b, 0, 0x80]);
    assert_eq!(
        floats(&after.bytes, "w"),
        [0.099_975_586, -0.099_975_586, 2f32.powi(-14), 0.0, 65504.0, -0.0]
    );
    assert_eq!(tensors.tensor("bias").unwrap().data(), small);
    assert_eq!(tensors.tensor("steps").unwrap().data(), count);
    assert_eq!(after.numbers, 6);
    assert_eq!(after.change_max, 15.0 / 65519.0);
}

/// As the same bytes every time.
#[test]
fn what_a_file_says_of_itself_stays() {
    let bytes = bytes_of(&[0.3, -7.0]);
    let view = TensorView::new(Dtype::F32, vec![1, 2], &bytes).unwrap();
    let said = (0..9).map(|i| (format!("key {i}"), format!("\"{i}\"")));
    let before = serialize([("w", view)], Some(said.clone().collect())).unwrap();
    let after = halved("f", &before).unwrap();
    let (_, head) = SafeTensors::read_metadata(&after.bytes).unwrap();
    let kept = head.metadata().as_ref().unwrap();
    assert_eq!(kept.len(), 9);
    assert!(said.clone().all(|(key, value)| kept.get(&key) == Some(&value)), "{kept:?}");
    assert_eq!(floats(&after.bytes, "w"), [0.300_048_83, -7.0]);
    for _ in 0..9 {
        assert_eq!(halved("f", &before).unwrap(), after);
    }
}

#[test]
fn twice_is_once() {
    let before = file(&[("w", Dtype::F32, vec![1, 2], bytes_of(&[0.3, -7.0]))]);
    let once = halved("f", &before).unwrap();
    let twice = halved("f", &once.bytes).unwrap();
    assert_eq!(twice, Halved { numbers: 0, change_max: 0.0, ..once });
}

#[test]
fn errors_name_file_tensor_and_element() {
    for (value, shown) in [(65520.0, "65520"), (f32::NAN, "NaN"), (f32::NEG_INFINITY, "-inf")] {
        let bytes = file(&[("w", Dtype::F32, vec![1, 2], bytes_of(&[1.0, value]))]);
        assert_eq!(
            halved("w.st", &bytes).unwrap_err().to_string(),
            format!(
                "w.st: tensor w: element 1 is {shown}, must be within 65504 of 0 to have 16 bits; \
                 keep the file as it is"
            )
        );
    }
    let error = halved("w.st", b"no such thing").unwrap_err().to_string();
    assert!(error.starts_with("w.st: not a readable safetensors file ("), "{error}");
}

#[test]
fn other_types_are_not_floats() {
    let bytes = file(&[("n", Dtype::U64, vec![1], vec![0; 8])]);
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(read(&tensors.tensor("n").unwrap()), None);
}

proptest! {
    /// Half a unit in the last of 11 digits.
    #[test]
    fn no_number_moves_by_more_than_half_a_step(
        values in prop::collection::vec(-60000.0f32..60000.0, 1..40),
    ) {
        let bytes = file(&[("w", Dtype::F32, vec![1, values.len()], bytes_of(&values))]);
        let after = halved("f", &bytes).unwrap();
        for (before, after) in values.iter().zip(floats(&after.bytes, "w")) {
            let step = (before.abs() * 2f32.powi(-11)).max(2f32.powi(-25));
            prop_assert!((before - after).abs() <= step, "{before} {after}");
        }
        prop_assert!(after.change_max <= 2f64.powi(-11));
    }
}
