// In place of dispersion.wgsl where all channels are refracted alike.

struct Channels {
    unused: u32,
}

fn channels_new(p: SurfaceParameters, eta: f32, entering: bool) -> Channels {
    return Channels();
}

fn hero_weights(glass: Glass) -> vec3f {
    return vec3f(1.0);
}

fn etas_of_channels(glass: Glass) -> vec3f {
    return vec3f(glass.eta);
}

fn glass_of_channels(i: Interface, cosine: f32) -> vec4f {
    return glass_at(i, cosine, i.glass.eta);
}
