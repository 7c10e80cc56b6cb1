//! Argument values: sizes, vectors, positive numbers, each refused with the reason.

use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::{DVec3, Vec2, Vec3};

use crate::output::film_file::Part;
use crate::path::Background;
use crate::render::View;
pub(super) use crate::sources::size_pair as pair;

/// `WIDTHxHEIGHT` in pixels.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = pair(text)?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels > View::MAX_PIXELS {
        let most = View::MAX_PIXELS;
        return Err(format!("{pixels} pixels are more than the {most} a picture may have"));
    }
    Ok((width, height))
}

/// So many numbers joined by commas, and nothing else.
pub(super) fn list<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let numbers = text.split(',').map(|number| number.trim().parse().ok());
    numbers.collect::<Option<Vec<T>>>()?.try_into().ok()
}

/// `X,Y,Z` in metres.
pub(super) fn vector(text: &str) -> Result<DVec3, String> {
    let vector = list(text).map(DVec3::from_array).filter(|vector| vector.is_finite());
    vector.ok_or_else(|| "expected three numbers like 1.5,2,-3".to_owned())
}

/// One number of at least zero, or three joined by commas (linear RGB).
pub(super) fn coefficient(text: &str) -> Result<Vec3, String> {
    let parts: Result<Vec<f32>, String> = text.split(',').map(not_negative).collect();
    match parts?[..] {
        [grey] => Ok(Vec3::splat(grey)),
        [r, g, b] => Ok(Vec3::new(r, g, b)),
        _ => Err("expected one number or three like 0.1,0.2,0.3".to_owned()),
    }
}

/// A relative error above 0 and at most 1, or so many percent.
pub(super) fn noise(text: &str) -> Result<f64, String> {
    if let Some(percent) = text.trim().strip_suffix('%') {
        return match positive(percent)? {
            percent @ ..=100.0 => Ok(percent / 100.0),
            _ => Err("more than 100 % is all noise".to_owned()),
        };
    }
    match positive(text)? {
        share @ ..=1.0 => Ok(share),
        percent => Err(format!("more than 1 is all noise: {text} % is {}", percent / 100.0)),
    }
}

/// A place of the picture, both coordinates in `[0,1]`.
pub(super) fn place(text: &str) -> Result<Vec2, String> {
    list(text)
        .filter(|place| place.iter().all(|share| (0.0..=1.0).contains(share)))
        .map(Vec2::from_array)
        .ok_or_else(|| "expected two numbers from 0 to 1 like 0.25,0.7".to_owned())
}

/// `X,Y,WIDTH,HEIGHT` in pixels.
pub(super) fn region(text: &str) -> Result<[u32; 4], String> {
    list(text)
        .filter(|[_, _, width, height]| *width > 0 && *height > 0)
        .ok_or_else(|| "expected four numbers like 100,50,320,180, the last two not 0".to_owned())
}

/// `I/N`, the first part being 1.
pub(super) fn part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').and_then(|(number, count)| {
        Some(Part { number: number.trim().parse().ok()?, count: count.trim().parse().ok()? })
    });
    numbers
        .filter(|part| (1..=part.count).contains(&part.number))
        .ok_or_else(|| "expected two numbers like 2/8: the second of eight parts".to_owned())
}

/// `A..B`, both included, or one number.
pub(super) fn frames(text: &str) -> Result<RangeInclusive<u32>, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let number = |text: &str| text.trim().parse::<u32>().ok();
    let range = number(first).zip(number(last)).map(|(first, last)| first..=last);
    range
        .filter(|range| !range.is_empty())
        .ok_or_else(|| "expected frames like 0..47, the first one not after the last".to_owned())
}

/// `map`, `none`, `blur:DEGREES` or a colour.
pub(super) fn background(text: &str) -> Result<Background, String> {
    match (text, text.strip_prefix("blur:")) {
        ("map", _) => Ok(Background::Map),
        ("none", _) => Ok(Background::None),
        (_, Some(degrees)) => match finite(degrees)? {
            degrees @ 0.0..=90.0 => Ok(Background::Blurred(degrees.to_radians() as f32)),
            _ => Err("a blur is from 0 to 90 degrees".to_owned()),
        },
        _ => match coefficient(text) {
            Ok(color) => Ok(Background::Color(color.to_array())),
            Err(e) => Err(format!("map, none, blur:DEGREES or a colour: {e}")),
        },
    }
}

/// A number from -1 to 1.
pub(super) fn mean_cosine(text: &str) -> Result<f32, String> {
    let x = finite(text)?;
    if x.abs() <= 1.0 { Ok(x as f32) } else { Err("must be between -1 and 1".to_owned()) }
}

/// `X,Y,Z,X,Y,Z`: lower and upper corner of a box in metres.
pub(super) fn corners(text: &str) -> Result<[Vec3; 2], String> {
    let numbers: Result<Vec<f32>, String> =
        text.split(',').map(|t| finite(t).map(|x| x as f32)).collect();
    let [a, b, c, d, e, f] = numbers?[..] else {
        return Err("expected six numbers: the lower and the upper corner".to_owned());
    };
    let (low, high) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
    let corners = low.cmplt(high).all().then_some([low, high]);
    corners.ok_or_else(|| "the first corner must be the lower one along every axis".to_owned())
}

/// A whole number in a range.
pub(super) fn whole<T: TryFrom<u32>>(
    range: RangeInclusive<u32>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let (least, most) = (range.start(), range.end());
        let Ok(number) = text.trim().parse::<i128>() else {
            return Err(format!("expected a whole number from {least} to {most}"));
        };
        let whole = u32::try_from(number).ok().filter(|whole| range.contains(whole));
        let whole = whole.and_then(|whole| T::try_from(whole).ok());
        whole.ok_or_else(|| format!("{number} is not in {least}..={most}"))
    }
}

/// A finite number above zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let x = finite(text)?;
    if x > 0.0 { Ok(x) } else { Err("must be above 0".to_owned()) }
}

/// A finite number of at least zero.
pub(super) fn not_negative(text: &str) -> Result<f32, String> {
    let x = finite(text)?;
    if x >= 0.0 { Ok(x as f32) } else { Err("must not be negative".to_owned()) }
}

/// A finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| (*x as f32).is_finite());
    number.ok_or_else(|| "expected a number".to_owned())
}
