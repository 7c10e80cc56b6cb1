// Walks through smooth solid glass, and what they are for: twin of src/path/shadows.rs, which says why that is
// right.

// Whether a shadow ray has met such glass, which holds nothing up.
var<private> meets_glass: bool;

struct GlassWalk {
    // Share of radiance that comes from its end; zero if it ends on a surface.
    transmittance: vec3f,
    // In which it has ended.
    direction: vec3f,
    // Radiance of emissive triangles behind glass that arrives.
    emitted: vec3f,
    // Density with which emissive triangles behind glass are chosen in the direction of departure.
    lamp_pdf: f32,
}

// Whether shadow rays follow a material's refraction.
fn is_clear_solid(material: u32) -> bool {
    return (material_flags(material) & CLEAR_SOLID) != 0u;
}

// The direction that smooth glass without coat or sheen refracts light from, zero where all is reflected, and what
// radiance is multiplied with on the way.
struct Refracted {
    wi: vec3f,
    weight: vec3f,
}

fn bsdf_refracted(b: Bsdf, wo: vec3f) -> Refracted {
    let eta = b.interface_.glass.eta;
    let transmittance = scattering_facet(b.interface_, wo.z).transmittance;
    return Refracted(refracted(wo, vec3f(0.0, 0.0, 1.0), eta), transmittance / (eta * eta));
}

// Share of light that its interface transmits, wherever it goes on.
fn bsdf_transmittance(b: Bsdf, wo: vec3f) -> vec3f {
    return interface_facet(b.interface_, abs(wo.z)).transmittance;
}

// Follows a ray through any number of interfaces, refracted or straight on, as far as it reaches. The receiver is
// what lamps are chosen for.
fn walk_glass(
    path: ptr<function, Path>,
    ray_: Ray,
    body_: Body,
    is_straight: bool,
//#if EMITTERS
    receiver: Receiver,
//#end
) -> GlassWalk {
    var ray = ray_;
    var body = body_;
    var interfaces = 0u;
    // What is left where only surfaces that are passed straight through count.
    var uncovered = vec3f(1.0);
    var walk = GlassWalk(vec3f(1.0), ray.direction, vec3f(0.0), 0.0);
    for (var i = 0u; i < MAX_PASSES; i++) {
        (*path).rays += 1u;
        let hit = closest_hit(ray, false);
        let distance = min(hit.t, ray.t_max);
//#if MEDIUM
        let stretch = stretch_in(body, ray.origin, ray.direction, distance);
        if stretch.start < stretch.end {
            walk.transmittance *=
                exp(-stretch.interior.extinction * (stretch.end - stretch.start));
        }
//#else
        walk.transmittance *= body_transmittance(body, distance);
//#end
        if hit.t >= MISS {
            return walk;
        }
        let point = surface_at(hit.triangle, hit.barycentric, ray.direction);
//#if EMITTERS
        if interfaces > 0u && !point.parameters.unlit {
            let radiance = emitted(point, -ray.direction);
            walk.emitted += walk.transmittance * radiance;
            if is_straight && max_element(radiance) > 0.0 {
                let away = length(receiver.position - point.position);
                walk.lamp_pdf +=
                    local_light_pdf_solid_angle(hit.triangle, receiver, ray.direction, away);
            }
        }
//#end
        if is_clear_solid(point.material) {
            interfaces += 1u;
            let bsdf = bsdf_new(point.parameters, is_straight || point.front_face);
            let wo = local_from_world(point.shading_frame, -ray.direction);
            if is_straight {
                walk.transmittance *= bsdf_transmittance(bsdf, wo);
            } else {
                let refracted_ = bsdf_refracted(bsdf, wo);
                if all(refracted_.wi == vec3f(0.0)) || interfaces > MAX_INTERFACES {
                    break;
                }
                walk.transmittance *= refracted_.weight;
                ray.direction =
                    normalize(world_from_local(point.shading_frame, refracted_.wi));
                if dot(point.geometric_normal, ray.direction) > 0.0 {
                    break;
                }
                walk.direction = ray.direction;
            }
            body = body_behind(point, body);
        } else {
            var through = vec3f(0.0);
//#if PARTIAL
            through = straight_through(point, ray.direction);
//#end
            walk.transmittance *= through;
            uncovered *= through;
        }
        if max_element(select(walk.transmittance, uncovered, is_straight)) <= 0.0 {
            break;
        }
        ray.origin = offset_origin(point.position, -point.geometric_normal);
        ray.t_max = select(ray.t_max - hit.t, ray.t_max, ray.t_max >= F32_MAX);
    }
    walk.transmittance = vec3f(0.0);
    return walk;
}

// Whether NEE finds nothing in the direction of departure, for more than glass is in the way.
fn is_departure_blocked(path: ptr<function, Path>) -> bool {
    (*path).rays += 1u;
    let ray = Ray((*path).departure_origin, (*path).departure_direction, F32_MAX);
    return all(transmittance_along(ray) == vec3f(0.0));
}

//#if EMITTERS
// Density with which NEE chooses emissive triangles behind glass in the direction of departure.
fn departure_lamp_pdf(path: ptr<function, Path>) -> f32 {
    let ray = Ray((*path).departure_origin, (*path).departure_direction, F32_MAX);
    return walk_glass(path, ray, body_air(), true, (*path).departure_receiver).lamp_pdf;
}
//#end
