//! The one way to speak to whoever started the program. It cannot panic: what is printed is never worth
//! the work that is done.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};

use crate::error::{Error, Result};

/// Prints a line that was asked for, on stdout. If nobody reads it any more (`| head`) the process
/// ends in silence, as other commands do.
///
/// # Errors
/// If stdout takes nothing, as on a full disk.
pub(crate) fn print(text: impl Display) -> Result<()> {
    let line = shown(&format!("{text}\n"));
    let mut stdout = io::stdout().lock();
    match stdout.write_all(line.as_bytes()).and_then(|()| stdout.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => Err(not_printed(&error)),
    }
}

/// Why stdout did not take what was asked for.
pub(crate) fn not_printed(cause: &io::Error) -> Error {
    Error::new(format!("what was asked for cannot be printed: {cause}"))
}

/// Says a line on stderr, if anybody is there to be told. It stays one, whatever names are in it.
pub(crate) fn tell(text: impl Display) {
    let line = one_line(&text.to_string()) + "\n";
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Leaves the line on which a terminal shows `^C`, and progress.
pub(crate) fn leave_line() {
    if io::stderr().is_terminal() {
        tell("");
    }
}

/// Says what a person should know, though nothing failed.
pub(crate) fn notice(text: impl Display) {
    tell(format_args!("notice: {text}"));
}

/// Names come from files, and some characters command a terminal or turn the text around: these become
/// escapes (in JSON's way, so that JSON stays what it is).
fn shown(text: &str) -> String {
    let is_layout = |c| matches!(c, '\n' | '\t');
    escaped(text, |c| c.is_control() && !is_layout(c))
}

/// As [`print`] and [`tell`] show text, with line breaks as escapes, too: a name must not look like a line
/// of ours.
pub(crate) fn one_line(text: &str) -> String {
    escaped(text, |c| c.is_control() && c != '\t')
}

fn escaped(text: &str, commands: impl Fn(char) -> bool) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if commands(c) || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}') {
            shown.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            shown.push(c);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::{one_line, shown};

    #[test]
    fn what_commands_a_terminal_is_shown_and_the_rest_is_kept() {
        assert_eq!(shown("a\u{1b}[31mb\u{9b}c\r\u{202e}d"), "a\\u001b[31mb\\u009bc\\u000d\\u202ed");
        assert_eq!(shown("größe\t日本\n🎨"), "größe\t日本\n🎨");
        assert_eq!(one_line("größe\t日本\n🎨\u{2028}"), "größe\t日本\\u000a🎨\\u2028");
    }
}
