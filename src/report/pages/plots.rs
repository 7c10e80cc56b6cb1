//! The two plots as SVG: error against time, and speed-ups with their intervals.

use askama::Template;

use super::super::statistics::{Bundle, Interval};
use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport, curves};

/// Inks that people with any kind of colour vision tell apart (Okabe and Ito 2008).
const INKS: [&str; 9] = [
    "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#8a6d00", "#5d4fb3", "#444444", "#56b4e9",
    "#e69f00",
];

/// The ink of the method of this name and index in its plan.
fn ink(name: &str, index: usize) -> &'static str {
    let own = ["plain", "talk", "adaptive", "bsdf"].iter().position(|own| *own == name);
    INKS[own.unwrap_or(4 + index % 5)]
}

/// A coordinate to a tenth of a pixel, so that it has one digit after the point as text.
fn pixel(coordinate: f64) -> f64 {
    (10.0 * coordinate).round() / 10.0
}

/// A logarithmic axis: positive values from `low` to `high` onto pixels from `from` to `to`.
#[derive(Clone, Copy)]
struct LogAxis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

/// A mark on an axis: its pixel, and the number beside it, if any.
struct Tick {
    at: f64,
    name: String,
}

impl LogAxis {
    /// Pixel of a value.
    fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        pixel(self.from + share * (self.to - self.from))
    }

    /// Marks at the digits of each decade. Over less than two decades 2 and 5 are named too, over less
    /// than 0.7 all but 7 and 9.
    fn ticks(&self) -> Vec<Tick> {
        let decades = (self.high / self.low).log10();
        let exponents = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let digits = exponents.flat_map(|exponent| (1..10).map(move |digit| (digit, exponent)));
        let tick = |(digit, exponent): (i32, i32)| {
            let value = f64::from(digit) * 10f64.powi(exponent);
            let is_named = match digit {
                1 => true,
                2 | 5 => decades < 2.0,
                7 | 9 => false,
                _ => decades < 0.7,
            };
            let name = if is_named { scientific(digit, exponent) } else { String::new() };
            let is_inside = (self.low * 0.999..=self.high * 1.001).contains(&value);
            is_inside.then(|| Tick { at: self.at(value), name })
        };
        digits.filter_map(tick).collect()
    }
}

/// `digit` times a power of ten, such as 0.02, 5, 300, 10⁻⁴, 2·10⁻⁵.
fn scientific(digit: i32, exponent: i32) -> String {
    if (-2..=3).contains(&exponent) {
        let decimals = (-exponent).max(0) as usize;
        return format!("{:.decimals$}", f64::from(digit) * 10f64.powi(exponent));
    }
    let superscript = |c: char| {
        c.to_digit(10).and_then(|digit| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit as usize)).unwrap_or('⁻')
    };
    let power: String = exponent.to_string().chars().map(superscript).collect();
    if digit == 1 { format!("10{power}") } else { format!("{digit}·10{power}") }
}

/// Error against time of all methods on one device, with one curve a method.
#[derive(Template)]
#[template(path = "error_plot.svg", whitespace = "minimize")]
struct ErrorPlot<'a> {
    device: &'a str,
    measure: &'a str,
    x: LogAxis,
    y: LogAxis,
    /// Ends of a line of slope -1.
    guide: ((f64, f64), (f64, f64)),
    curves: Vec<ErrorCurve<'a>>,
}

/// A method's mean error over time: points as SVG writes them.
struct ErrorCurve<'a> {
    name: &'a str,
    ink: &'static str,
    line: String,
    /// One standard error above and below.
    band: String,
    /// Height of the name beside the end of the line.
    name_y: f64,
}

/// Least distance of two names beside their curves.
const NAME_HEIGHT: f64 = 16.0;

