use super::*;
use crate::nn::gradient_check::gaussians;
use proptest::prelude::*;

fn parameters() -> Parameters {
    let mut layout = Layout::default();
    layout.add("fc.weight", &[3, 2]);
    layout.add("fc.r", &[1]);
    let mut parameters = Parameters::zeros(&layout);
    parameters.values = gaussians(1, 7);
    parameters
}

fn saved() -> Vec<u8> {
    let parameters = parameters();
    let adam = Adam { first: gaussians(2, 7), second: gaussians(3, 7), steps: u64::MAX - 5 };
    let mut state = StateWriter::default();
    state.parameters("net.", &parameters);
    state.adam("adam.", parameters.layout(), &adam);
    state.bytes()
}

fn load(bytes: &[u8]) -> Result<(Parameters, Adam), StateError> {
    let reader = StateReader::new("f", bytes)?;
    let mut read = Parameters::zeros(parameters().layout());
    let mut adam = Adam::new(7);
    reader.parameters("net.", &mut read)?;
    reader.adam("adam.", parameters().layout(), &mut adam)?;
    Ok((read, adam))
}

#[test]
fn what_is_read_is_what_was_written() {
    let (read, adam) = load(&saved()).unwrap();
    assert_eq!(read, parameters());
    assert_eq!((adam.first, adam.second), (gaussians(2, 7), gaussians(3, 7)));
    assert_eq!(adam.steps, u64::MAX - 5);
    assert_eq!(saved(), saved());
}

#[test]
fn bits_survive() {
    let odd = [-0.0f32, f32::MIN_POSITIVE / 8.0, f32::MAX, 1.0f32.next_up()];
    let mut state = StateWriter::default();
    state.floats("x", &[2, 2], &odd);
    let bytes = state.bytes();
    let read = StateReader::new("f", &bytes).unwrap().floats("x", &[2, 2]).unwrap();
    assert_eq!(read.map_bits(), odd.to_vec().map_bits());
}

trait Bits {
    fn map_bits(&self) -> Vec<u32>;
}

impl Bits for Vec<f32> {
    fn map_bits(&self) -> Vec<u32> {
        self.iter().map(|value| value.to_bits()).collect()
    }
}

#[test]
fn errors_name_file_tensor_and_shapes() {
    let bytes = saved();
    let reader = StateReader::new("w.safetensors", &bytes).unwrap();
    let text = |error: StateError| error.to_string();
    assert_eq!(
        text(reader.floats("net.fc.weight", &[2, 3]).unwrap_err()),
        "w.safetensors: tensor net.fc.weight: F32 [3, 2] found, F32 or F16 [2, 3] expected"
    );
    assert_eq!(
        text(reader.count("net.fc.r").unwrap_err()),
        "w.safetensors: tensor net.fc.r: F32 [1] found, U64 [1] expected"
    );
    assert_eq!(
        text(reader.floats("net.fc.bias", &[3]).unwrap_err()),
        "w.safetensors: tensor net.fc.bias: missing, F32 or F16 [3] expected; \
         was it saved by another network?"
    );
    let mut state = StateWriter::default();
    state.floats("x", &[2], &[0.0, f32::NAN]);
    let bytes = state.bytes();
    let reader = StateReader::new("f", &bytes).unwrap();
    assert_eq!(
        text(reader.floats("x", &[2]).unwrap_err()),
        "f: tensor x: element 1 is NaN, must be finite"
    );
    let error = text(StateReader::new("f", &bytes[..9]).unwrap_err());
    assert!(error.starts_with("f: not readable as safetensors ("), "{error}");
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(load(&bytes).is_err());
    }

    #[test]
    fn damaged_bytes_are_read_or_refused(at in 0usize..1000, value: u8, cut in 0usize..1000) {
        let mut bytes = saved();
        let place = at % bytes.len();
        bytes[place] = value;
        let _ = load(&bytes);
        bytes.truncate(cut % bytes.len());
        prop_assert!(load(&bytes).is_err());
    }
}
