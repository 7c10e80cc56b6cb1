// Owen-scrambled Sobol points: twin of src/sampler/mod.rs, the same bits.

struct Sampler {
    reversed_index: u32,
    sequence_seed: u32,
    pair: u32,
}

// Bits of a reversed index that choose a digital shift.
const SHIFT = 255u;

fn sampler_new(seed: u32, sequence: u32, index: u32) -> Sampler {
    let sequence_seed = hash(hash(sequence) + hash(seed));
    return Sampler(reverseBits(index), sequence_seed, 0u);
}

fn sampler_of_pixel(seed: u32, pixel: vec2u, index: u32) -> Sampler {
    let low = pixel & vec2u(15u);
    let pairs = (low | (low << vec2u(2u))) & vec2u(0x33u);
    let spread = (pairs | (pairs << vec2u(1u))) & vec2u(0x55u);
    let place = spread.x | (spread.y << 1u);
    let tile = pixel >> vec2u(4u);
    return sampler_new(seed, (tile.y << 16u) | tile.x, index ^ (place << 24u));
}

// The stream of one of `count` estimates that the sample makes of the same thing.
fn sampler_of_estimate(sampler: Sampler, count: u32, estimate: u32) -> Sampler {
    let pair = sampler.pair + (count - 1u) * PAIRS_OF_ESTIMATES;
    let index = reverseBits(sampler.reversed_index & ~SHIFT) * count + estimate;
    let reversed = reverseBits(index) ^ (sampler.reversed_index & SHIFT);
    return Sampler(reversed, sampler.sequence_seed, pair);
}

fn next_pair_bits(sampler: ptr<function, Sampler>) -> vec2u {
    let seed = hash((*sampler).sequence_seed + (*sampler).pair * 0x9e3779b9u);
    (*sampler).pair += 1u;
    let index = (*sampler).reversed_index;
    let mixed = mixed_place(index & SHIFT, seed);
    let place = reverseBits(owen_scramble_reversed(mixed, ~seed)) >> 24u;
    let point = reverseBits(owen_scramble_reversed(index & ~SHIFT, seed));
    let x = point ^ (place * 0x9e3779b9u);
    let y = second_dimension(point) ^ (second_dimension(place) * 0x85ebca6bu);
    return vec2u(
        reverseBits(owen_scramble_reversed(x, hash(seed ^ 0x5851f42du))),
        reverseBits(owen_scramble_reversed(y, hash(seed ^ 0x14057b7eu))),
    );
}

fn next_pair(sampler: ptr<function, Sampler>) -> vec2f {
    let bits = next_pair_bits(sampler);
    return vec2f(unit_from_bits(bits.x), unit_from_bits(bits.y));
}

fn unit_from_bits(bits: u32) -> f32 {
    return f32(bits >> 8u) * (1.0 / 16777216.0);
}

fn hash(value: u32) -> u32 {
    var x = value;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

fn owen_scramble_reversed(value: u32, seed: u32) -> u32 {
    var x = value;
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

fn mixed_place(place: u32, seed: u32) -> u32 {
    return place ^ ((place >> 1u) & seed & 0x70u) ^ ((place >> 2u) & (seed >> 8u) & 0x30u);
}

fn second_dimension(index: u32) -> u32 {
    var y = index;
    y ^= y >> 16u;
    y ^= (y >> 8u) & 0x00ff00ffu;
    y ^= (y >> 4u) & 0x0f0f0f0fu;
    y ^= (y >> 2u) & 0x33333333u;
    y ^= (y >> 1u) & 0x55555555u;
    return y;
}