/// The plot of a device; `None` before there are errors. `end` is the time of a run in seconds.
pub(super) fn error_plot(device: &DeviceReport, end: f64) -> Option<String> {
    let measure = Measure::TrimmedRelMse;
    let mean_errors = |(index, method): (usize, &'_ MethodReport)| {
        let bundle = Bundle::new(&curves(&method.runs, measure), end)?;
        let points: Vec<(f64, f64, f64)> = bundle
            .seconds
            .iter()
            .zip(bundle.estimates())
            .filter_map(|(t, e)| e.map(|e| (*t, e.mean, e.standard_error.unwrap_or(0.0))))
            .filter(|(_, mean, _)| *mean > 0.0)
            .collect();
        (!points.is_empty()).then_some((index, points))
    };
    let means: Vec<_> = device.methods.iter().enumerate().filter_map(mean_errors).collect();
    let all = || means.iter().flat_map(|(_, points)| points);
    let start = all().map(|p| p.0).reduce(f64::min)?;
    let low = all().map(|p| (p.1 - p.2).max(0.5 * p.1)).fold(f64::INFINITY, f64::min);
    let high = all().map(|p| p.1 + p.2).fold(0.0, f64::max);
    let x = LogAxis { low: start * 0.95, high: end, from: 70.0, to: 460.0 };
    let y = LogAxis { low: low * 0.8, high: high * 1.25, from: 340.0, to: 44.0 };
    let curve = |(index, points): &(usize, Vec<(f64, f64, f64)>)| {
        let at = |t: f64, error: f64| format!("{},{}", x.at(t), y.at(error.max(y.low)));
        let upper = points.iter().map(|(t, e, s)| at(*t, e + s));
        let lower = points.iter().rev().map(|(t, e, s)| at(*t, e - s));
        let line: Vec<String> = points.iter().map(|(t, e, _)| at(*t, *e)).collect();
        let name = device.methods[*index].method.name.as_str();
        ErrorCurve {
            name,
            ink: ink(name, *index),
            line: line.join(" "),
            band: upper.chain(lower).collect::<Vec<_>>().join(" "),
            name_y: points.last().map_or(y.from, |(_, e, _)| y.at(*e)),
        }
    };
    let mut curves: Vec<ErrorCurve<'_>> = means.iter().map(curve).collect();
    spread_names(&mut curves, y.from);
    let plot = ErrorPlot {
        device: device.device.title(),
        measure: measure.title(),
        x,
        y,
        guide: guide(x, y),
        curves,
    };
    Some(plot.to_string())
}

/// Moves names apart, downwards as far as `bottom` and upwards from there.
fn spread_names(curves: &mut [ErrorCurve<'_>], bottom: f64) {
    curves.sort_by(|a, b| a.name_y.total_cmp(&b.name_y));
    let mut above = f64::NEG_INFINITY;
    for curve in curves.iter_mut() {
        curve.name_y = curve.name_y.max(above + NAME_HEIGHT);
        above = curve.name_y;
    }
    let mut below = bottom + NAME_HEIGHT;
    for curve in curves.iter_mut().rev() {
        curve.name_y = pixel(curve.name_y.min(below - NAME_HEIGHT));
        below = curve.name_y;
    }
}

/// Ends of a line of slope -1 in the lower left, where no curve is.
fn guide(x: LogAxis, y: LogAxis) -> ((f64, f64), (f64, f64)) {
    let start = x.low * (x.high / x.low).powf(0.04);
    let bottom = y.low * (y.high / y.low).powf(0.04);
    let factor = (x.high / x.low).powf(0.25).min((y.high / y.low).powf(0.3));
    ((x.at(start), y.at(bottom * factor)), (x.at(start * factor), y.at(bottom)))
}

/// Speed-ups over `baseline`, a bar each, in groups.
#[derive(Template)]
#[template(path = "speed_up_plot.svg", whitespace = "minimize")]
struct SpeedUpPlot<'a> {
    title: &'a str,
    baseline: &'a str,
    x: LogAxis,
    top: f64,
    bottom: f64,
    has_legend: bool,
    has_published: bool,
    has_target: bool,
    /// Methods and their inks.
    names: Vec<(&'a str, &'static str)>,
    groups: Vec<Group<'a>>,
}

/// Bars under one title.
#[derive(Default)]
pub(super) struct Group<'a> {
    title: String,
    bars: Vec<Bar<'a>>,
    /// What others published.
    published: Option<f64>,
    /// What is asked for.
    target: Option<f64>,
    top: f64,
    bottom: f64,
}

