//! What a ray finds at a point of a triangle: where it is, how it faces, what it is made of.

use std::borrow::Cow;

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use super::texture::sample_texture;
use super::{AlphaMode, Material, Placing, Scene, TextureRef, TextureSlot as Slot};
use crate::bvh::offset_origin;
use crate::math::Frame;

/// A shading normal is bent until its cosine with the viewer is at least this share of the geometric
/// normal's: a viewer in front of the surface is in front of its shading too.
pub(crate) const MIN_COSINE_SHARE: f32 = 0.05;

/// Least cosine with the geometric normal of the direction in which a mirror shows the viewer
/// something (Cycles' `ensure_valid_specular_reflection`).
pub(crate) const MIN_MIRROR_COSINE: f32 = 0.01;

/// Least sine between the normal of a smooth shape and its triangle's for which rays start from the shape: light that
/// grazes a surface by less is too faint to show facets.
pub(crate) const MIN_TILT: f32 = 0.03;

/// Greatest sine that counts: beyond it normals do not describe the shape (leaves lit as a tree's outside).
pub(crate) const MAX_TILT: f32 = 0.6;

/// Material at one point, textures already read. Colours are linear Rec.709.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SurfaceParameters {
    /// Base colour, each component in `[0,1]`.
    pub base_color: Vec3,
    /// Opacity along rays in `[0,1]`: 1 if opaque, 0 or 1 if masked.
    pub alpha: f32,
    /// Metalness in `[0,1]`.
    pub metallic: f32,
    /// Perceptual roughness in `[0,1]`; GGX alpha is its square.
    pub roughness: f32,
    /// Index of refraction, at least 1; 0 is infinitely high (F0 = 1).
    pub ior: f32,
    /// Strength of the dielectric reflection in `[0,1]`.
    pub specular: f32,
    /// F0 tint of the dielectric.
    pub specular_color: Vec3,
    /// Share of the dielectric's body that is clear, in `[0,1]`.
    pub transmission: f32,
    /// Share of the diffuse body's light that comes through instead of back, in `[0,1]`.
    pub diffuse_transmission: f32,
    /// Colour of what comes through, each component in `[0,1]`.
    pub diffuse_transmission_color: Vec3,
    /// A wall without an inside: light is not bent.
    pub thin: bool,
    /// Absorption coefficient of the inside per metre; zero if thin.
    pub absorption: Vec3,
    /// How much wider than `roughness` reflections are along the axis, in `[0,1]`.
    pub anisotropy: f32,
    /// Unit direction of that width in the local shading frame's plane; +X if not anisotropic.
    pub anisotropy_axis: Vec2,
    /// Share of the surface under a thin film, in `[0,1]`.
    pub iridescence: f32,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f32,
    /// Thickness of the film in nanometres.
    pub iridescence_thickness: f32,
    /// 20 over the Abbe number; zero if thin or nothing is refracted.
    pub dispersion: f32,
    /// Colour of the sheen, each component in `[0,1]`; black is none.
    pub sheen_color: Vec3,
    /// Perceptual roughness of the sheen in `[0,1]`.
    pub sheen_roughness: f32,
    /// Strength of the coat in `[0,1]`.
    pub clearcoat: f32,
    /// Perceptual roughness of the coat in `[0,1]`.
    pub clearcoat_roughness: f32,
    /// Unit normal of the coat in the local shading frame; +Z unless normal maps differ.
    pub clearcoat_normal: Vec3,
    /// Emitted radiance; of an unlit surface its base colour.
    pub emissive: Vec3,
    /// Nothing is scattered.
    pub unlit: bool,
}

/// Sets the parameters that a texture varies to what the value read makes of the material's factors.
type Variation = fn(&mut SurfaceParameters, &Material, Vec4);

/// Textures that a material has, and what they vary.
type Variations = [(TextureRef, Variation)];

