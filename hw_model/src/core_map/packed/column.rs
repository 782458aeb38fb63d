//! Many numbers as bytes of fixed width.

use std::marker::PhantomData;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers that lie in a file side by side, little-endian.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Column<T>(pub(super) Vec<T>);

/// What a column is made of.
pub(super) trait Number: Copy {
    /// All of `numbers`.
    fn bytes_of(numbers: &[Self]) -> Vec<u8>;
    /// The inverse; `None` when there is a part of a number.
    fn of_bytes(bytes: &[u8]) -> Option<Vec<Self>>;
}

macro_rules! numbers {
    ($($number:ty),*) => {
        $(impl Number for $number {
            fn bytes_of(numbers: &[Self]) -> Vec<u8> {
                numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
            }

            fn of_bytes(bytes: &[u8]) -> Option<Vec<Self>> {
                let (numbers, rest) = bytes.as_chunks();
                rest.is_empty().then(|| numbers.iter().map(|n| Self::from_le_bytes(*n)).collect())
            }
        })*
    };
}

numbers!(i16, u16, u32);

impl<T: Number> Serialize for Column<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&T::bytes_of(&self.0))
    }
}

impl<'de, T: Number> Deserialize<'de> for Column<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_bytes(Bytes(PhantomData))
    }
}

struct Bytes<T>(PhantomData<T>);

impl<T: Number> Visitor<'_> for Bytes<T> {
    type Value = Column<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "numbers of {} bytes", size_of::<T>())
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Column<T>, E> {
        let part =
            || E::custom(format!("{} bytes of {}-byte numbers", bytes.len(), size_of::<T>()));
        T::of_bytes(bytes).map(Column).ok_or_else(part)
    }
}

/// Reads a column from its beginning.
#[derive(Debug)]
pub(super) struct Reader<'a, T> {
    what: &'static str,
    left: &'a [T],
}

impl<'a, T: Copy> Reader<'a, T> {
    pub(super) fn new(what: &'static str, column: &'a Column<T>) -> Self {
        Self { what, left: &column.0 }
    }

    /// The next `n` numbers.
    pub(super) fn take(&mut self, n: usize) -> Result<&'a [T], String> {
        let Some((taken, left)) = self.left.split_at_checked(n) else {
            return Err(format!("{}: {n} more named, {} there", self.what, self.left.len()));
        };
        self.left = left;
        Ok(taken)
    }

    /// The next number.
    pub(super) fn next(&mut self) -> Result<T, String> {
        Ok(self.take(1)?[0])
    }

    /// Errs when something is left.
    pub(super) fn end(&self) -> Result<(), String> {
        match self.left.len() {
            0 => Ok(()),
            n => Err(format!("{}: {n} more there than named", self.what)),
        }
    }
}
