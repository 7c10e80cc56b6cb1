// Channels that are refracted apart: twin of src/bsdf/interface.rs.

struct Channels {
    // The relative index of each.
    etas: vec3f,
    // What the hero channel's refraction counts for.
    hero: vec3f,
}

struct Hero {
    channel: u32,
    probability: f32,
}

fn channels_new(p: SurfaceParameters, eta: f32, entering: bool) -> Channels {
    var channels = Channels(vec3f(eta), vec3f(1.0));
    if p.dispersion > 0.0 && p.ior > 0.0 {
        let spread = (p.ior - 1.0) * (0.025 * p.dispersion);
        channels.etas.x = eta_of(p.ior - spread, entering || p.thin);
        channels.etas.z = eta_of(p.ior + spread, entering || p.thin);
    }
    return channels;
}

// Twin of `Hero::choose`.
fn hero_choose(throughput: vec3f, u: f32) -> Hero {
    let scaled = throughput / max_element(throughput);
    let share = scaled / (scaled.x + scaled.y + scaled.z);
    if u < share.x || (share.y == 0.0 && share.z == 0.0) {
        return Hero(0u, share.x);
    }
    if u < share.x + share.y || share.z == 0.0 {
        return Hero(1u, share.y);
    }
    return Hero(2u, share.z);
}

fn is_dispersive(glass: Glass) -> bool {
    return glass.channels.etas.x != glass.channels.etas.z && glass.share > 0.0;
}

// Twin of `Interface::of_hero`.
fn interface_of_hero(i: Interface, hero: Hero) -> Interface {
    var of_hero = i;
    if is_dispersive(i.glass) {
        let is_hero = vec3u(hero.channel) == vec3u(0u, 1u, 2u);
        of_hero.glass.channels.hero = select(vec3f(0.0), vec3f(1.0 / hero.probability), is_hero);
        of_hero.glass.eta = dot(i.glass.channels.etas, select(vec3f(0.0), vec3f(1.0), is_hero));
    }
    return of_hero;
}

fn hero_weights(glass: Glass) -> vec3f {
    return glass.channels.hero;
}

fn etas_of_channels(glass: Glass) -> vec3f {
    return glass.channels.etas;
}

// Each channel is reflected as its own index says; the hero's passes.
fn glass_of_channels(i: Interface, cosine: f32) -> vec4f {
    // A loop, for what it calls is long: first the hero's index, then that of each channel.
    let turns = select(1u, 4u, is_dispersive(i.glass));
    var reflected_share = vec3f(0.0);
    var passing = 0.0;
    var etas = vec4f(i.glass.eta, i.glass.channels.etas);
    for (var turn = 0u; turn < turns; turn++) {
        let glass = glass_at(i, cosine, etas.x);
        let is_told = vec3<bool>(turn == 0u) | (vec3u(turn) == vec3u(1u, 2u, 3u));
        reflected_share = select(reflected_share, glass.xyz, is_told);
        passing = select(passing, glass.w, turn == 0u);
        etas = etas.yzwx;
    }
    return vec4f(reflected_share, passing);
}