/// The textures that vary parameters; base colour, which vertices have too, apart. A texture that is
/// not there reads as ones.
const VARIATIONS: [(Slot, Variation); 14] = [
    (Slot::MetallicRoughness, |p, m, value| {
        p.metallic = unit(m.metallic * value.z);
        p.roughness = unit(m.roughness * value.y);
    }),
    (Slot::Emissive, |p, m, value| {
        // What is unlit shows its base colour.
        if !m.unlit {
            p.emissive = m.emissive * value.xyz();
        }
    }),
    (Slot::Specular, |p, m, value| p.specular = unit(m.specular * value.w)),
    (Slot::SpecularColor, |p, m, value| p.specular_color = m.specular_color * value.xyz()),
    (Slot::Transmission, |p, m, value| p.transmission = unit(m.transmission * value.x)),
    (Slot::DiffuseTransmission, |p, m, value| {
        p.diffuse_transmission = unit(m.diffuse_transmission * value.w);
    }),
    (Slot::DiffuseTransmissionColor, |p, m, value| {
        p.diffuse_transmission_color = m.diffuse_transmission_color * value.xyz();
    }),
    (Slot::Anisotropy, |p, m, value| p.anisotropy = unit(m.anisotropy * value.z)),
    (Slot::Iridescence, |p, m, value| p.iridescence = unit(m.iridescence * value.x)),
    (Slot::IridescenceThickness, |p, m, value| {
        let [thinnest, thickest] = m.iridescence_thickness;
        p.iridescence_thickness = thinnest + (thickest - thinnest) * value.y;
    }),
    (Slot::SheenColor, |p, m, value| p.sheen_color = m.sheen_color * value.xyz()),
    (Slot::SheenRoughness, |p, m, value| p.sheen_roughness = unit(m.sheen_roughness * value.w)),
    (Slot::Clearcoat, |p, m, value| p.clearcoat = unit(m.clearcoat * value.x)),
    (Slot::ClearcoatRoughness, |p, m, value| {
        p.clearcoat_roughness = unit(m.clearcoat_roughness * value.y);
    }),
];

/// What the points of a material have in common, and what tells them apart.
#[derive(Debug, Clone)]
pub struct SharedParameters {
    /// Those of a point where every texture reads as ones: of all points if nothing varies.
    pub parameters: SurfaceParameters,
    /// Textures that the material has, and what they vary.
    variations: Vec<(TextureRef, Variation)>,
}

impl SharedParameters {
    /// Those of a material.
    pub fn of(material: &Material) -> Self {
        let thin = material.thickness <= 0.0;
        let refracts = !thin && material.transmission != 0.0;
        let mut parameters = SurfaceParameters {
            ior: material.ior,
            thin,
            absorption: if thin { Vec3::ZERO } else { absorption(material) },
            anisotropy_axis: Vec2::X,
            iridescence_ior: material.iridescence_ior,
            dispersion: if refracts { material.dispersion } else { 0.0 },
            clearcoat_normal: Vec3::Z,
            unlit: material.unlit,
            ..SurfaceParameters::default()
        };
        parameters.set_base_color(material, material.base_color);
        for (_, vary) in VARIATIONS {
            vary(&mut parameters, material, Vec4::ONE);
        }
        let present = |(slot, vary)| Some((*material.texture(slot)?, vary));
        Self { parameters, variations: VARIATIONS.into_iter().filter_map(present).collect() }
    }
}

impl SurfaceParameters {
    fn set_base_color(&mut self, material: &Material, color: Vec4) {
        self.base_color = color.xyz().clamp(Vec3::ZERO, Vec3::ONE);
        self.alpha = opacity(material.alpha_mode, color.w);
        if material.unlit {
            self.emissive = self.base_color;
        }
    }
}

/// A point on a triangle as a ray sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePoint<'a> {
    /// Number of the triangle.
    pub triangle: u32,
    /// Index of its material.
    pub material: u32,
    /// World position in metres, from the triangle's corners (more exact than from the ray).
    pub position: Vec3,
    /// Unit normal of the triangle on the viewer's side.
    pub geometric_normal: Vec3,
    /// World frame of local directions; z is the shading normal, on the viewer's side and within the
    /// geometric normal's hemisphere.
    pub shading_frame: Frame,
    /// Height in metres over the triangle of the smooth, convex and opaque shape that it stands for; 0 where there
    /// is none. Light that grazes the shape is below the triangle, which leaves black facets at a shadow's edge: its
    /// rays start from the shape (Hanika 2021, *Hacking the Shadow Terminator*, Ray Tracing Gems II).
    pub lift: f32,
    /// Whether the viewer sees the front (counter-clockwise) side.
    pub front_face: bool,
    /// The material, textures read; borrowed where it is that of any point.
    pub parameters: Cow<'a, SurfaceParameters>,
}

