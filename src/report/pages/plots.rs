//! The two plots: error against time, and speed-ups with their intervals.

use super::super::statistics::{Bundle, Interval};
use super::super::summary::{DeviceReport, Measure, curves};
use super::svg::{Anchor, FAINT, GREY, INK, LogAxis, Svg, spread};

/// Inks that people with any kind of colour vision tell apart (Okabe and Ito 2008).
const INKS: [&str; 9] = [
    "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#8a6d00", "#5d4fb3", "#444444", "#56b4e9",
    "#e69f00",
];

/// The ink of a method, of which this is the so-manyth.
pub(super) fn ink(name: &str, index: usize) -> &'static str {
    match name {
        "plain" => INKS[0],
        "talk" => INKS[1],
        "adaptive" => INKS[2],
        "bsdf" => INKS[3],
        _ => INKS[4 + index % 5],
    }
}

/// Error against time of all methods on one device; `None` before anything is known.
pub(super) fn error_plot(device: &DeviceReport, measure: Measure, end: f64) -> Option<String> {
    let bundles: Vec<(usize, Bundle)> = device
        .methods
        .iter()
        .enumerate()
        .filter_map(|(i, m)| Some((i, Bundle::new(&curves(&m.runs, measure), end)?)))
        .collect();
    let means: Vec<Vec<(f64, f64, f64)>> = bundles
        .iter()
        .map(|(_, bundle)| {
            let estimates = bundle.estimates();
            bundle
                .seconds
                .iter()
                .zip(estimates)
                .filter_map(|(t, e)| e.map(|e| (*t, e.mean, e.standard_error.unwrap_or(0.0))))
                .filter(|(_, mean, _)| *mean > 0.0)
                .collect()
        })
        .collect();
    let all = || means.iter().flatten();
    let start = all().map(|p| p.0).reduce(f64::min)?;
    let low = all().map(|p| (p.1 - p.2).max(0.5 * p.1)).reduce(f64::min)?;
    let high = all().map(|p| p.1 + p.2).reduce(f64::max)?;
    let mut svg = Svg::new(560.0, 400.0);
    let x = LogAxis { low: start * 0.95, high: end, from: 70.0, to: 460.0 };
    let y = LogAxis { low: low * 0.8, high: high * 1.25, from: 340.0, to: 44.0 };
    let title = format!("{}: {}", device.device.title(), measure.title());
    svg.bold_text((x.from, 24.0), Anchor::Start, INK, &title);
    axes(&mut svg, x, y);
    svg.text((265.0, 388.0), Anchor::Middle, INK, "seconds (table, learning, rendering)");
    svg.upright_text((18.0, 192.0), INK, measure.title());
    guide(&mut svg, x, y);
    let mut ends: Vec<(f64, &str, &str)> = Vec::new();
    for ((index, _), mean) in bundles.iter().zip(&means) {
        let name = device.methods[*index].method.name.as_str();
        let ink = ink(name, *index);
        let at = |t: f64, e: f64| (x.at(t), y.at(e.max(y.low)));
        let upper = mean.iter().map(|(t, e, s)| at(*t, e + s));
        let lower = mean.iter().rev().map(|(t, e, s)| at(*t, e - s));
        svg.area(&upper.chain(lower).collect::<Vec<_>>(), ink, 0.18);
        svg.curve(&mean.iter().map(|(t, e, _)| at(*t, *e)).collect::<Vec<_>>(), ink, 2.2);
        if let Some((_, e, _)) = mean.last() {
            ends.push((y.at(*e), name, ink));
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut heights: Vec<f64> = ends.iter().map(|end| end.0).collect();
    spread(&mut heights, 16.0);
    for ((_, name, ink), height) in ends.iter().zip(heights) {
        svg.bold_text((x.to + 8.0, height + 4.5), Anchor::Start, ink, name);
    }
    svg.text((x.to, 24.0), Anchor::End, GREY, "line: mean, band: ± standard error");
    Some(svg.finish())
}

fn axes(svg: &mut Svg, x: LogAxis, y: LogAxis) {
    for (value, name) in x.ticks() {
        let at = x.at(value);
        svg.line((at, y.from), (at, y.to), FAINT, if name.is_some() { 1.2 } else { 0.6 }, "");
        if let Some(name) = name {
            svg.text((at, y.from + 20.0), Anchor::Middle, INK, &name);
        }
    }
    for (value, name) in y.ticks() {
        let at = y.at(value);
        svg.line((x.from, at), (x.to, at), FAINT, if name.is_some() { 1.2 } else { 0.6 }, "");
        if let Some(name) = name {
            svg.text((x.from - 8.0, at + 4.5), Anchor::End, INK, &name);
        }
    }
    svg.line((x.from, y.from), (x.to, y.from), INK, 1.2, "");
    svg.line((x.from, y.from), (x.from, y.to), INK, 1.2, "");
}

/// A line of slope -1 in the lower left, where curves are not.
fn guide(svg: &mut Svg, x: LogAxis, y: LogAxis) {
    let start = x.low * (x.high / x.low).powf(0.04);
    let bottom = y.low * (y.high / y.low).powf(0.04);
    let factor = (x.high / x.low).powf(0.25).min((y.high / y.low).powf(0.3));
    let (a, b) = ((x.at(start), y.at(bottom * factor)), (x.at(start * factor), y.at(bottom)));
    svg.line(a, b, GREY, 1.2, "5 4");
    svg.text(((a.0 + b.0) / 2.0 + 8.0, (a.1 + b.1) / 2.0 - 2.0), Anchor::Start, GREY, "slope −1");
}

/// A line of the plot of speed-ups.
pub(super) struct Entry {
    /// Left of the axis.
    pub(super) title: String,
    /// Name, ratio, interval.
    pub(super) ratios: Vec<(String, f64, Option<Interval>)>,
    /// What others published.
    pub(super) published: Option<f64>,
    /// What is asked for.
    pub(super) target: Option<f64>,
}

/// Height of a marker's lane.
const LANE: f64 = 13.0;

/// Speed-ups over `baseline`, entry by entry; `None` if there are none.
pub(super) fn ratio_plot(title: &str, baseline: &str, entries: &[Entry]) -> Option<String> {
    let values = || {
        entries.iter().flat_map(|entry| {
            let ratios = entry.ratios.iter().flat_map(|(_, ratio, interval)| {
                [Some(*ratio), interval.map(|i| i.low), interval.map(|i| i.high)]
            });
            ratios.chain([entry.published, entry.target]).flatten().filter(|v| *v > 0.0)
        })
    };
    let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
    let mut names: Vec<&str> = Vec::new();
    for (name, ..) in entries.iter().flat_map(|entry| &entry.ratios) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    // Where each entry is one of them its title says so.
    let has_legend = entries.iter().any(|entry| entry.ratios.len() > 1) || names.len() <= 4;
    let marks = if has_legend { legend(&names, entries) } else { Vec::new() };
    let lanes = |entry: &Entry| entry.ratios.len().max(1) as f64;
    let gap = if has_legend { 14.0 } else { 5.0 };
    let height: f64 = entries.iter().map(|entry| lanes(entry) * LANE + gap).sum();
    let top = 20.0 + marks.last().map_or(FIRST_LINE, |mark| mark.at.1);
    let widest = entries.iter().map(|e| e.title.chars().count()).max()?;
    let from = (widest as f64 * 6.6 + 24.0).clamp(110.0, 300.0);
    let mut svg = Svg::new(820.0, top + height + 50.0);
    let x = LogAxis { low: low.min(0.8) * 0.9, high: high.max(1.6) * 1.1, from, to: 790.0 };
    let (bottom, mut y) = (top + height, top);
    svg.bold_text((16.0, 24.0), Anchor::Start, INK, title);
    marks.iter().for_each(|mark| mark.draw(&mut svg));
    for (value, name) in x.ticks() {
        svg.line((x.at(value), top), (x.at(value), bottom), FAINT, 1.0, "");
        if let Some(name) = name {
            svg.text((x.at(value), bottom + 18.0), Anchor::Middle, INK, &name);
        }
    }
    svg.line((x.at(1.0), top - 4.0), (x.at(1.0), bottom), INK, 1.4, "");
    let below = format!("times faster than {baseline} to the same error (1: as fast)");
    svg.text(((x.from + x.to) / 2.0, bottom + 38.0), Anchor::Middle, INK, &below);
    for entry in entries {
        let middle = y + lanes(entry) * LANE / 2.0;
        svg.text((x.from - 12.0, middle + 4.5), Anchor::End, INK, &entry.title);
        if let Some(target) = entry.target {
            let at = x.at(target);
            svg.line((at, y - 2.0), (at, y + lanes(entry) * LANE + 2.0), GREY, 2.0, "2 2");
        }
        for (lane, (name, ratio, interval)) in entry.ratios.iter().enumerate() {
            let number = names.iter().position(|other| other == name).unwrap_or_default();
            let (ink, at) = (ink(name, number), y + (lane as f64 + 0.5) * LANE);
            if let Some(Interval { low, high }) = interval {
                svg.line((x.at(*low), at), (x.at(*high), at), ink, 2.2, "");
            }
            svg.dot((x.at(*ratio), at), 4.6, ink);
        }
        if let Some(published) = entry.published {
            svg.diamond((x.at(published), middle), 5.0, GREY);
        }
        y += lanes(entry) * LANE + gap;
    }
    Some(svg.finish())
}

/// Where the first line of a legend lies, and where each ends.
const FIRST_LINE: f64 = 44.0;
const END_OF_LINE: f64 = 800.0;

/// One mark of a legend and what it stands for.
struct Mark<'a> {
    at: (f64, f64),
    ink: &'a str,
    sign: Sign,
    text: &'a str,
}

enum Sign {
    Dot,
    None,
    Diamond,
    Dashes,
}

impl Mark<'_> {
    fn draw(&self, svg: &mut Svg) {
        let (x, y) = self.at;
        match self.sign {
            Sign::Dot => svg.dot((x, y), 4.6, self.ink),
            Sign::None => {}
            Sign::Diamond => svg.diamond((x, y), 5.0, self.ink),
            Sign::Dashes => svg.line((x, y - 7.0), (x, y + 7.0), self.ink, 2.0, "2 2"),
        }
        let at = (x + 9.0, y + 4.5);
        match self.sign {
            Sign::Dot => svg.bold_text(at, Anchor::Start, self.ink, self.text),
            _ => svg.text(at, Anchor::Start, self.ink, self.text),
        }
    }
}

/// The marks of a legend, line by line.
fn legend<'a>(names: &[&'a str], entries: &[Entry]) -> Vec<Mark<'a>> {
    let mut signs: Vec<(&str, Sign, &str)> = Vec::new();
    signs.extend(names.iter().zip(0..).map(|(name, i)| (ink(name, i), Sign::Dot, *name)));
    signs.push((GREY, Sign::None, "bar: 95 % interval"));
    if entries.iter().any(|entry| entry.published.is_some()) {
        signs.push((GREY, Sign::Diamond, "the talk's figure"));
    }
    if entries.iter().any(|entry| entry.target.is_some()) {
        signs.push((GREY, Sign::Dashes, "target"));
    }
    let mut at = (24.0, FIRST_LINE);
    let place = |(ink, sign, text): (&'a str, Sign, &'a str)| {
        let width = 32.0 + 7.5 * text.chars().count() as f64;
        if at.0 + width > END_OF_LINE {
            at = (24.0, at.1 + 20.0);
        }
        let mark = Mark { at, ink, sign, text };
        at.0 += width;
        mark
    };
    signs.into_iter().map(place).collect()
}
