//! The one error type: a sentence a person can act on.

use std::fmt;
use std::path::Path;

/// What went wrong, as one clear sentence that names the file (if any) and the cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    message: String,
}

/// Result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// What a decoder returns: the error is the cause, to which the caller adds the file's name.
pub(crate) type Decoded<T> = std::result::Result<T, String>;

impl Error {
    /// An error that is not about one file.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }

    /// An error about a file: reads `PATH: cause`, the cause on one line.
    pub fn at(path: impl AsRef<Path>, cause: impl fmt::Display) -> Self {
        let cause = cause.to_string();
        let lines: Vec<&str> = cause.lines().map(str::trim).collect();
        Self::new(format!("{}: {}", path.as_ref().display(), lines.join(" ")))
    }
}

/// Says which file a failure is about.
pub(crate) trait At<T> {
    /// With an error that is [`Error::at`] this file.
    fn at(self, path: impl AsRef<Path>) -> Result<T>;
}

impl<T, E: fmt::Display> At<T> for std::result::Result<T, E> {
    fn at(self, path: impl AsRef<Path>) -> Result<T> {
        self.map_err(|cause| Error::at(path, cause))
    }
}

impl Error {
    /// Whether nothing failed, else all that did.
    ///
    /// # Errors
    /// The failures, if there are any.
    pub fn all(failures: Vec<Self>) -> Result<()> {
        let messages: Vec<String> = failures.into_iter().map(|failure| failure.message).collect();
        if messages.is_empty() { Ok(()) } else { Err(Self::new(messages.join("; "))) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// Things a user should know that are not errors: what was repaired, skipped or assumed.
///
/// Each notice is one sentence; the same sentence is kept once.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notices {
    sentences: Vec<String>,
}

impl Notices {
    /// More than so many nobody reads.
    const MAX_NOTICES: usize = 100;

    /// Adds a sentence unless it is already there.
    pub fn add(&mut self, sentence: impl Into<String>) {
        let sentence = match self.sentences.len() {
            0..Self::MAX_NOTICES => sentence.into(),
            _ => "there is more of the kind, left out here".to_owned(),
        };
        if self.sentences.len() <= Self::MAX_NOTICES && !self.sentences.contains(&sentence) {
            self.sentences.push(sentence);
        }
    }

    /// Adds all of another list.
    pub fn extend(&mut self, other: &Self) {
        for sentence in other.iter() {
            self.add(sentence);
        }
    }

    /// The sentences in the order they came.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.sentences.iter().map(String::as_str)
    }

    /// Whether there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.sentences.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_one_line() {
        let error = Error::at("a.glb", "too many points,\n   more than  fit");
        assert_eq!(error.to_string(), "a.glb: too many points, more than  fit");
    }
}
