//! Parameters, moments and counters as safetensors bytes, exactly.

use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView, serialize};
use thiserror::Error;

use crate::floats;
use crate::nn::adam::Adam;
use crate::nn::parameters::{Layout, Parameters};
use crate::nn::variant::Form;

/// State that cannot be used.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum StateError {
    /// Not in the safetensors format.
    #[error("{file}: not readable as safetensors ({message}); was it cut short?")]
    Format {
        /// The file.
        file: String,
        /// What the reader says.
        message: String,
    },
    /// A tensor is not there.
    #[error(
        "{file}: tensor {tensor}: missing, {expected} expected; was it saved by another network?"
    )]
    Missing {
        /// The file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Type and shape.
        expected: String,
    },
    /// A tensor has another type or shape.
    #[error("{file}: tensor {tensor}: {found} found, {expected} expected")]
    Shape {
        /// The file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Type and shape found.
        found: String,
        /// Type and shape expected.
        expected: String,
    },
    /// An actor of another form than the one in training.
    #[error(
        "{file}: holds an actor with {found}, one with {expected} is trained; give weights of that \
         kind, or none"
    )]
    Form {
        /// The file.
        file: String,
        /// Of the file.
        found: Form,
        /// In training.
        expected: Form,
    },
    /// An element is infinite or not a number.
    #[error("{file}: tensor {tensor}: element {element} is {value}, must be finite")]
    NotFinite {
        /// The file.
        file: String,
        /// Name of the tensor.
        tensor: String,
        /// Index of the first such element.
        element: usize,
        /// What it is.
        value: String,
    },
}

struct Tensor {
    name: String,
    shape: Vec<usize>,
    dtype: Dtype,
    bytes: Vec<u8>,
}

/// Collects tensors and turns them into bytes.
#[derive(Default)]
pub struct StateWriter {
    tensors: Vec<Tensor>,
}

impl std::fmt::Debug for StateWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.tensors.iter().map(|tensor| &tensor.name)).finish()
    }
}

impl StateWriter {
    /// A tensor of floats. Panics when the name is taken or shape and values do not fit.
    pub fn floats(&mut self, name: &str, shape: &[usize], values: &[f32]) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "elements of {name}");
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(name, shape, Dtype::F32, bytes);
    }

    /// A counter, as a tensor of one whole number.
    pub fn count(&mut self, name: &str, value: u64) {
        self.add(name, &[1], Dtype::U64, value.to_le_bytes().to_vec());
    }

    /// All tensors of a network, `prefix` before each name.
    pub fn parameters(&mut self, prefix: &str, parameters: &Parameters) {
        for (name, shape, values) in parameters.tensors() {
            self.floats(&format!("{prefix}{name}"), shape, values);
        }
    }

    /// Moments (as `NAME.first`, `NAME.second`) and step count of an optimiser.
    pub fn adam(&mut self, prefix: &str, layout: &Layout, adam: &Adam) {
        for entry in layout.entries() {
            let name = format!("{prefix}{}", entry.name);
            self.floats(&format!("{name}.first"), &entry.shape, entry.slot.of(&adam.first));
            self.floats(&format!("{name}.second"), &entry.shape, entry.slot.of(&adam.second));
        }
        self.count(&format!("{prefix}steps"), adam.steps);
    }

    /// The first float that is infinite or not a number: its tensor, its place there, what it is.
    pub fn not_finite(&self) -> Option<(&str, usize, f32)> {
        let floats = self.tensors.iter().filter(|tensor| tensor.dtype == Dtype::F32);
        floats
            .flat_map(|tensor| {
                let values = tensor.bytes.as_chunks::<4>().0.iter().enumerate();
                values.map(|(at, bytes)| (tensor.name.as_str(), at, f32::from_le_bytes(*bytes)))
            })
            .find(|(_, _, value)| !value.is_finite())
    }

    /// The bytes; the same tensors give the same bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let views = self.tensors.iter().map(|tensor| {
            let view = TensorView::new(tensor.dtype, tensor.shape.clone(), &tensor.bytes);
            (tensor.name.as_str(), view.expect("shape and bytes were checked when added"))
        });
        serialize(views, None).expect("names and sizes are within the limits of the format")
    }

    fn add(&mut self, name: &str, shape: &[usize], dtype: Dtype, bytes: Vec<u8>) {
        assert!(self.tensors.iter().all(|t| t.name != name), "tensor {name} is there already");
        let (name, shape) = (name.to_owned(), shape.to_vec());
        self.tensors.push(Tensor { name, shape, dtype, bytes });
    }
}

