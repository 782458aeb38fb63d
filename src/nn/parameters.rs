//! Named tensors in one flat vector.

use std::ops::Range;

/// Place of one tensor in a flat parameter or gradient vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    start: usize,
    length: usize,
}

impl Slot {
    /// The elements of this tensor in `all`.
    pub fn of(self, all: &[f32]) -> &[f32] {
        &all[self.range()]
    }

    /// The same, to be written.
    pub fn of_mut(self, all: &mut [f32]) -> &mut [f32] {
        &mut all[self.range()]
    }

    /// Indices of the elements.
    pub fn range(self) -> Range<usize> {
        self.start..self.start + self.length
    }
}

/// Name, shape and place of one tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Name, unique in its network, parts separated by dots.
    pub name: String,
    /// Extent of each dimension, last one fastest.
    pub shape: Vec<usize>,
    /// Where it is.
    pub slot: Slot,
}

/// Names, shapes and places of all tensors of a network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Layout {
    entries: Vec<Entry>,
    length: usize,
}

impl Layout {
    /// Appends a tensor. Panics when the name is taken.
    pub fn add(&mut self, name: &str, shape: &[usize]) -> Slot {
        assert!(self.find(name).is_none(), "tensor {name} is there already");
        let slot = Slot { start: self.length, length: shape.iter().product() };
        self.length += slot.length;
        self.entries.push(Entry { name: name.to_owned(), shape: shape.to_vec(), slot });
        slot
    }

    /// All tensors, in the order of their places.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The tensor called `name`.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }

    /// Number of elements of all tensors.
    pub fn length(&self) -> usize {
        self.length
    }

    /// A gradient of zeros.
    pub fn zeros(&self) -> Vec<f32> {
        vec![0.0; self.length]
    }
}

/// The parameters of a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    layout: Layout,
    /// Elements of all tensors.
    pub values: Vec<f32>,
}

impl Parameters {
    /// All zero.
    pub fn zeros(layout: &Layout) -> Self {
        Self { layout: layout.clone(), values: layout.zeros() }
    }

    /// Names, shapes and places.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Every tensor: name, shape, elements.
    pub fn tensors(&self) -> impl Iterator<Item = (&str, &[usize], &[f32])> {
        self.layout
            .entries
            .iter()
            .map(|entry| (entry.name.as_str(), entry.shape.as_slice(), entry.slot.of(&self.values)))
    }

    /// Elements of the tensor called `name`.
    pub fn tensor(&self, name: &str) -> Option<&[f32]> {
        self.layout.find(name).map(|entry| entry.slot.of(&self.values))
    }
}
