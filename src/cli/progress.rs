//! The line that says how far it is; when stderr is not a terminal, a new one every minute of rendering, or twice a
//! second for a program that asks for that.

use std::cell::Cell;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::{Phase, Session, StopRule};
use crate::terminal::tell;

/// A live line on the terminal.
pub(super) struct Progress {
    bar: ProgressBar,
    /// The frame it is about, and all.
    frame: Option<(u32, RangeInclusive<u32>)>,
    /// Whether a program waits for lines.
    is_watched: bool,
    /// The error shown, and when it was found.
    error: Cell<Option<(Instant, RelativeError)>>,
    /// When a line was last written for a file or another program, or it was begun.
    written: Cell<Instant>,
}

/// What a picture is off by, relative to its light, and what that is called.
pub(super) type RelativeError = (f64, &'static str);

/// A line is written so often where there is no terminal, and where a program waits for it.
const LINE_EVERY: Duration = Duration::from_secs(60);
const WATCHED_EVERY: Duration = Duration::from_millis(500);

/// The error is looked at so often: that takes a look at every pixel, wherever it is.
const ERROR_EVERY: Duration = Duration::from_secs(2);

impl Progress {
    /// Starts with a message; stays invisible unless stderr is a terminal (indicatif looks).
    pub(super) fn start(message: &str) -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed_precise} {msg}") {
            bar.set_style(style);
        }
        bar.set_message(message.to_owned());
        // Its thread would panic where the system gives none, and be for nobody.
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let (error, written) = (Cell::default(), Instant::now().into());
        Self { bar, frame: None, is_watched: false, error, written }
    }

    /// Begins to learn and to render, maybe for a program that waits for lines.
    pub(super) fn of_picture(is_watched: bool) -> Self {
        Self { is_watched, ..Self::start("learning") }
    }

    /// The next one, which says which of the frames it is about.
    pub(super) fn of_frame(&self, number: u32, all: &RangeInclusive<u32>) -> Self {
        let (is_watched, written) = (self.is_watched, self.written.clone());
        Self { frame: Some((number, all.clone())), is_watched, written, ..Self::start("") }
    }

    fn prefix(&self) -> String {
        let Some((number, all)) = &self.frame else { return String::new() };
        format!("frame {number} up to {}: ", all.end())
    }

    /// Share of all frames, of which this one has so large a share behind it.
    fn share(&self, of_frame: f64) -> f64 {
        let Some((number, all)) = &self.frame else { return of_frame };
        let [before, count] = [number - all.start(), all.end() - all.start() + 1].map(f64::from);
        (before + of_frame) / count
    }

    /// Shows another message.
    pub(super) fn say(&self, message: impl Into<String>) {
        self.bar.set_message(self.prefix() + &message.into());
    }

    /// Shows where a session is, the samples of cached light beside it with the seconds they took, and the error, which
    /// is a moment old.
    pub(super) fn show(
        &self,
        session: &Session<'_>,
        rule: &StopRule,
        cached: (u32, f64),
        find_error: impl FnOnce() -> Option<RelativeError>,
    ) {
        let line = || {
            let known = self.error.get().filter(|(at, _)| at.elapsed() < ERROR_EVERY);
            let error = known.or_else(|| Some((Instant::now(), find_error()?)));
            self.error.set(error);
            line(session, rule, error.map(|(_, error)| error), cached)
        };
        let line_every = if self.is_watched { WATCHED_EVERY } else { LINE_EVERY };
        if !self.bar.is_hidden() {
            self.say(line().0);
        } else if self.written.get().elapsed() > line_every {
            self.written.set(Instant::now());
            let (line, share) = line();
            let share = self.is_watched.then(|| format!("{:.1}% ", 100.0 * self.share(share)));
            let share = share.unwrap_or_default();
            tell(format_args!("lightgrid: {share}{}{line}", self.prefix()));
        }
    }

    /// Leaves lines on stderr, above the line.
    pub(super) fn tell(&self, lines: &str) {
        self.bar.suspend(|| lines.lines().for_each(tell));
    }

    /// Removes the line.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Where a session is in words, and the share of its work that is done.
fn line(
    session: &Session<'_>,
    rule: &StopRule,
    error: Option<RelativeError>,
    cached: (u32, f64),
) -> (String, f64) {
    if session.phase() == Phase::Learning {
        let (done, total) = (session.figures().learning_paths, session.view().learning_paths);
        return (format!("learning {}%", 100 * done / total.max(1)), 0.0);
    }
    let samples = session.samples() + cached.0;
    let mut text = rule.samples.map_or_else(
        || format!("rendering, {samples} samples"),
        |limit| format!("rendering, {samples}/{} samples", limit + cached.0),
    );
    if let Some((error, name)) = error {
        text += &format!(", {name} {:.1}%", 100.0 * error);
    }
    // A limit of noise has that shown.
    let noise = error.map_or(f64::INFINITY, |(error, _)| error);
    let Some(left) = seconds_left(session, rule, noise, cached) else { return (text, 0.0) };
    let rendered = session.figures().render_seconds + cached.1;
    (text + &format!(", {} left", in_words(left)), rendered / (rendered + left).max(1e-9))
}

/// Shortest estimate of what the rules leave: samples at the speed so far, the clock, and noise
/// falling with the root of the samples.
fn seconds_left(
    session: &Session<'_>,
    rule: &StopRule,
    noise: f64,
    cached: (u32, f64),
) -> Option<f64> {
    let figures = session.figures();
    let rendered = figures.render_seconds + cached.1;
    let pixels = f64::from(session.view().width) * f64::from(session.view().height);
    let seconds_a_sample = rendered / (figures.samples as f64 / pixels + f64::from(cached.0));
    let left = rule.samples.map(|limit| limit.saturating_sub(session.samples()));
    let by_samples = left.map(|left| seconds_a_sample * f64::from(left));
    let by_clock = rule.seconds.map(|limit| limit - session.figures().elapsed_seconds());
    let by_noise = rule.noise.map(|limit| rendered * ((noise / limit).powi(2) - 1.0));
    let all = [by_samples, by_clock, by_noise].into_iter().flatten();
    let shortest = all.filter(|seconds| seconds.is_finite()).min_by(f64::total_cmp);
    shortest.map(|seconds| seconds.max(0.0))
}

/// Seconds, in the unit that suits them.
fn in_words(seconds: f64) -> String {
    match seconds {
        ..180.0 => format!("{seconds:.0} s"),
        ..7200.0 => format!("{:.0} min", seconds / 60.0),
        ..172_800.0 => format!("{:.0} h", seconds / 3600.0),
        _ => format!("{:.0} days", seconds / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::in_words;

    #[test]
    fn times_are_told_in_units_that_suit_them() {
        let words = [0.4, 179.0, 600.0, 7300.0, 4_552_324.0].map(in_words);
        assert_eq!(words, ["0 s", "179 s", "10 min", "2 h", "53 days"]);
    }
}
