// Tabulated directional albedos of the interface: twin of src/bsdf/albedo.rs.

// Terms of a row and a column, and of the row after it.
fn albedo_nodes(row: u32, column: u32) -> vec4f {
    return tables(ALBEDO_AT + row * (ALBEDO_NODES + 1u) + column);
}

// `AlbedoTerms::at`: (A, B) seen from a direction of this cosine.
fn albedo_terms_at(roughness: f32, cosine: f32) -> vec2f {
    let y = roughness * f32(ALBEDO_NODES - 1u);
    let row = min(u32(y), ALBEDO_NODES - 2u);
    let x = sqrt(saturate(cosine)) * f32(ALBEDO_NODES - 1u);
    let column = min(u32(x), ALBEDO_NODES - 2u);
    let terms = mix(albedo_nodes(row, column), albedo_nodes(row, column + 1u), x - f32(column));
    return mix(terms.xy, terms.zw, y - f32(row));
}

// `AlbedoTerms::mean`: the last column.
fn albedo_terms_mean(roughness: f32) -> vec2f {
    let y = roughness * f32(ALBEDO_NODES - 1u);
    let row = min(u32(y), ALBEDO_NODES - 2u);
    let terms = albedo_nodes(row, ALBEDO_NODES);
    return mix(terms.xy, terms.zw, y - f32(row));
}

//#if ANISOTROPY
fn stretched_terms(ggx: Ggx, diagonal: vec2f, towards: vec2f) -> vec2f {
    let a = diagonal.x + 0.3 * (1.0 - ggx.alpha / ggx.along) * (1.0 - diagonal.x);
    return vec2f(min(a, 1.0 - towards.y), towards.y);
}
//#end

// `AlbedoTerms::at` and `AlbedoTerms::mean` of a GGX of this roughness across its axis.
fn terms_towards(ggx: Ggx, roughness: f32, v: vec3f) -> vec2f {
//#if ANISOTROPY
    if is_stretched(ggx) {
        let diagonal = roughness_off_axis(ggx, 0.70710678, 0.70710678);
        let towards = albedo_terms_at(roughness_towards(ggx, v), v.z);
        return stretched_terms(ggx, albedo_terms_at(diagonal, v.z), towards);
    }
//#end
    return albedo_terms_at(roughness, v.z);
}

fn terms_mean(ggx: Ggx, roughness: f32) -> vec2f {
//#if ANISOTROPY
    if is_stretched(ggx) {
        let diagonal = roughness_off_axis(ggx, 0.70710678, 0.70710678);
        let towards = albedo_terms_mean(roughness_off_axis(ggx, 0.92387953, 0.38268343))
            + albedo_terms_mean(roughness_off_axis(ggx, 0.38268343, 0.92387953));
        return stretched_terms(ggx, albedo_terms_mean(diagonal), 0.5 * towards);
    }
//#end
    return albedo_terms_mean(roughness);
}