/// What of a point says where its rays begin.
#[derive(Debug, Clone, Copy)]
pub struct Sides {
    /// [`SurfacePoint::geometric_normal`].
    pub geometric_normal: Vec3,
    lift: f32,
    /// Greatest cosine with the geometric normal of directions that are not above the surface.
    horizon: f32,
}

impl Sides {
    /// Those of a point.
    pub fn of(point: &SurfacePoint<'_>) -> Self {
        let (geometric_normal, lift) = (point.geometric_normal, point.lift);
        let horizon = if lift > 0.0 {
            let cosine = geometric_normal.dot(point.shading_frame.z);
            -(1.0 - cosine * cosine).max(0.0).sqrt().min(MAX_TILT)
        } else {
            0.0
        };
        Self { geometric_normal, lift, horizon }
    }

    /// Whether a direction points to the viewer's side of the surface.
    pub fn is_above(&self, direction: Vec3) -> bool {
        self.geometric_normal.dot(direction) > self.horizon
    }

    /// Whether rays in this direction start from the smooth shape and not from the triangle.
    pub fn lifts(&self, direction: Vec3) -> bool {
        let cosine = self.geometric_normal.dot(direction);
        cosine <= 0.0 && cosine > self.horizon
    }

    /// Where a ray in this direction begins that leaves the point at `position`.
    #[inline]
    pub fn origin_toward(&self, position: Vec3, direction: Vec3) -> Vec3 {
        let normal = self.geometric_normal;
        if self.lifts(direction) {
            return offset_origin(position + self.lift * normal, normal);
        }
        let is_in_front = normal.dot(direction) > 0.0;
        offset_origin(position, if is_in_front { normal } else { -normal })
    }
}

impl<'a> SurfacePoint<'a> {
    /// The point of `triangle` at `barycentric` (weights of its second and third corner), met by a
    /// ray that travels along `ray_direction`.
    ///
    /// The back of a single-sided material is shaded like its front: only camera rays, which pass it,
    /// tell the difference.
    pub fn at(scene: &Scene, triangle: u32, barycentric: Vec2, ray_direction: Vec3) -> Self {
        let corner = Corner::new(scene, triangle, barycentric);
        let shared = SharedParameters::of(corner.material());
        Self::new(&corner, &shared.variations, Cow::Owned(shared.parameters), ray_direction)
    }

    /// The same, given what all points of the triangle's material have in common.
    #[inline(always)]
    pub fn with_shared(
        scene: &Scene,
        shared: &'a SharedParameters,
        triangle: u32,
        barycentric: Vec2,
        ray_direction: Vec3,
    ) -> Self {
        let corner = Corner::new(scene, triangle, barycentric);
        Self::new(&corner, &shared.variations, Cow::Borrowed(&shared.parameters), ray_direction)
    }