/// The speed-up of a method.
pub(super) struct Bar<'a> {
    name: &'a str,
    ink: &'static str,
    ratio: f64,
    interval: Option<Interval>,
    y: f64,
}

/// Height of a bar's lane.
const LANE: f64 = 13.0;

impl<'a> Group<'a> {
    /// All methods of a row on a device.
    pub(super) fn of_row(report: &'a Report, row: &RowReport, device: &'a DeviceReport) -> Self {
        Self {
            title: format!("{}, {}", row.row.title, device.device.title()),
            bars: Bar::all(device, report.baseline()).collect(),
            published: row.row.published_on(device.device),
            target: row.row.target,
            ..Self::default()
        }
    }

    /// One bar with its method's name.
    pub(super) fn of_method(bar: Bar<'a>) -> Self {
        Self { title: bar.name.to_owned(), bars: vec![bar], ..Self::default() }
    }

    /// Places the group below `top`, and its bars in it.
    fn place(&mut self, top: f64) {
        self.top = top;
        self.bottom = top + self.bars.len().max(1) as f64 * LANE;
        let lanes = self.bars.iter_mut().zip(0..);
        lanes.for_each(|(bar, lane)| bar.y = top + (f64::from(lane) + 0.5) * LANE);
    }

    fn middle(&self) -> f64 {
        pixel(f64::midpoint(self.top, self.bottom))
    }
}

impl<'a> Bar<'a> {
    /// Of the method of this name and index in its plan.
    pub(super) fn new(name: &'a str, index: usize, ratio: f64, interval: Option<Interval>) -> Self {
        Self { name, ink: ink(name, index), ratio, interval, y: 0.0 }
    }

    /// Those of a device's methods that have a speed-up over the baseline.
    pub(super) fn all(device: &'a DeviceReport, baseline: &str) -> impl Iterator<Item = Self> {
        device.methods.iter().enumerate().filter_map(move |(index, m)| {
            let found = m.speed_up(baseline, Measure::TrimmedRelMse)?;
            Some(Self::new(&m.method.name, index, found.ratio, found.interval))
        })
    }
}

/// The plot of groups; `None` if they have no bars.
pub(super) fn speed_up_plot(
    title: &str,
    baseline: &str,
    mut groups: Vec<Group<'_>>,
) -> Option<String> {
    let (mut low, mut high) = (0.8_f64, 1.6_f64);
    let mut names: Vec<(&str, &str)> = Vec::new();
    for group in &groups {
        let ends = |bar: &Bar<'_>| {
            let interval = bar.interval.map(|i| [i.low, i.high]);
            [bar.ratio].into_iter().chain(interval.into_iter().flatten())
        };
        let values = group.bars.iter().flat_map(ends).chain(group.published).chain(group.target);
        for value in values.filter(|v| *v > 0.0) {
            (low, high) = (low.min(value), high.max(value));
        }
        for bar in &group.bars {
            if names.iter().all(|(name, _)| *name != bar.name) {
                names.push((bar.name, bar.ink));
            }
        }
    }
    let widths = groups.iter().map(|group| group.title.chars().count());
    let widest = widths.max().filter(|_| !names.is_empty())?;
    // Without one each group is a single method, which its title names.
    let has_legend = groups.iter().any(|group| group.bars.len() > 1) || names.len() <= 4;
    let (top, gap) = if has_legend { (84.0, 14.0) } else { (40.0, 5.0) };
    let mut bottom = top;
    for group in &mut groups {
        group.place(bottom);
        bottom = group.bottom + gap;
    }
    let from = pixel((widest as f64 * 6.6 + 24.0).clamp(110.0, 300.0));
    let x = LogAxis { low: low * 0.9, high: high * 1.1, from, to: 790.0 };
    let plot = SpeedUpPlot {
        title,
        baseline,
        x,
        top,
        bottom,
        has_legend,
        has_published: groups.iter().any(|group| group.published.is_some()),
        has_target: groups.iter().any(|group| group.target.is_some()),
        names,
        groups,
    };
    Some(plot.to_string())
}
