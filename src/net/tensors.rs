//! Weights in safetensors files.

use safetensors::SafeTensors;

use crate::floats;
use crate::net::error::NetError;

/// Tensor that the checkpoint of a training has and no weights have: the digest of the configuration.
pub const CHECKPOINT: &str = "configuration";

/// The table of contents of a weights file; `file` is the name that errors mention.
pub(super) fn open<'a>(file: &str, bytes: &'a [u8]) -> Result<SafeTensors<'a>, NetError> {
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| NetError::Syntax {
        file: file.to_owned(),
        message: format!("not a readable safetensors file ({e}); export the weights again"),
    })?;
    match tensors.tensor(CHECKPOINT) {
        Ok(_) => Err(NetError::Checkpoint { file: file.to_owned() }),
        Err(_) => Ok(tensors),
    }
}

/// Tensors of one layer of a file.
pub(super) struct TensorReader<'a> {
    /// The file, for errors.
    pub(super) file: &'a str,
    /// The layer, for errors.
    pub(super) layer: &'a str,
    /// All tensors of the file.
    pub(super) tensors: &'a SafeTensors<'a>,
}

impl TensorReader<'_> {
    /// A tensor of 32-bit or 16-bit floats and of exactly `shape`, all of it finite.
    pub(super) fn read(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, NetError> {
        let error = |found: String| NetError::Tensor {
            file: self.file.to_owned(),
            layer: self.layer.to_owned(),
            tensor: name.to_owned(),
            found,
            expected: format!("F32 or F16 {shape:?}"),
        };
        let there = || format!("nothing (there is: {})", self.names());
        let tensor = self.tensors.tensor(name).map_err(|_| error(there()))?;
        let values = floats::read(&tensor).filter(|_| tensor.shape() == shape);
        let found = || error(format!("{:?} {:?}", tensor.dtype(), tensor.shape()));
        let values = values.ok_or_else(found)?;
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(index) => Err(NetError::NotFinite {
                file: self.file.to_owned(),
                layer: self.layer.to_owned(),
                tensor: name.to_owned(),
                index,
                value: values[index],
            }),
        }
    }

    /// Extents of a tensor; `None` when it is not there.
    pub(super) fn shape(&self, name: &str) -> Option<Vec<usize>> {
        Some(self.tensors.tensor(name).ok()?.shape().to_vec())
    }

    fn names(&self) -> String {
        let mut names = self.tensors.names();
        names.sort_unstable();
        names.truncate(12);
        names.join(", ")
    }
}