    fn new(
        corner: &Corner<'_>,
        variations: &Variations,
        mut parameters: Cow<'a, SurfaceParameters>,
        ray_direction: Vec3,
    ) -> Self {
        let material = corner.material();
        let corners @ [a, b, c] = corner.positions();
        let position = corner.blend(corners);
        let front_normal = (b - a).cross(c - a).try_normalize().unwrap_or(-ray_direction);
        let front_face = ray_direction.dot(front_normal) < 0.0;
        let geometric_normal = if front_face { front_normal } else { -front_normal };

        let facing = Facing { geometric_normal, to_viewer: -ray_direction };
        let normals = corner.normals();
        let smooth_normal = normals.map(|normals| corner.blend(normals));
        let unmapped =
            smooth_normal.filter(|normal| normal.length_squared() > 1e-12).unwrap_or(front_normal);
        corner.vary(variations, &mut parameters);
        let mapped = |slot, scale| {
            facing.turned(corner.mapped(unmapped, material.texture(slot), scale), unmapped)
        };
        let mut normal = mapped(Slot::Normal, material.normal_scale);
        // What is not metal hardly needs its reflection, but its diffuse light needs the slope.
        if parameters.metallic > 0.0 {
            normal = normal.lerp(facing.mirroring(normal), parameters.metallic);
        }
        let shading_frame = Frame::from_z(normal.normalize());
        let is_opaque = parameters.transmission <= 0.0 && parameters.diffuse_transmission <= 0.0;
        let smooth = normals.filter(|_| is_opaque && is_tilted(unmapped, geometric_normal));
        let lift =
            smooth.map_or(0.0, |normals| corner.lift(corners, normals, unmapped, geometric_normal));
        if parameters.anisotropy > 0.0 {
            let local = shading_frame.local_from_world(corner.anisotropy_direction(unmapped));
            parameters.to_mut().anisotropy_axis = Vec2::new(local.x, local.y).normalize_or(Vec2::X);
        }
        if parameters.clearcoat > 0.0 && material.has_normal_map() {
            let coat = mapped(Slot::ClearcoatNormal, material.clearcoat_normal_scale);
            let local = shading_frame.local_from_world(facing.mirroring(coat));
            parameters.to_mut().clearcoat_normal = local;
        }
        Self {
            triangle: corner.triangle,
            material: corner.material,
            position,
            geometric_normal,
            shading_frame,
            lift,
            front_face,
            parameters,
        }
    }
}

/// Whether any triangle of a scene stands for a smooth shape ([`SurfacePoint::lift`]).
pub(crate) fn lifts(scene: &Scene) -> bool {
    let is_opaque: Vec<bool> = scene.materials.iter().map(Material::may_be_opaque).collect();
    let is_lifted = |place: usize| {
        let vertices = scene.triangles[place].map(|i| i as usize);
        let [a, b, c] = vertices.map(|i| scene.positions[i]);
        let geometric = (b - a).cross(c - a).normalize_or_zero();
        let tilts = |i: usize| is_tilted(scene.normals[i], geometric);
        is_opaque[scene.triangle_materials[place] as usize] && vertices.into_iter().any(tilts)
    };
    !scene.normals.is_empty() && (0..scene.triangles.len()).into_par_iter().any(is_lifted)
}

/// Whether the sine between a normal of any length and a unit one is above [`MIN_TILT`].
fn is_tilted(normal: Vec3, geometric_normal: Vec3) -> bool {
    let squared_sine = normal.cross(geometric_normal).length_squared();
    squared_sine > MIN_TILT * MIN_TILT * normal.length_squared()
}

/// Opacity in `[0,1]` of a point: 1 if the material is opaque, 0 or 1 if it is masked, its alpha if
/// it is blended. Cheap enough for every surface a shadow ray meets.
pub fn alpha_at(scene: &Scene, triangle: u32, barycentric: Vec2) -> f32 {
    let corner = Corner::new(scene, triangle, barycentric);
    let mode = corner.material().alpha_mode;
    if mode == AlphaMode::Opaque { 1.0 } else { opacity(mode, corner.base_color().w) }
}

fn opacity(mode: AlphaMode, alpha: f32) -> f32 {
    match mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask { cutoff } => f32::from(alpha >= cutoff),
        AlphaMode::Blend => alpha.clamp(0.0, 1.0),
    }
}

/// A point of a triangle, ready to interpolate what its corners have.
struct Corner<'a> {
    scene: &'a Scene,
    triangle: u32,
    material: u32,
    vertices: [usize; 3],
    weights: Vec3,
    /// Where an instance's triangle is. Its corners are what they would be had it been baked.
    placing: Option<&'a Placing>,
}

impl<'a> Corner<'a> {
    fn new(scene: &'a Scene, triangle: u32, barycentric: Vec2) -> Self {
        let (place, placing) = scene.instances.find(triangle);
        let weights = Vec3::new(1.0 - barycentric.x - barycentric.y, barycentric.x, barycentric.y);
        let vertices = scene.triangles[place].map(|i| i as usize);
        let vertices = placing.map_or(vertices, |placing| placing.turned(vertices));
        let material = scene.triangle_materials[place];
        Self { scene, triangle, material, vertices, weights, placing }
    }

