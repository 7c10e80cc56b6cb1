//! Sentences for the person: what went wrong stays until it is closed, notices go by themselves.

/// Most messages shown at a time.
const MOST: usize = 4;
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
    /// Whether it is about a file that could not be opened.
    is_of_opening: bool,
}

/// What is to be said, newest last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Messages {
    list: Vec<Message>,
}

impl Messages {
    /// Something worth knowing.
    pub(crate) fn notice(&mut self, sentence: impl Into<String>) {
        self.add(sentence.into(), false, false);
    }

    /// Something that failed.
    pub(crate) fn error(&mut self, sentence: impl Into<String>) {
        self.add(sentence.into(), true, false);
    }

    /// A file could not be opened.
    pub(crate) fn not_opened(&mut self, sentence: impl Into<String>) {
        self.add(sentence.into(), true, true);
    }

    /// A file was opened: nobody wonders any more why others were not.
    pub(crate) fn opened(&mut self) {
        self.list.retain(|message| !message.is_of_opening);
    }

    fn add(&mut self, sentence: String, is_error: bool, is_of_opening: bool) {
        self.list.retain(|message| message.sentence != sentence);
        self.list.push(Message { sentence, is_error, since: None, is_of_opening });
        if self.list.len() > MOST {
            self.list.remove(0);
        }
    }

    /// The messages, to be drawn and closed.
    pub(crate) fn list(&mut self) -> &mut Vec<Message> {
        &mut self.list
    }

    /// The oldest error.
    pub(crate) fn first_error(&self) -> Option<&str> {
        self.list.iter().find(|m| m.is_error).map(|m| m.sentence.as_str())
    }
}
