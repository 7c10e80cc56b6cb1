//! Materials made ready for paths: what all their points share is made once, and only referred to.

use std::borrow::Cow;

use super::body::Body;
use crate::bsdf::Bsdf;
use crate::medium::Interior;
use crate::scene::surface::{SharedParameters, SurfacePoint};
use crate::scene::{AlphaMode, Material};

/// A material as paths meet it.
pub(super) struct ReadyMaterial {
    /// What the parameters of its points have in common.
    pub(super) shared: SharedParameters,
    /// The scattering of points that have the shared parameters, seen from the front.
    front: Bsdf,
    /// That seen from the back, if it is another one.
    back: Option<Box<Bsdf>>,
    /// What lies behind the front of a solid; `None` for thin walls.
    inside: Option<Body>,
    pub(super) passing: Passing,
}

/// How rays deal with a material before it scatters them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Passing {
    pub(super) single_sided: bool,
    /// All rays pass it from behind.
    pub(super) backed: bool,
    pub(super) masked: bool,
    /// Part of the light may go straight through: blended, or thin and transmissive.
    pub(super) partial: bool,
    /// Smooth solid glass that shadow rays follow.
    pub(super) clear: bool,
}

impl ReadyMaterial {
    pub(super) fn new(material: &Material) -> Self {
        let shared = SharedParameters::of(material);
        let parameters = &shared.parameters;
        let inside = (!parameters.thin).then(|| {
            let index = parameters.ior.max(1.0);
            let interior = Interior::of_body(material, parameters.absorption);
            Body { interior: Some(interior), squared_index: index * index }
        });
        let is_pane = material.transmission > 0.0 && material.thickness == 0.0 && !material.unlit;
        let [back, front] = [false, true].map(|front| Bsdf::new(parameters, front));
        Self {
            front,
            back: (back != front).then(|| Box::new(back)),
            inside,
            passing: Passing {
                single_sided: !material.double_sided,
                backed: material.backed,
                masked: matches!(material.alpha_mode, AlphaMode::Mask { .. }),
                partial: material.alpha_mode == AlphaMode::Blend || is_pane,
                clear: material.is_clear_solid(),
            },
            shared,
        }
    }