    fn material(&self) -> &'a Material {
        &self.scene.materials[self.material as usize]
    }

    fn blend<T>(&self, [a, b, c]: [T; 3]) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        a * self.weights.x + b * self.weights.y + c * self.weights.z
    }

    /// World positions of the triangle's corners.
    /// What the scene has for the corners; `None` where it has none for any vertex.
    fn of_vertices<T: Copy>(&self, values: &[T]) -> Option<[T; 3]> {
        (!values.is_empty()).then(|| self.vertices.map(|i| values[i]))
    }

    fn positions(&self) -> [Vec3; 3] {
        let positions = self.vertices.map(|i| self.scene.positions[i]);
        self.placing.map_or(positions, |placing| positions.map(|p| placing.position(p)))
    }

    /// Interpolated tangent, and the bitangent to a normal, of the first corner's handedness; `None` where the scene
    /// has none.
    fn tangents(&self, normal: Vec3) -> Option<[Vec3; 2]> {
        let tangents = self.of_vertices(&self.scene.tangents)?;
        let tangents =
            self.placing.map_or(tangents, |placing| tangents.map(|t| placing.tangent(t)));
        let tangent = self.blend(tangents).xyz();
        Some([tangent, normal.cross(tangent) * tangents[0].w])
    }

    fn uv(&self, set: u8) -> Vec2 {
        let uvs = self.of_vertices(&self.scene.uvs[usize::from(set)]);
        uvs.map_or(Vec2::ZERO, |uvs| self.blend(uvs))
    }

    /// The texture's value here, ones without a texture.
    fn read(&self, texture: Option<&TextureRef>) -> Vec4 {
        texture.map_or(Vec4::ONE, |t| sample_texture(self.scene, t, self.uv(t.uv_set)))
    }

    fn base_color(&self) -> Vec4 {
        let material = self.material();
        let color = material.base_color * self.read(material.texture(Slot::BaseColor));
        self.of_vertices(&self.scene.colors).map_or(color, |colors| color * self.blend(colors))
    }

    /// Normals of the corners, not of unit length; `None` where the triangle is flat.
    fn normals(&self) -> Option<[Vec3; 3]> {
        let normals = self.of_vertices(&self.scene.normals);
        let normals = normals.filter(|normals| !normals.contains(&Vec3::ZERO))?;
        Some(self.placing.map_or(normals, |placing| normals.map(|n| placing.normal(n))))
    }

    /// Height of the smooth shape over the triangle: each corner's tangent plane lifts the point to itself where it
    /// is higher, and the three points are blended.
    fn lift(&self, corners: [Vec3; 3], normals: [Vec3; 3], smooth: Vec3, geometric: Vec3) -> f32 {
        let position = self.blend(corners);
        let side = 1.0_f32.copysign(smooth.dot(geometric));
        self.blend([0, 1, 2].map(|i| {
            let normal = normals[i] * side;
            let below = (-normal.dot(position - corners[i])).max(0.0);
            below * normal.dot(geometric).max(0.0) / normal.length_squared()
        }))
    }

    /// The normal a tangent-space map makes of `normal`, not of unit length. Neither normal nor
    /// tangent is normalised in between, as MikkTSpace demands; without tangents the map is ignored.
    fn mapped(&self, normal: Vec3, texture: Option<&TextureRef>, scale: f32) -> Vec3 {
        let Some(texture) = texture else { return normal };
        let Some([tangent, bitangent]) = self.tangents(normal) else { return normal };
        let map = self.read(Some(texture)).xyz() * 2.0 - 1.0;
        tangent * (map.x * scale) + bitangent * (map.y * scale) + normal * map.z
    }

    /// World direction in which reflections are wide, not of unit length; zero without tangents.
    fn anisotropy_direction(&self, normal: Vec3) -> Vec3 {
        let Some([tangent, bitangent]) = self.tangents(normal) else { return Vec3::ZERO };
        let m = self.material();
        let read = |t| self.read(Some(t)).xy() * 2.0 - 1.0;
        let direction = m.texture(Slot::Anisotropy).map_or(Vec2::X, read);
        let direction = Vec2::from_angle(m.anisotropy_rotation).rotate(direction);
        tangent * direction.x + bitangent * direction.y
    }

    /// Makes the parameters those of this point, if they differ from those that all points share.
    fn vary(&self, variations: &Variations, parameters: &mut Cow<'_, SurfaceParameters>) {
        let m = self.material();
        if m.texture(Slot::BaseColor).is_some() || !self.scene.colors.is_empty() {
            parameters.to_mut().set_base_color(m, self.base_color());
        }
        for (texture, vary) in variations {
            vary(parameters.to_mut(), m, self.read(Some(texture)));
        }
    }
}

