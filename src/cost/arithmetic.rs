//! Energy of digital arithmetic, from a file with sources.

use serde::{Deserialize, Serialize};

use crate::cost::Ops;

const TABLES: &str = include_str!("arithmetic.toml");

/// Prices of sums and products; nothing but the arithmetic is in them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArithmeticTable {
    /// Name in reports.
    pub name: String,
    /// Where the numbers come from and what they leave out.
    pub source: String,
    /// Picojoules per product.
    pub multiplication_pj: f64,
    /// Picojoules per sum.
    pub addition_pj: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    tables: Vec<ArithmeticTable>,
}

impl ArithmeticTable {
    /// All tables that ship; 32-bit floats come first.
    pub fn all() -> Vec<Self> {
        let file: File = toml::from_str(TABLES).expect("the built-in tables are well-formed");
        file.tables
    }

    /// The first table: 32-bit floats.
    pub fn float32() -> Self {
        Self::all().swap_remove(0)
    }

    /// Picojoules of some operations.
    pub fn energy_pj(&self, ops: &Ops) -> f64 {
        self.multiplication_pj * ops.multiplications as f64
            + self.addition_pj * ops.additions as f64
    }

    /// Picojoules of a product that is added to a sum.
    pub fn mac_pj(&self) -> f64 {
        self.multiplication_pj + self.addition_pj
    }
}

#[cfg(test)]
#[path = "arithmetic_tests.rs"]
mod tests;
