//! How much a flat interface reflects, and which way it refracts.

use glam::Vec3;

/// Schlick's weight `(1 - cos)^5`: 0 facing, 1 grazing.
pub(crate) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Reflectance at normal incidence of an interface of relative index of refraction `ior`.
pub(crate) fn normal_reflectance(ior: f32) -> f32 {
    let r = (ior - 1.0) / (ior + 1.0);
    r * r
}

/// Unpolarised Fresnel reflectance of a dielectric; `eta` is the index on the far side over the index
/// on this side. `None` is total internal reflection.
pub(crate) fn dielectric(cos: f32, eta: f32) -> Option<f32> {
    let cos = cos.clamp(0.0, 1.0);
    let sin2_t = (1.0 - cos * cos) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    Some(0.5 * (parallel * parallel + perpendicular * perpendicular))
}

/// Direction of the light refracted at the facet `h` for a viewer in direction `wo` (both unit, on
/// the same side). `None` is total internal reflection.
pub(crate) fn refract(wo: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let cos = wo.dot(h);
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((h * (cos / eta - cos_t) - wo / eta).normalize())
}

/// Direction mirrored at the facet `h`.
pub(crate) fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * wo.dot(h)) - wo
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_facing_and_all_grazing() {
        let facing = dielectric(1.0, 1.5).unwrap();
        assert!((facing - 0.04).abs() < 1e-6);
        assert!((normal_reflectance(1.5) - 0.04).abs() < 1e-6);
        assert!(dielectric(0.0, 1.5).unwrap() > 0.9999);
    }

    #[test]
    fn brewster_angle_halves_the_reflectance_of_s_polarised_light() {
        // At Brewster's angle the parallel part vanishes; for 1.5 the rest is ((n^2-1)/(n^2+1))^2/2.
        let cos = (1.0 / (1.0 + 1.5_f32 * 1.5)).sqrt();
        let expected = 0.5 * (1.25_f32 / 3.25).powi(2);
        assert!((dielectric(cos, 1.5).unwrap() - expected).abs() < 1e-6);
    }

    #[test]
    fn both_sides_reflect_alike_and_the_inside_reflects_totally() {
        for i in 1..=20 {
            let cos = i as f32 / 20.0;
            let cos_t = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
            let outside = dielectric(cos, 1.5).unwrap();
            let inside = dielectric(cos_t, 1.0 / 1.5).unwrap();
            assert!((outside - inside).abs() < 1e-4, "{cos}: {outside} {inside}");
        }
        assert!(dielectric(0.7, 1.0 / 1.5).is_none());
        let grazing_inside = Vec3::new(0.8, 0.0, 0.6);
        assert!(refract(grazing_inside, Vec3::Z, 1.0 / 1.5).is_none());
    }

    #[test]
    fn refraction_obeys_snell() {
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let wi = refract(wo, Vec3::Z, 1.5).unwrap();
        assert!((wi.x + 0.4).abs() < 1e-6 && wi.y == 0.0 && wi.z < 0.0);
    }
}
