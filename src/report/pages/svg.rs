//! Plots as SVG text: few kinds of elements, so that every viewer shows them.

use std::fmt::Write as _;

/// A drawing in pixels, origin at the top left.
pub(super) struct Svg {
    width: f64,
    height: f64,
    body: String,
}

/// Where a text is held.
#[derive(Debug, Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Ink of axes and texts.
pub(super) const INK: &str = "#3c4043";
/// Ink of grid lines.
pub(super) const FAINT: &str = "#e4e6ea";
/// Ink of what is only there to compare with.
pub(super) const GREY: &str = "#80868b";

impl Svg {
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    pub(super) fn line(
        &mut self,
        a: (f64, f64),
        b: (f64, f64),
        ink: &str,
        width: f64,
        dashes: &str,
    ) {
        let _ = writeln!(
            self.body,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{ink}\" \
             stroke-width=\"{width}\" stroke-dasharray=\"{dashes}\"/>",
            a.0, a.1, b.0, b.1
        );
    }

    pub(super) fn curve(&mut self, points: &[(f64, f64)], ink: &str, width: f64) {
        let _ = writeln!(
            self.body,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\"/>",
            coordinates(points)
        );
    }

    pub(super) fn area(&mut self, points: &[(f64, f64)], ink: &str, opacity: f64) {
        let _ = writeln!(
            self.body,
            "<polygon points=\"{}\" fill=\"{ink}\" fill-opacity=\"{opacity}\" stroke=\"none\"/>",
            coordinates(points)
        );
    }

    pub(super) fn dot(&mut self, (x, y): (f64, f64), radius: f64, ink: &str) {
        let _ = writeln!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{ink}\" stroke=\"#fff\"/>"
        );
    }

    pub(super) fn diamond(&mut self, (x, y): (f64, f64), radius: f64, ink: &str) {
        let points = [(x, y - radius), (x + radius, y), (x, y + radius), (x - radius, y)];
        let _ = writeln!(
            self.body,
            "<polygon points=\"{}\" fill=\"#fff\" stroke=\"{ink}\" stroke-width=\"1.5\"/>",
            coordinates(&points)
        );
    }

    pub(super) fn text(&mut self, (x, y): (f64, f64), anchor: Anchor, ink: &str, text: &str) {
        self.styled_text((x, y), anchor, ink, "", text);
    }

    pub(super) fn bold_text(&mut self, at: (f64, f64), anchor: Anchor, ink: &str, text: &str) {
        self.styled_text(at, anchor, ink, " font-weight=\"600\"", text);
    }

    /// A text that runs upwards.
    pub(super) fn upright_text(&mut self, (x, y): (f64, f64), ink: &str, text: &str) {
        let turn = format!(" transform=\"rotate(-90 {x:.1} {y:.1})\"");
        self.styled_text((x, y), Anchor::Middle, ink, &turn, text);
    }

    fn styled_text(
        &mut self,
        (x, y): (f64, f64),
        anchor: Anchor,
        ink: &str,
        style: &str,
        text: &str,
    ) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{ink}\"{style}>{}</text>",
            super::escape(text)
        );
    }

    /// The whole drawing.
    pub(super) fn finish(self) -> String {
        let Self { width, height, body } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" font-family=\"system-ui, 'Segoe UI', Helvetica, \
             Arial, sans-serif\" font-size=\"13\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n{body}</svg>\n"
        )
    }
}

fn coordinates(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// A logarithmic axis: positive values from `low` to `high` onto pixels from `from` to `to`.
#[derive(Debug, Clone, Copy)]
pub(super) struct LogAxis {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl LogAxis {
    /// Pixel of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + share * (self.to - self.from)
    }

    /// Values to mark, and what to write at them. Over less than two decades 2 and 5 are named too.
    pub(super) fn ticks(&self) -> Vec<(f64, Option<String>)> {
        let decades = (self.high / self.low).log10();
        let mut ticks = Vec::new();
        for exponent in self.low.log10().floor() as i32..=self.high.log10().ceil() as i32 {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(exponent);
                if value < self.low * 0.999 || value > self.high * 1.001 {
                    continue;
                }
                let named = digit == 1
                    || (decades < 2.0 && (digit == 2 || digit == 5))
                    || (decades < 0.7 && digit != 7 && digit != 9);
                ticks.push((value, named.then(|| power_of_ten(digit, exponent))));
            }
        }
        ticks
    }
}

/// `digit` times a power of ten as people write it: 0.02, 5, 300, 10⁻⁴, 2·10⁻⁵.
fn power_of_ten(digit: i32, exponent: i32) -> String {
    match exponent {
        0..=3 => format!("{}", f64::from(digit) * 10f64.powi(exponent)),
        -2..=-1 => format!("{:.*}", (-exponent) as usize, f64::from(digit) * 10f64.powi(exponent)),
        _ if digit == 1 => format!("10{}", superscript(exponent)),
        _ => format!("{digit}·10{}", superscript(exponent)),
    }
}

fn superscript(number: i32) -> String {
    number
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect()
}

/// Moves ascending positions apart until none is nearer than `least` to the next.
pub(super) fn spread(positions: &mut [f64], least: f64) {
    for _ in 0..100 {
        let mut moved = false;
        for i in 1..positions.len() {
            let overlap = least - (positions[i] - positions[i - 1]);
            if overlap > 1e-3 {
                positions[i - 1] -= overlap / 2.0;
                positions[i] += overlap / 2.0;
                moved = true;
            }
        }
        if !moved {
            break;
        }
    }
}
