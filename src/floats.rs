//! Floats in tensors of 32 or 16 bits, and files of the one made into the other.

use std::collections::BTreeMap;

use half::f16;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, SafeTensorError, TensorView, serialize};
use serde_json::Value;
use thiserror::Error;

/// A file whose numbers cannot have 16 bits.
#[derive(Debug, Error)]
pub enum HalfError {
    /// Not in the safetensors format, or it cannot be written in it.
    #[error("{file}: not a readable safetensors file ({source}); export the weights again")]
    Format {
        /// The file.
        file: String,
        /// What the library says.
        source: SafeTensorError,
    },
    /// A number too large for 16 bits, infinite or not a number.
    #[error(
        "{file}: tensor {tensor}: element {element} is {value}, must be within {limit} of 0 to have \
         16 bits; keep the file as it is"
    )]
    Range {
        /// The file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Position in the tensor.
        element: usize,
        /// What it is.
        value: f32,
        /// Largest number of 16 bits.
        limit: f32,
    },
}

/// A file with 16-bit numbers, and what that changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Halved {
    /// The file.
    pub bytes: Vec<u8>,
    /// Numbers that have 16 bits now and had 32.
    pub numbers: usize,
    /// Largest change of a number, in units of the largest one of its tensor.
    pub change_max: f64,
}

/// Elements of a tensor of float32 or float16; `None` of anything else.
pub(crate) fn read(tensor: &TensorView) -> Option<Vec<f32>> {
    let bytes = tensor.data();
    match tensor.dtype() {
        Dtype::F32 => Some(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()),
        Dtype::F16 => {
            Some(bytes.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect())
        }
        _ => None,
    }
}

/// The same file with the weights rounded to 16 bits (IEEE 754 half precision, ties to even): all
/// float32 tensors of two and more dimensions. Others (biases, thresholds) are few and stay.
///
/// Errors: not safetensors; a number that has no finite neighbour of 16 bits. `file` is the name that
/// they mention.
pub fn halved(file: &str, bytes: &[u8]) -> Result<Halved, HalfError> {
    let format = |source| HalfError::Format { file: file.to_owned(), source };
    let (_, head) = SafeTensors::read_metadata(bytes).map_err(format)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(format)?;
    let (mut numbers, mut change_max) = (0, 0.0f64);
    let mut kept = Vec::new();
    let mut names = tensors.names();
    names.sort_unstable();
    for name in names {
        let tensor = tensors.tensor(name).map_err(format)?;
        if tensor.dtype() != Dtype::F32 || tensor.shape().len() < 2 {
            kept.push((name, tensor.dtype(), tensor.shape().to_vec(), tensor.data().to_vec()));
            continue;
        }
        let values = read(&tensor).expect("float32 is read");
        let rounded: Vec<f16> = values.iter().map(|value| f16::from_f32(*value)).collect();
        if let Some(element) = rounded.iter().position(|value| !value.is_finite()) {
            let (file, tensor, value) = (file.to_owned(), name.to_owned(), values[element]);
            return Err(HalfError::Range {
                file,
                tensor,
                element,
                value,
                limit: f16::MAX.to_f32(),
            });
        }
        let largest = values.iter().map(|value| f64::from(value.abs())).fold(0.0, f64::max);
        for (value, rounded) in values.iter().zip(&rounded).filter(|(value, _)| **value != 0.0) {
            let change = (f64::from(*value) - f64::from(rounded.to_f32())).abs() / largest;
            change_max = change_max.max(change);
        }
        numbers += values.len();
        let bytes = rounded.iter().flat_map(|value| value.to_le_bytes()).collect();
        kept.push((name, Dtype::F16, tensor.shape().to_vec(), bytes));
    }
    let views = kept.iter().map(|(name, dtype, shape, bytes)| {
        Ok((*name, TensorView::new(*dtype, shape.clone(), bytes)?))
    });
    let views: Vec<_> = views.collect::<Result<_, SafeTensorError>>().map_err(format)?;
    let mut bytes = serialize(views, head.metadata().clone()).map_err(format)?;
    if head.metadata().is_some() {
        sort_head(&mut bytes);
    }
    Ok(Halved { bytes, numbers, change_max })
}

/// Puts what a file says of itself in order: the library keeps it in a hash map and writes it in
/// another order each time.
fn sort_head(bytes: &mut [u8]) {
    let (length, rest) =
        bytes.split_first_chunk_mut().expect("a file begins with its head's length");
    let head = &mut rest[..u64::from_le_bytes(*length) as usize];
    let parts: BTreeMap<String, BTreeMap<String, Value>> =
        serde_json::from_slice(head).expect("the head was just written");
    let sorted = serde_json::to_vec(&parts).expect("names and numbers");
    head.fill(b' ');
    head[..sorted.len()].copy_from_slice(&sorted);
}

#[cfg(test)]
#[path = "floats_tests.rs"]
mod tests;
