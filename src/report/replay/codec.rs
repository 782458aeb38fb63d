//! Bits and numbers of a replay as short text, in a form that a page can read without help.
//!
//! Text is base64 of bytes. Numbers are LEB128: seven bits per byte, low ones first, the top bit
//! says that more follow. A set of bits is a byte that names its form, then
//!
//! ```text
//! 0 plain    bit i is bit i % 8 of byte i / 8; zero bytes at the end are left out
//! 1 gaps     numbers: zeros before each one
//! 2 runs     numbers: zeros, ones, zeros, ones ...
//! ```
//! whichever is shortest.

/// Forms of a set of bits.
const PLAIN: u8 = 0;
const GAPS: u8 = 1;
const RUNS: u8 = 2;

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The ones of a set of bits; `ones` are their places, rising.
pub fn bits_to_text(ones: &[u32]) -> String {
    let forms = [plain(ones), gaps(ones), runs(ones)];
    let shortest = forms.into_iter().min_by_key(Vec::len).unwrap_or_default();
    to_base64(&shortest)
}

/// Places of the ones, rising; all below `n`.
///
/// Errors: what is wrong with the text.
pub fn bits_of_text(text: &str, n: u32) -> Result<Vec<u32>, String> {
    let bytes = of_base64(text)?;
    let (form, bytes) = bytes.split_first().ok_or("no bits")?;
    let ones = match *form {
        PLAIN => of_plain(bytes),
        GAPS => of_gaps(&of_leb128(bytes)?),
        RUNS => of_runs(&of_leb128(bytes)?, n),
        other => return Err(format!("bits of form {other}, 0 to 2 expected")),
    };
    match ones.last() {
        Some(last) if *last >= u64::from(n) => Err(format!("bit {last} of {n}")),
        _ => Ok(ones.into_iter().map(|one| one as u32).collect()),
    }
}

/// Numbers as text.
pub fn numbers_to_text(numbers: &[u64]) -> String {
    to_base64(&leb128(numbers))
}

/// Numbers of a text.
///
/// Errors: what is wrong with the text.
pub fn numbers_of_text(text: &str) -> Result<Vec<u64>, String> {
    of_leb128(&of_base64(text)?)
}

fn plain(ones: &[u32]) -> Vec<u8> {
    let bytes = ones.last().map_or(0, |last| *last as usize / 8 + 1);
    let mut plain = vec![0; 1 + bytes];
    plain[0] = PLAIN;
    ones.iter().for_each(|one| plain[1 + *one as usize / 8] |= 1 << (one % 8));
    plain
}

fn gaps(ones: &[u32]) -> Vec<u8> {
    let mut next = 0;
    let gap = |one: &u32| u64::from(one - std::mem::replace(&mut next, one + 1));
    let gaps: Vec<u64> = ones.iter().map(gap).collect();
    [vec![GAPS], leb128(&gaps)].concat()
}

fn runs(ones: &[u32]) -> Vec<u8> {
    let mut next = 0;
    let mut lengths = Vec::new();
    for run in ones.chunk_by(|a, b| a + 1 == *b) {
        lengths.extend([u64::from(run[0] - next), run.len() as u64]);
        next = run[0] + run.len() as u32;
    }
    [vec![RUNS], leb128(&lengths)].concat()
}

fn of_plain(bytes: &[u8]) -> Vec<u64> {
    let set = |bit: &u64| bytes[(bit / 8) as usize] >> (bit % 8) & 1 == 1;
    (0..8 * bytes.len() as u64).filter(set).collect()
}

fn of_gaps(gaps: &[u64]) -> Vec<u64> {
    let mut next = 0u64;
    let mut one = |gap: &u64| {
        let one = next.saturating_add(*gap);
        next = one.saturating_add(1);
        one
    };
    gaps.iter().map(&mut one).collect()
}

/// Stops behind bit `n`: a run may claim any length.
fn of_runs(lengths: &[u64], n: u32) -> Vec<u64> {
    let (mut ones, mut next) = (Vec::new(), 0u64);
    for (index, length) in lengths.iter().enumerate() {
        let end = next.saturating_add(*length);
        if index % 2 == 1 {
            ones.extend(next..end.min(u64::from(n) + 1));
        }
        next = end;
    }
    ones
}

fn leb128(numbers: &[u64]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for number in numbers {
        let mut left = *number;
        while left > 0x7f {
            bytes.push(left as u8 | 0x80);
            left >>= 7;
        }
        bytes.push(left as u8);
    }
    bytes
}

fn of_leb128(bytes: &[u8]) -> Result<Vec<u64>, String> {
    let (mut numbers, mut number, mut shift) = (Vec::new(), 0u64, 0);
    for byte in bytes {
        // A page counts in doubles.
        if shift > 49 {
            return Err("a number of more than 56 bits".to_owned());
        }
        number |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte & 0x80 == 0 {
            numbers.push(number);
            (number, shift) = (0, 0);
        }
    }
    if shift > 0 { Err("ends within a number".to_owned()) } else { Ok(numbers) }
}

/// Base64 with padding (RFC 4648).
pub fn to_base64(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |index: usize| u32::from(group.get(index).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let letter = ALPHABET[(word >> (18 - 6 * place) & 63) as usize];
            text.push(if place > group.len() { '=' } else { letter as char });
        }
    }
    text
}

fn of_base64(text: &str) -> Result<Vec<u8>, String> {
    let letters = text.trim_end_matches('=').as_bytes();
    if !text.len().is_multiple_of(4) || letters.len() + 2 < text.len() {
        return Err(format!("{} letters of base64, a multiple of 4 expected", text.len()));
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    for group in letters.chunks(4) {
        let mut word = 0u32;
        for letter in group {
            let value = ALPHABET.iter().position(|known| known == letter);
            let value = value.ok_or_else(|| format!("letter {:?} in base64", *letter as char))?;
            word = word << 6 | value as u32;
        }
        word <<= 6 * (4 - group.len());
        bytes.extend(&word.to_be_bytes()[1..group.len().max(2)]);
    }
    Ok(bytes)
}

#[cfg(test)]
#[path = "codec_tests.rs"]
mod tests;
