//! Looks: tables that map the colours of a developed picture to others, from `.cube` files or built in.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use crate::error::{At as _, Decoded, Error, Result};
use crate::image::read_file;
use crate::memory;

/// Largest number of entries along a side: 34 MB on a device.
const MAX_SIDE: usize = 128;
/// Entries along a side of tables that are made here.
const SIDE: usize = 33;

/// A table of colours over sRGB colours, all in display encoding; clones share it, and only those are equal.
#[derive(Clone)]
pub struct Lut(Arc<Table>);

struct Table {
    name: String,
    side: usize,
    /// `side^3` colours in `[0,1]`, red fastest; the fourth component is for devices.
    entries: Vec<[f32; 4]>,
}

impl fmt::Debug for Lut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Lut({})", self.name())
    }
}

impl PartialEq for Lut {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Lut {
    /// The look of a name: `look:NAME`, or a `.cube` file.
    ///
    /// # Errors
    /// One sentence: there is no such look, or the file cannot be read.
    pub fn read(name: &str) -> Result<Self> {
        let Some(built_in) = name.strip_prefix("look:") else {
            let bytes = read_file(Path::new(name)).at(name)?;
            return Self::from_cube(name, &String::from_utf8_lossy(&bytes)).at(name);
        };
        let look = BUILT_IN.iter().find(|look| look.name == built_in).ok_or_else(|| {
            let names: Vec<_> = Self::built_in().collect();
            Error::at(name, format!("there is no such look ({})", names.join(", ")))
        })?;
        Ok(Self::tabulated(name, SIDE, |rgb| look.apply(rgb)))
    }

    /// Names of all built-in looks.
    pub fn built_in() -> impl Iterator<Item = String> {
        BUILT_IN.iter().map(|look| format!("look:{}", look.name))
    }

    /// Whether a name is that of a built-in look and of no file.
    pub fn is_built_in(name: &str) -> bool {
        name.starts_with("look:")
    }

    /// What it was read by.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Entries along a side.
    pub(crate) fn side(&self) -> u32 {
        self.0.side as u32
    }

    /// Its colours, red fastest.
    pub(crate) fn entries(&self) -> &[[f32; 4]] {
        &self.0.entries
    }

    /// The table of a function.
    fn tabulated(name: &str, side: usize, color: impl Fn(Vec3) -> Vec3) -> Self {
        let last = (side - 1) as f32;
        let entry = |i| {
            let place = [i % side, i / side % side, i / (side * side)];
            let color = color(Vec3::from(place.map(|i| i as f32)) / last);
            color.clamp(Vec3::ZERO, Vec3::ONE).extend(0.0).to_array()
        };
        let entries = (0..side.pow(3)).map(entry).collect();
        Self(Arc::new(Table { name: name.to_owned(), side, entries }))
    }

    /// The table that the text of a `.cube` file holds (Adobe, "Cube LUT Specification 1.0", 2013). Tables of single
    /// channels, and those over other ranges than `[0,1]`, are sampled anew.
    fn from_cube(name: &str, text: &str) -> Decoded<Self> {
        let (mut size, mut low, mut high) = (None, Vec3::ZERO, Vec3::ONE);
        let mut rows: Vec<Vec3> = Vec::new();
        for (i, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let mut words = line.split_whitespace();
            let Some(word) = words.next().filter(|word| !word.starts_with('#')) else { continue };
            let misread = || format!("line {} is none of a .cube file", i + 1);
            let number = |word: &str| word.parse::<f32>().ok().filter(|x| x.is_finite());
            let numbers = |words: &mut dyn Iterator<Item = &str>| -> Decoded<Vec3> {
                let numbers: Option<Vec<f32>> = words.map(number).collect();
                let three = numbers.and_then(|numbers| <[f32; 3]>::try_from(numbers).ok());
                three.map(Vec3::from).ok_or_else(misread)
            };
            match word {
                "TITLE" => {}
                "LUT_1D_SIZE" | "LUT_3D_SIZE" => {
                    let (is_solid, count) = (word == "LUT_3D_SIZE", words.next());
                    let count = count.and_then(|count| count.parse().ok()).ok_or_else(misread)?;
                    let most = if is_solid { MAX_SIDE } else { 65_536 };
                    if size.is_some() || !(2..=most).contains(&count) {
                        return Err(format!("{word} is to be there once, from 2 to {most}"));
                    }
                    size = Some((is_solid, count));
                    let rows_in_all = if is_solid { count.pow(3) } else { count };
                    rows = memory::reserved(rows_in_all as u64)?;
                }
                "DOMAIN_MIN" => low = numbers(&mut words)?,
                "DOMAIN_MAX" => high = numbers(&mut words)?,
                "LUT_1D_INPUT_RANGE" | "LUT_3D_INPUT_RANGE" => {
                    let ends: Vec<f32> = words.filter_map(number).collect();
                    let [from, to] = ends.try_into().map_err(|_| misread())?;
                    (low, high) = (Vec3::splat(from), Vec3::splat(to));
                }
                _ => rows.push(numbers(&mut std::iter::once(word).chain(words))?),
            }
        }
        let (is_solid, side) = size.ok_or("it has no LUT_3D_SIZE, as .cube files have")?;
        let count = if is_solid { side.pow(3) } else { side };
        if rows.len() != count {
            return Err(format!("it has {} colours in place of {count}", rows.len()));
        }
        if !low.cmplt(high).all() {
            return Err("its range of colours is empty".to_owned());
        }
        if !is_solid {
            let channel = |x: f32, c: usize| {
                let place = x.clamp(0.0, 1.0) * (side - 1) as f32;
                let i = (place as usize).min(side - 2);
                rows[i][c] + (rows[i + 1][c] - rows[i][c]) * (place - i as f32)
            };
            return Ok(Self::tabulated(name, 2 * SIDE - 1, |rgb| {
                let place = (rgb - low) / (high - low);
                Vec3::from([0, 1, 2].map(|c| channel(place[c], c)))
            }));
        }
        let entry = |row: &Vec3| row.clamp(Vec3::ZERO, Vec3::ONE).extend(0.0).to_array();
        let entries = rows.iter().map(entry).collect();
        let lut = Self(Arc::new(Table { name: name.to_owned(), side, entries }));
        if (low, high) == (Vec3::ZERO, Vec3::ONE) {
            return Ok(lut);
        }
        Ok(Self::tabulated(name, side.max(SIDE), |rgb| lut.apply((rgb - low) / (high - low))))
    }

