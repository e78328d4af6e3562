//! Words of a command line: sizes, numbers, and how what is asked for is refused.

use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use restir::Error;

/// Refuses what was asked for unless it `holds`.
///
/// # Errors
/// [`Error::Setting`] with the problem.
pub fn require(holds: bool, problem: fmt::Arguments<'_>) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Setting(problem.to_string())) }
}

/// A size as the user wrote it; sides that do not fit are judged later, with a better message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    width: u64,
    height: u64,
}

impl Size {
    /// Width and height.
    ///
    /// # Errors
    /// [`Error::Setting`] if one of them does not fit.
    pub fn sides(self) -> Result<[u32; 2], Error> {
        let Self { width, height } = self;
        let too_large = |_| Error::Setting(format!("an image of {width} x {height} pixels is too large"));
        Ok([width.try_into().map_err(too_large)?, height.try_into().map_err(too_large)?])
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X']).ok_or("it has to be WIDTHxHEIGHT, as in 640x480")?;
        Ok(Self { width: saturating(width)?, height: saturating(height)? })
    }
}

/// Some of what is counted from 0, as A..B, where B is one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    first: u32,
    last: u32,
}

impl Span {
    pub(crate) fn range(self) -> Range<u32> {
        self.first..self.last + 1
    }
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once("..").ok_or("it has to be A..B, as in 0..63 for the first 64")?;
        let (first, last) = (natural(first)?, natural(last)?);
        if first > last || last == u32::MAX {
            return Err(format!("it has to be A..B with A <= B < {}, as in 0..63 for the first 64", u32::MAX));
        }
        Ok(Self { first, last })
    }
}

/// A number with decimals.
///
/// # Errors
/// What clap is to say of anything else.
pub fn number<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| "it has to be a number".to_owned())
}

/// A natural number that fits.
///
/// # Errors
/// What clap is to say of anything else.
pub fn natural<T: FromStr>(text: &str) -> Result<T, String> {
    saturating(text)?;
    text.parse().map_err(|_| format!("it is too large; it has to be less than 2^{}", 8 * size_of::<T>()))
}

/// A natural number; what is larger than any `u64` becomes the largest.
pub(crate) fn saturating(text: &str) -> Result<u64, String> {
    if text.is_empty() || !text.bytes().all(|digit| digit.is_ascii_digit()) {
        return Err("it has to be a natural number".to_owned());
    }
    Ok(text.parse().unwrap_or(u64::MAX))
}

/// Whether a file's name ends so, in any case.
pub(crate) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

/// An argument as it is written for a shell.
pub fn quoted(argument: &str) -> String {
    if argument.contains(char::is_whitespace) { format!("'{argument}'") } else { argument.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_parsed() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        assert_eq!("1X99999999999999999999".parse(), Ok(Size { width: 1, height: u64::MAX }));
        for text in ["", "640", "x", "1x", "-1x1", "1x1x1", "1.5x2"] {
            text.parse::<Size>().unwrap_err();
        }
    }

    #[test]
    fn spans_have_both_ends() {
        assert_eq!("3..7".parse::<Span>().map(Span::range), Ok(3..8));
        assert_eq!("0..0".parse::<Span>().map(Span::range), Ok(0..1));
        for text in ["", "3", "7..3", "..3", "3..", "3..=7", "-1..2", "0..4294967295"] {
            text.parse::<Span>().unwrap_err();
        }
    }
}
