// Owen-scrambled Sobol points: twin of src/sampler/mod.rs, the same bits.

struct Sampler {
    reversed_index: u32,
    pixel_seed: u32,
    pair: u32,
}

fn sampler_new(seed: u32, pixel: u32, index: u32) -> Sampler {
    let pixel_seed = hash(hash(pixel) + hash(seed));
    return Sampler(reverseBits(index), pixel_seed, 0u);
}

// The stream of one of `count` estimates that the sample makes of the same thing.
fn sampler_of_estimate(sampler: Sampler, count: u32, estimate: u32) -> Sampler {
    let pair = sampler.pair + (count - 1u) * PAIRS_OF_ESTIMATES;
    let index = reverseBits(sampler.reversed_index) * count + estimate;
    return Sampler(reverseBits(index), sampler.pixel_seed, pair);
}

fn next_pair_bits(sampler: ptr<function, Sampler>) -> vec2u {
    let seed = hash((*sampler).pixel_seed + (*sampler).pair * 0x9e3779b9u);
    (*sampler).pair += 1u;
    let shuffled = reverseBits(owen_scramble_reversed((*sampler).reversed_index, seed));
    let point = sobol_reversed(shuffled);
    return vec2u(
        reverseBits(owen_scramble_reversed(point.x, hash(seed ^ 0x5851f42du))),
        reverseBits(owen_scramble_reversed(point.y, hash(seed ^ 0x14057b7eu))),
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

fn sobol_reversed(index: u32) -> vec2u {
    var y = index;
    y ^= y >> 16u;
    y ^= (y >> 8u) & 0x00ff00ffu;
    y ^= (y >> 4u) & 0x0f0f0f0fu;
    y ^= (y >> 2u) & 0x33333333u;
    y ^= (y >> 1u) & 0x55555555u;
    return vec2u(index, y);
}
