//! One line of a text file, taken apart word by word, with errors that name the file, the line,
//! what is there and what should be.

use std::ops::Range;
use std::str::{FromStr, SplitWhitespace};

use crate::error::TextError;

/// Longest quotation in an error.
const QUOTE_LEN_MAX: usize = 60;

/// Words of a line that are still to be read.
#[derive(Debug, Clone)]
pub(crate) struct Line<'a> {
    place: &'a str,
    number: usize,
    words: SplitWhitespace<'a>,
}

impl<'a> Line<'a> {
    /// Line `number` of `place`, or `None` when it holds nothing but blanks and a comment.
    pub(crate) fn new(place: &'a str, number: usize, text: &'a str) -> Option<Self> {
        let facts = text.split(';').next().unwrap_or("");
        let words = facts.split_whitespace();
        words.clone().next().map(|_| Self { place, number, words })
    }

    /// The error that `found` stands where `expected` should.
    pub(crate) fn wrong(&self, found: &str, expected: &str) -> TextError {
        TextError {
            place: self.place.to_owned(),
            line: self.number,
            found: quoted(found),
            expected: expected.to_owned(),
        }
    }

    /// The next word.
    pub(crate) fn word(&mut self, expected: &str) -> Result<&'a str, TextError> {
        match self.words.next() {
            Some(word) => Ok(word),
            None => Err(self.wrong("", expected)),
        }
    }

    /// The next word if there is one.
    pub(crate) fn optional_word(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    /// The next word, which must be `word`.
    pub(crate) fn literal(&mut self, word: &str) -> Result<(), TextError> {
        let expected = format!("`{word}`");
        let found = self.word(&expected)?;
        if found == word { Ok(()) } else { Err(self.wrong(found, &expected)) }
    }

    /// Number of the line, the first is 1.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// The next word as a number.
    pub(crate) fn integer<T: FromStr>(&mut self, expected: &str) -> Result<T, TextError> {
        let word = self.word(expected)?;
        self.parse(word, expected)
    }

    /// `text` as a number.
    pub(crate) fn parse<T: FromStr>(&self, text: &str, expected: &str) -> Result<T, TextError> {
        text.parse().map_err(|_| self.wrong(text, expected))
    }

    /// What stands behind `key=` in the next word.
    pub(crate) fn value(&mut self, key: &str, form: &str) -> Result<&'a str, TextError> {
        let expected = format!("`{key}={form}`");
        let word = self.word(&expected)?;
        let value = word.strip_prefix(key).and_then(|rest| rest.strip_prefix('='));
        value.ok_or_else(|| self.wrong(word, &expected))
    }

    /// The number behind `key=` in the next word.
    pub(crate) fn field<T: FromStr>(&mut self, key: &str) -> Result<T, TextError> {
        let value = self.value(key, "NUMBER")?;
        self.parse(value, &format!("a number in range behind `{key}=`"))
    }

    /// `first..end` behind `key=` in the next word; the end is not part of the range.
    pub(crate) fn range<T>(&mut self, key: &str) -> Result<Range<T>, TextError>
    where
        T: FromStr + PartialOrd,
    {
        let value = self.value(key, "FIRST..END")?;
        self.range_in(key, value, value)
    }

    /// The same with an optional `/step` of 2 or more.
    pub(crate) fn stepped_range(
        &mut self,
        key: &str,
    ) -> Result<(Range<u32>, Option<usize>), TextError> {
        let value = self.value(key, "FIRST..END")?;
        let Some((range, step)) = value.split_once('/') else {
            return Ok((self.range_in(key, value, value)?, None));
        };
        let range = self.range_in(key, range, value)?;
        match step.parse::<u16>() {
            Ok(step @ 2..) => Ok((range, Some(step.into()))),
            _ => Err(self.wrong(value, "a step of 2..=65535 behind the `/`")),
        }
    }

    /// `range`, which is part of `whole`.
    fn range_in<T>(&self, key: &str, range: &str, whole: &str) -> Result<Range<T>, TextError>
    where
        T: FromStr + PartialOrd,
    {
        let expected = format!("a range FIRST..END with FIRST <= END behind `{key}=`");
        let Some((first, end)) = range.split_once("..") else {
            return Err(self.wrong(whole, &expected));
        };
        let range = self.parse::<T>(first, &expected)?..self.parse::<T>(end, &expected)?;
        if range.start <= range.end { Ok(range) } else { Err(self.wrong(whole, &expected)) }
    }

    /// First and length of a range of compartments.
    pub(crate) fn span(&self, range: Range<u32>) -> Result<(u16, u16), TextError> {
        let (first, len) = (u16::try_from(range.start), u16::try_from(range.end - range.start));
        let found = || format!("{}..{}", range.start, range.end);
        match (first, len) {
            (Ok(first), Ok(len)) => Ok((first, len)),
            _ => Err(self.wrong(&found(), "a range within 0..65536")),
        }
    }

    /// `index` must be `next`: numbered things stand in order.
    pub(crate) fn expect_index(
        &self,
        index: usize,
        next: usize,
        what: &str,
    ) -> Result<(), TextError> {
        if index == next {
            return Ok(());
        }
        Err(self.wrong(&index.to_string(), &format!("{what} {next}, which is the next")))
    }

    /// Nothing may be left.
    pub(crate) fn end(&mut self) -> Result<(), TextError> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(self.wrong(word, "the end of the line")),
        }
    }
}

/// `text` in quotation marks, shortened, without control characters.
fn quoted(text: &str) -> String {
    if text.is_empty() {
        return "the end of the line".to_owned();
    }
    let short: String = text.chars().take(QUOTE_LEN_MAX).collect();
    let more = if short.len() < text.len() { "..." } else { "" };
    format!("`{}{more}`", short.escape_debug())
}