/// Tensors in bytes.
#[derive(Debug)]
pub struct StateReader<'a> {
    file: String,
    tensors: SafeTensors<'a>,
}

impl<'a> StateReader<'a> {
    /// Reads the table of contents; `file` is the name that errors mention.
    ///
    /// Errors: not in the format.
    pub fn new(file: &str, bytes: &'a [u8]) -> Result<Self, StateError> {
        let tensors = SafeTensors::deserialize(bytes)
            .map_err(|e| StateError::Format { file: file.to_owned(), message: e.to_string() })?;
        Ok(Self { file: file.to_owned(), tensors })
    }

    /// The name that errors mention.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Whether there is a tensor of this name.
    pub fn has(&self, name: &str) -> bool {
        self.tensors.tensor(name).is_ok()
    }

    /// A tensor of 32-bit or 16-bit floats of this shape.
    ///
    /// Errors: missing, another type or shape, not finite.
    pub fn floats(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, StateError> {
        let values = self.tensor(name, "F32 or F16", shape, floats::read)?;
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(element) => Err(StateError::NotFinite {
                file: self.file.clone(),
                tensor: name.to_owned(),
                element,
                value: values[element].to_string(),
            }),
        }
    }

    /// A counter.
    ///
    /// Errors: missing, another type or shape.
    pub fn count(&self, name: &str) -> Result<u64, StateError> {
        self.tensor(name, "U64", &[1], |view| {
            let bytes = view.data().first_chunk().filter(|_| view.dtype() == Dtype::U64)?;
            Some(u64::from_le_bytes(*bytes))
        })
    }

    /// All tensors of a network; `parameters` is unchanged on an error.
    ///
    /// Errors: as [`StateReader::floats`].
    pub fn parameters(&self, prefix: &str, parameters: &mut Parameters) -> Result<(), StateError> {
        let layout = parameters.layout().clone();
        parameters.values = self.flat(&layout, |name| format!("{prefix}{name}"))?;
        Ok(())
    }

    /// Moments and step count of an optimiser; `adam` is unchanged on an error.
    ///
    /// Errors: as [`StateReader::floats`].
    pub fn adam(&self, prefix: &str, layout: &Layout, adam: &mut Adam) -> Result<(), StateError> {
        let first = self.flat(layout, |name| format!("{prefix}{name}.first"))?;
        let second = self.flat(layout, |name| format!("{prefix}{name}.second"))?;
        *adam = Adam { first, second, steps: self.count(&format!("{prefix}steps"))? };
        Ok(())
    }

    fn flat(&self, layout: &Layout, name: impl Fn(&str) -> String) -> Result<Vec<f32>, StateError> {
        let mut values = Vec::with_capacity(layout.length());
        for entry in layout.entries() {
            values.extend(self.floats(&name(&entry.name), &entry.shape)?);
        }
        Ok(values)
    }

    /// What `read` makes of a tensor of this shape; it gives `None` for another type than `types`.
    fn tensor<T>(
        &self,
        name: &str,
        types: &str,
        shape: &[usize],
        read: impl Fn(&TensorView) -> Option<T>,
    ) -> Result<T, StateError> {
        let (file, tensor) = (self.file.clone(), name.to_owned());
        let expected = format!("{types} {shape:?}");
        let Ok(view) = self.tensors.tensor(name) else {
            return Err(StateError::Missing { file, tensor, expected });
        };
        let value = read(&view).filter(|_| view.shape() == shape);
        value.ok_or_else(|| {
            let found = format!("{:?} {:?}", view.dtype(), view.shape());
            StateError::Shape { file, tensor, found, expected }
        })
    }
}

#[cfg(test)]
#[path = "state_tests.rs"]
mod tests;
