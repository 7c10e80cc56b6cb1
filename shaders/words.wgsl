// Floats that lie between kernels in words.

fn float3(words: vec4u) -> vec3f {
    return bitcast<vec3f>(words.xyz);
}