    /// The table's colour: linear within the six tetrahedra of each cell, which all have its diagonal (Kasson et al.,
    /// "Performing color space conversions with three-dimensional linear interpolation", 1995).
    fn apply(&self, rgb: Vec3) -> Vec3 {
        let Table { side, ref entries, .. } = *self.0;
        let place = rgb.clamp(Vec3::ZERO, Vec3::ONE) * (side - 1) as f32;
        let corner = place.floor().min(Vec3::splat((side - 2) as f32));
        let t = place - corner;
        let [x, y, z] = corner.to_array().map(|x| x as usize);
        let step = [1, side, side * side];
        let (first, last) = (t.max_position(), t.min_position());
        let (max, min) = (t.max_element(), t.min_element());
        let middle = t.element_sum() - max - min;
        let color = |offset| {
            let [r, g, b, _] = entries[x + side * (y + side * z) + offset];
            Vec3::new(r, g, b)
        };
        let all: usize = step.iter().sum();
        color(0) * (1.0 - max)
            + color(step[first]) * (max - middle)
            + color(all - step[last]) * (middle - min)
            + color(all) * min
    }
}

/// A look over a picture, in part or as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Grade {
    /// The look.
    pub lut: Lut,
    /// Its share, `[0,1]`.
    pub strength: f32,
}

impl Grade {
    /// The colour that is shown in place of an sRGB colour; both in display encoding, in `[0,1]`.
    pub(crate) fn apply(&self, rgb: Vec3) -> Vec3 {
        rgb.lerp(self.lut.apply(rgb), self.strength)
    }
}

/// A built-in look: slope and power as of the ASC Color Decision List, then contrast and saturation, on sRGB colours.
struct BuiltIn {
    name: &'static str,
    slope: [f32; 3],
    power: f32,
    /// Share of the curve `3 x^2 - 2 x^3`.
    contrast: f32,
    saturation: f32,
}

#[rustfmt::skip]
const BUILT_IN: [BuiltIn; 6] = [
    BuiltIn { name: "punchy", slope: [1.0; 3], power: 1.0, contrast: 0.6, saturation: 1.2 },
    BuiltIn { name: "soft", slope: [0.97; 3], power: 0.9, contrast: -0.35, saturation: 0.9 },
    BuiltIn { name: "warm", slope: [1.04, 1.0, 0.9], power: 1.0, contrast: 0.2, saturation: 1.05 },
    BuiltIn { name: "cool", slope: [0.92, 0.99, 1.04], power: 1.0, contrast: 0.2, saturation: 0.95 },
    BuiltIn { name: "night", slope: [0.6, 0.69, 0.84], power: 1.35, contrast: 0.2, saturation: 0.65 },
    BuiltIn { name: "black-and-white", slope: [1.0; 3], power: 1.0, contrast: 0.4, saturation: 0.0 },
];