fn unit(x: f32) -> f32 {
    x.clamp(0.0, 1.0)
}

/// Coefficient that turns white into the attenuation colour over the attenuation distance
/// (`KHR_materials_volume`); a black component absorbs as one of 1e-6.
pub(crate) fn absorption(material: &Material) -> Vec3 {
    let distance = material.attenuation_distance;
    if !distance.is_finite() || distance <= 0.0 {
        return Vec3::ZERO;
    }
    material.attenuation_color.clamp(Vec3::splat(1e-6), Vec3::ONE).map(|c| -c.ln() / distance)
}

/// Makes shading normals of one point face the viewer.
struct Facing {
    geometric_normal: Vec3,
    to_viewer: Vec3,
}

impl Facing {
    /// Turns `normal` to the side of the geometric normal that `unmapped` says it belongs to, then
    /// bends it into sight if need be. Unit, for any finite input.
    fn turned(&self, normal: Vec3, unmapped: Vec3) -> Vec3 {
        let side = 1.0_f32.copysign(unmapped.dot(self.geometric_normal));
        let normal = normal.normalize_or(self.geometric_normal * side) * side;
        self.bent(self.bent(normal, self.geometric_normal), self.to_viewer)
    }

    /// Bends `normal` towards the geometric normal until it is on the side of `toward`.
    fn bent(&self, normal: Vec3, toward: Vec3) -> Vec3 {
        let (cos, geometric_cos) = (normal.dot(toward), self.geometric_normal.dot(toward));
        let least = MIN_COSINE_SHARE * geometric_cos;
        if cos >= least {
            return normal;
        }
        let t = (least - cos) / (geometric_cos - cos);
        normal.lerp(self.geometric_normal, t).normalize_or(self.geometric_normal)
    }

    /// Tilts a unit `normal` back until a mirror there reflects the viewer to above the surface: a
    /// steep normal map on flat metal would be black otherwise.
    ///
    /// With x and z the viewer's components along the tilt and along the geometric normal, a normal
    /// tilted by `a` reflects the viewer to the height `x sin 2a + z cos 2a`.
    fn mirroring(&self, normal: Vec3) -> Vec3 {
        let z = self.to_viewer.dot(self.geometric_normal);
        let least = MIN_MIRROR_COSINE.min(0.9 * z);
        let mirrored = 2.0 * normal.dot(self.to_viewer) * normal - self.to_viewer;
        if mirrored.dot(self.geometric_normal) >= least {
            return normal;
        }
        let along = normal.reject_from_normalized(self.geometric_normal).normalize_or_zero();
        let x = self.to_viewer.dot(along);
        let (sin, cos) = (0.5 * (x.atan2(z) + (least / x.hypot(z)).acos())).sin_cos();
        sin * along + cos * self.geometric_normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_never_shows_the_viewer_what_is_below_the_surface() {
        for (to_viewer, normal) in [
            (Vec3::Z, Vec3::new(0.9, 0.0, 0.435)),
            (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.8, 0.1, 0.6)),
            (Vec3::new(-0.6, 0.3, 0.1), Vec3::new(0.1, -0.2, 0.9)),
            (Vec3::new(0.9, 0.0, 0.002), Vec3::new(0.3, 0.5, 0.7)),
        ] {
            let to_viewer = to_viewer.normalize();
            let facing = Facing { geometric_normal: Vec3::Z, to_viewer };
            let normal = facing.turned(normal, Vec3::Z);
            let tilted = facing.mirroring(normal);
            let height = (2.0 * tilted.dot(to_viewer) * tilted - to_viewer).z;
            let least = MIN_MIRROR_COSINE.min(0.9 * to_viewer.z);
            assert!(height > least - 1e-5 && tilted.is_normalized(), "{tilted}: {height}");
            // It keeps what was right and tilts no further than needed.
            assert!(tilted == normal || (height - least).abs() < 1e-5, "{normal}: {height}");
        }
    }
}
