// Random numbers spent on one choice after another, in integers: twin of src/path/draw.rs.

// The part of the unit interval that some choices have left: so many units of one size.
struct Interval {
    width: u32,
    unit: f32,
}

fn whole_interval() -> Interval {
    return Interval(0x80000000u, 1.0 / 2147483648.0);
}

fn interval_probability(left: Interval) -> f32 {
    return f32(left.width) * left.unit;
}

// Units of the first of two parts.
fn interval_cut(left: Interval, share: u32) -> u32 {
    return multiply_wide(left.width, share).x + 1u;
}

// So many of an interval's units, halved as often as 32 bits can still count them.
fn interval_keep(left: Interval, width: u32) -> Interval {
    let halvings = countLeadingZeros(width);
    return Interval(width << halvings, left.unit * bitcast<f32>((127u - halvings) << 23u));
}

// Chooses: the first `share / 2^32` or the rest.
fn interval_choose(left: Interval, share: u32, first: bool) -> Interval {
    let cut = interval_cut(left, share);
    return interval_keep(left, select(left.width - cut, cut, first));
}

// A share in [0,1] in units of 2^-32, such that neither it nor the rest is without chance.
fn share_of(share: f32) -> u32 {
    return u32(min(share, 0.99999988) * 4294967296.0);
}

// A uniform random number and what choices made with it have left.
struct Draw {
    left: Interval,
    offset: u32,
    below: u32,
}

fn draw_new(bits: u32) -> Draw {
    return Draw(whole_interval(), bits >> 1u, hash(bits));
}

// Whether the first `share / 2^32` of what is left is chosen.
fn draw_chooses_first(draw: ptr<function, Draw>, share: u32) -> bool {
    let cut = interval_cut((*draw).left, share);
    let first = (*draw).offset < cut;
    let width = select((*draw).left.width - cut, cut, first);
    let offset = select((*draw).offset - cut, (*draw).offset, first);
    let halvings = countLeadingZeros(width);
    (*draw).left = interval_keep((*draw).left, width);
    (*draw).offset = (offset << halvings) | (((*draw).below >> 1u) >> (31u - halvings));
    (*draw).below <<= halvings;
    return first;
}

// What is left, in [0,1): a fresh uniform number.
fn draw_remainder(draw: Draw) -> f32 {
    return min(f32(draw.offset) / f32(draw.left.width), 0.99999994);
}