impl BuiltIn {
    fn apply(&self, rgb: Vec3) -> Vec3 {
        let rgb = (rgb * Vec3::from(self.slope)).clamp(Vec3::ZERO, Vec3::ONE).powf(self.power);
        let curved = rgb * rgb * (3.0 - 2.0 * rgb);
        let rgb = rgb + (curved - rgb) * self.contrast;
        let grey = Vec3::splat(crate::color::luminance(rgb));
        grey + (rgb - grey) * self.saturation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(text: &str) -> Decoded<Lut> {
        Lut::from_cube("a.cube", text)
    }

    /// Text of a table of a function over 0 to `high`.
    fn written(side: usize, high: f32, color: impl Fn(Vec3) -> Vec3) -> String {
        let mut text = format!("TITLE \"a look\"\n# by hand\n\nLUT_3D_SIZE {side}\n");
        if high != 1.0 {
            text += &format!("DOMAIN_MIN 0 0 0\nDOMAIN_MAX {high} {high} {high}\n");
        }
        for i in 0..side.pow(3) {
            let place = [i % side, i / side % side, i / side / side].map(|i| i as f32);
            let [r, g, b] = color(Vec3::from(place) * high / (side - 1) as f32).to_array();
            text += &format!("{r} {g} {b}\r\n");
        }
        text
    }

    fn places() -> impl Iterator<Item = Vec3> {
        (0..1000).map(|i| Vec3::new(i as f32 % 10.0, (i / 10 % 10) as f32, (i / 100) as f32) / 9.0)
    }

    #[test]
    fn a_table_of_a_linear_function_is_that_function() {
        let mixed = |rgb: Vec3| Vec3::new(rgb.z, 0.5 * rgb.x + 0.5 * rgb.y, 1.0 - rgb.x);
        for (side, high) in [(2, 1.0), (5, 1.0), (17, 1.0), (9, 2.0)] {
            let lut = cube(&written(side, high, mixed)).expect("a table");
            for rgb in places() {
                // What is above 1 is clipped.
                let tolerance = if high == 1.0 { 1e-6 } else { 0.03 };
                let (found, expected) = (lut.apply(rgb), mixed(rgb));
                assert!(found.abs_diff_eq(expected, tolerance), "{side}: {rgb} {found} {expected}");
            }
        }
    }

    #[test]
    fn strength_blends_with_the_picture() {
        let lut = cube(&written(3, 1.0, |_| Vec3::ONE)).expect("a table");
        let rgb = Vec3::new(0.2, 0.4, 0.6);
        for (strength, expected) in [(0.0, rgb), (0.5, 0.5 * (rgb + 1.0)), (1.0, Vec3::ONE)] {
            let found = Grade { lut: lut.clone(), strength }.apply(rgb);
            assert!(found.abs_diff_eq(expected, 1e-6), "{strength}: {found}");
        }
    }

    #[test]
    fn tables_of_single_channels_are_curves() {
        let lut = cube("LUT_1D_SIZE 3\nLUT_1D_INPUT_RANGE 0.0 1.0\n0 0 1\n.25 .5 .5\n1 1 0\n");
        let found = lut.expect("a curve").apply(Vec3::new(0.5, 0.5, 0.25));
        assert!(found.abs_diff_eq(Vec3::new(0.25, 0.5, 0.75), 1e-6), "{found}");
    }

    #[test]
    fn what_is_no_table_says_why() {
        for (text, why) in [
            ("", "no LUT_3D_SIZE"),
            ("LUT_3D_SIZE 2\n0 0 0\n", "1 colours in place of 8"),
            ("LUT_3D_SIZE 1000\n", "from 2 to 128"),
            ("LUT_3D_SIZE 2\nLUT_3D_SIZE 2\n", "once"),
            ("LUT_3D_SIZE 2\n0 0 nan\n", "line 2"),
            ("LUT_3D_SIZE 2\n0 0\n", "line 2"),
            ("PK\u{3}\u{4}", "line 1"),
            ("LUT_1D_SIZE 2\nDOMAIN_MAX 0 0 0\n0 0 0\n1 1 1", "range"),
        ] {
            let error = cube(text).expect_err(text);
            assert!(error.contains(why), "{text:?}: {error}");
        }
        let error = Lut::read("look:sepia").expect_err("none").to_string();
        assert!(error.contains("look:punchy"), "{error}");
    }

    #[test]
    fn built_in_looks_keep_black_and_order_greys() {
        for name in Lut::built_in() {
            let lut = Lut::read(&name).expect("a look");
            assert!(lut.apply(Vec3::ZERO).abs_diff_eq(Vec3::ZERO, 1e-6), "{name}");
            let greys = (0..=100).map(|i| lut.apply(Vec3::splat(i as f32 / 100.0)).element_sum());
            let greys: Vec<f32> = greys.collect();
            assert!(greys.is_sorted(), "{name}: {greys:?}");
        }
        let grey = Lut::read("look:black-and-white").expect("a look").apply(Vec3::X);
        assert!(grey.x > 0.0 && grey.x == grey.y && grey.y == grey.z, "{grey}");
    }
}
