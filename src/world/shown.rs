//! Numbers in errors.

/// A number as an error shows it: one too large to be meant by its power of ten, not by hundreds of
/// digits.
pub(crate) fn shown(value: f64) -> String {
    if value.is_finite() && value.abs() >= 1e9 { format!("{value:e}") } else { value.to_string() }
}
