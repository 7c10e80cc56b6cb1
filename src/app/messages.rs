//! Sentences for the person: what went wrong stays until it is closed, notices go by themselves.

use super::loader::Kind;
use crate::error::Notices;

/// Most messages shown at a time.
const MAX_MESSAGES: usize = 4;
/// Seconds a notice stays.
pub(crate) const NOTICE_SECONDS: f64 = 8.0;

/// One sentence.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Message {
    /// What to say.
    pub sentence: String,
    /// Whether something failed.
    pub is_error: bool,
    /// When it was first drawn, in the window's seconds.
    pub since: Option<f64>,
    /// Of what kind the file is that could not be opened, if it is about one.
    not_opened: Option<Kind>,
}

/// What is to be said, newest last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Messages {
    pub(crate) list: Vec<Message>,
}

impl Messages {
    /// Something worth knowing.
    pub(crate) fn notice(&mut self, sentence: impl Into<String>) {
        self.add(sentence.into(), false, None);
    }

    /// What is worth knowing of one file: the first of it, where it is much.
    pub(crate) fn notices(&mut self, sentences: &Notices) {
        let count = sentences.iter().count();
        let told = if count < MAX_MESSAGES { count } else { MAX_MESSAGES - 2 };
        sentences.iter().take(told).for_each(|sentence| self.notice(sentence));
        if told < count {
            self.notice(format!("{} more notices: run `lightgrid info`", count - told));
        }
    }

    /// Something that failed.
    pub(crate) fn error(&mut self, sentence: impl Into<String>) {
        self.add(sentence.into(), true, None);
    }

    /// That something failed, if it did.
    pub(crate) fn failure(&mut self, outcome: Result<(), impl std::fmt::Display>) {
        outcome.err().into_iter().for_each(|cause| self.error(cause.to_string()));
    }

    /// Several things that failed.
    pub(crate) fn errors(&mut self, sentences: Vec<String>) {
        sentences.into_iter().for_each(|sentence| self.error(sentence));
    }

    /// A file could not be opened in place of another.
    pub(crate) fn not_opened(&mut self, kind: Kind, sentence: impl Into<String>) {
        self.add(sentence.into(), true, Some(kind));
    }

    /// A file was opened: nobody wonders any more why others of its kind were not.
    pub(crate) fn opened(&mut self, kind: Kind) {
        self.list.retain(|message| message.not_opened != Some(kind));
    }

    fn add(&mut self, sentence: String, is_error: bool, not_opened: Option<Kind>) {
        self.list.retain(|message| message.sentence != sentence);
        self.list.push(Message { sentence, is_error, since: None, not_opened });
        if self.list.len() > MAX_MESSAGES {
            // Errors stay until somebody closes them, as long as there is room.
            let first_notice = self.list.iter().position(|message| !message.is_error);
            self.list.remove(first_notice.unwrap_or(0));
        }
    }

    /// The oldest error.
    pub(crate) fn first_error(&self) -> Option<&str> {
        self.list.iter().find(|m| m.is_error).map(|m| m.sentence.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(messages: &mut Messages) -> Vec<String> {
        messages.list.iter().map(|message| message.sentence.clone()).collect()
    }

    #[test]
    fn errors_outlast_notices_and_files_of_another_kind() {
        let mut messages = Messages::default();
        messages.not_opened(Kind::Scene, "no scene");
        (0..6).for_each(|i| messages.notice(i.to_string()));
        assert_eq!(said(&mut messages), ["no scene", "3", "4", "5"]);
        messages.opened(Kind::Map);
        assert_eq!(messages.first_error(), Some("no scene"));
        messages.opened(Kind::Scene);
        assert_eq!(messages.first_error(), None);
    }

    #[test]
    fn of_many_notices_of_a_file_it_is_said_how_many_there_are() {
        let mut messages = Messages::default();
        let mut notices = Notices::default();
        (0..3).for_each(|i| notices.add(i.to_string()));
        messages.notices(&notices);
        assert_eq!(said(&mut messages), ["0", "1", "2"]);
        notices.add("3");
        messages.notices(&notices);
        assert_eq!(said(&mut messages)[1..], ["0", "1", "2 more notices: run `lightgrid info`"]);
    }
}