    /// The scattering at a point of this material: the one that is ready, unless the point has
    /// parameters of its own.
    pub(super) fn bsdf(&self, point: &SurfacePoint<'_>) -> Cow<'_, Bsdf> {
        self.bsdf_from(point, point.front_face)
    }

    /// The same as if it were seen from its front, or from its back.
    pub(super) fn bsdf_from(&self, point: &SurfacePoint<'_>, front: bool) -> Cow<'_, Bsdf> {
        match &point.parameters {
            Cow::Borrowed(_) if front => Cow::Borrowed(&self.front),
            Cow::Borrowed(_) => Cow::Borrowed(self.back.as_deref().unwrap_or(&self.front)),
            Cow::Owned(own) => Cow::Owned(Bsdf::new(own, front)),
        }
    }

    /// What lies behind a point of the surface; `None` if it is what lies before it.
    pub(super) fn behind(&self, point: &SurfacePoint<'_>) -> Option<&Body> {
        let inside = self.inside.as_ref()?;
        Some(if point.front_face { inside } else { &Body::AIR })
    }
}

#[cfg(test)]
mod tests {
    use glam::{Affine2, Vec2, Vec3, Vec4};

    use super::*;
    use crate::bvh::{Hit, Ray};
    use crate::path::World;
    use crate::sampler::Sampler;
    use crate::scene::surface::SurfaceParameters;
    use crate::scene::{
        MaterialEdit, Scene, Texture, TextureImage, TextureRef, TextureSlot, Wrap, builtin,
    };

    /// Asserts that points of triangles, seen from both sides, are those that know nothing of what is
    /// ready; returns how many of them have parameters of their own.
    fn own_points(world: &World) -> usize {
        let scene = &world.scene;
        let mut own = 0;
        for triangle in (0..scene.triangles.len() as u32).step_by(37) {
            let mut sampler = Sampler::new(1, triangle, 0);
            let barycentric = 0.5 * Vec2::from(sampler.next_pair());
            let [x, y] = sampler.next_pair();
            let along = Vec3::new(x - 0.5, y - 0.5, sampler.next_pair()[0] - 0.5).normalize();
            for direction in [along, -along] {
                let hit = Hit { t: 1.0, triangle, barycentric };
                let ready = world.point(&hit, direction);
                let anew = SurfacePoint::at(scene, triangle, barycentric, direction);
                assert_eq!(ready, anew);
                let bsdf = Bsdf::new(&anew.parameters, anew.front_face);
                assert_eq!(*world.material(ready.material).bsdf(&ready), bsdf);
                own += usize::from(matches!(ready.parameters, Cow::Owned(_)));
            }
        }
        own
    }

    #[test]
    fn what_is_ready_is_what_a_point_would_make() {
        for name in builtin::names() {
            own_points(&World::new(builtin::build(name).expect("built in")));
        }
    }

    /// A triangle of which everything may vary.
    fn triangle(material: Material) -> Scene {
        let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::Repeat);
        Scene {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::Z],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
            uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::Y], Vec::new()],
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            materials: vec![material],
            textures: vec![Texture { image: 0, wrap_u, wrap_v, nearest: false, srgb: false }],
            images: vec![TextureImage {
                width: 1,
                height: 1,
                texels: vec![[51, 102, 153, 204]].into(),
            }],
            ..Scene::default()
        }
    }

    /// Has some of everything.
    fn rich() -> Material {
        Material {
            base_color: Vec4::new(0.8, 0.4, 0.2, 0.5),
            alpha_mode: AlphaMode::Blend,
            metallic: 0.25,
            roughness: 0.5,
            emissive: Vec3::splat(3.0),
            specular: 0.5,
            specular_color: Vec3::new(0.5, 0.75, 1.0),
            transmission: 0.5,
            thickness: 1.0,
            attenuation_color: Vec3::new(0.25, 0.5, 1.0),
            attenuation_distance: 2.0,
            diffuse_transmission: 0.25,
            iridescence: 0.5,
            dispersion: 0.5,
            sheen_color: Vec3::new(0.25, 0.0, 0.5),
            sheen_roughness: 0.5,
            ..Material::default()
        }
    }

    #[test]
    fn only_what_varies_is_of_a_point_alone() {
        let own = |scene| own_points(&World::new(scene));
        assert_eq!(own(triangle(rich())), 0);
        assert_eq!(own(triangle(Material { clearcoat: 0.5, ..rich() })), 0);
        let texture = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
        let textured = |slot| rich().with_texture(slot, texture);
        // A normal map turns the frame, but no parameter unless there is a coat.
        assert_eq!(own(triangle(textured(TextureSlot::Normal))), 0);
        let coat = Material { clearcoat: 0.5, ..textured(TextureSlot::Normal) };
        assert_eq!(own(triangle(coat)), 2);
        assert_eq!(own(triangle(Material { anisotropy: 0.5, ..rich() })), 2);
        assert_eq!(own(Scene { colors: vec![Vec4::ONE; 3], ..triangle(rich()) }), 2);
        assert_eq!(own(triangle(textured(TextureSlot::BaseColor))), 2);
        assert_eq!(own(triangle(textured(TextureSlot::Emissive))), 2);
    }

    #[test]
    fn a_texture_of_one_colour_is_a_factor() {
        let texture = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
        let mut textured =
            Material { anisotropy: 0.5, clearcoat: 0.5, clearcoat_roughness: 0.5, ..rich() };
        textured.textures.fill(Some(texture.into()));
        // Normal maps have no factors of that kind.
        for slot in [TextureSlot::Normal, TextureSlot::ClearcoatNormal] {
            textured.textures[slot as usize] = None;
        }
        let [x, y, z, w] = [51.0, 102.0, 153.0, 204.0].map(|byte: f32| byte / 255.0);
        let color = Vec3::new(x, y, z);
        let rich = rich();
        let [thinnest, thickest] = rich.iridescence_thickness;
        let plain = Material {
            base_color: rich.base_color * color.extend(w),
            metallic: rich.metallic * z,
            roughness: rich.roughness * y,
            emissive: rich.emissive * color,
            specular: rich.specular * w,
            specular_color: rich.specular_color * color,
            transmission: rich.transmission * x,
            diffuse_transmission: rich.diffuse_transmission * w,
            diffuse_transmission_color: rich.diffuse_transmission_color * color,
            anisotropy: 0.5 * z,
            iridescence: rich.iridescence * x,
            iridescence_thickness: [0.0, thinnest + (thickest - thinnest) * y],
            sheen_color: rich.sheen_color * color,
            sheen_roughness: rich.sheen_roughness * w,
            clearcoat: 0.5 * x,
            clearcoat_roughness: 0.5 * y,
            ..rich
        };
        let [textured, plain] = [textured, plain].map(|material| {
            let shared = SharedParameters::of(&material);
            let scene = triangle(material);
            let at = Vec2::splat(0.25);
            let point = SurfacePoint::with_shared(&scene, &shared, 0, at, Vec3::NEG_Z);
            // Which way reflections are wide is read from the texture alone.
            let anisotropy_axis = Vec2::X;
            SurfaceParameters { anisotropy_axis, ..*point.parameters }
        });
        assert_eq!(textured, plain);
    }

    #[test]
    fn what_is_seen_stays_when_colours_change() {
        let mut scene = builtin::build("office").expect("built in");
        let oak = scene.materials.iter_mut().find(|m| m.name == "oak").expect("the floor's");
        oak.transmission = 0.5;
        let before = World::new(scene);
        let changed = |name: &str, edit: MaterialEdit| {
            let materials = before.scene.materials.iter();
            let change = |m: &Material| if m.name == name { edit.apply(m) } else { m.clone() };
            let world =
                before.with_looks(materials.map(change).collect(), before.scene.lights.clone());
            world.expect("there is memory").has_same_visibility(&before)
        };
        let red = MaterialEdit { color: Some(Vec3::X), ..MaterialEdit::default() };
        let hidden = MaterialEdit { hidden: true, ..MaterialEdit::default() };
        assert!(changed("wall", red) && !changed("wall", hidden));
        assert!(!changed("oak", red), "light gets through, now as glass");
        let other = World::new(builtin::build("office").expect("built in"));
        assert!(!other.has_same_visibility(&before), "nobody knows that it is the same");
    }

    /// A world with changed materials is the one that is loaded with them.
    #[test]
    fn materials_are_exchanged_as_if_they_had_been_loaded() {
        let scene = builtin::build("office").expect("built in");
        let hidden = MaterialEdit { hidden: true, ..MaterialEdit::default() };
        let dull = MaterialEdit { roughness: Some(1.0), ..MaterialEdit::default() };
        let (emission, opacity) = (Some(2.0), Some(0.5));
        let lit = MaterialEdit { emission, opacity, ..MaterialEdit::default() };
        let change = |material: &Material| match material.name.as_str() {
            "wall" => hidden.apply(material),
            "oak" => dull.apply(material),
            "ceiling" => lit.apply(material),
            _ => material.clone(),
        };
        let materials: Vec<Material> = scene.materials.iter().map(change).collect();
        let loaded = World::new(Scene { materials: materials.clone(), ..scene.clone() });
        let before = World::new(scene);
        let changed =
            before.with_looks(materials, before.scene.lights.clone()).expect("there is memory");
        assert_eq!(changed.needs, loaded.needs);
        let lamps = [&before, &changed, &loaded].map(|world| world.lights.triangle_count());
        assert!(lamps[1] > lamps[0] && lamps[1] == lamps[2], "{lamps:?}");
        assert_ne!(changed.needs, before.needs, "nothing was cut out before");
        let mut sees_more = 0;
        for index in 0..2000 {
            let mut sampler = Sampler::new(7, 0, index);
            let (a, b) = (sampler.next_pair(), sampler.next_pair());
            let direction = Vec3::new(a[0] - 0.5, a[1] - 0.5, b[0] - 0.5).normalize();
            let origin = Vec3::new(0.0, 1.2, 0.0);
            let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            let hit = changed.closest_hit(&ray, true).map(|hit| (hit.t, hit.triangle));
            assert_eq!(hit, loaded.closest_hit(&ray, true).map(|hit| (hit.t, hit.triangle)));
            assert_eq!(changed.transmittance(&ray), loaded.transmittance(&ray));
            sees_more += u32::from(changed.transmittance(&ray) != before.transmittance(&ray));
        }
        assert!(sees_more > 100, "{sees_more} of 2000 rays leave where the walls were");
    }
}
