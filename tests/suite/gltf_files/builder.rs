//! Small glTF files made in memory, and what every loaded scene must keep to.

use glam::Vec3;
use lightgrid::scene::{Scene, gltf};

/// Little-endian binary data under construction, with accessors into it.
#[derive(Default)]
pub(crate) struct Builder {
    pub(crate) data: Vec<u8>,
    pub(crate) views: Vec<String>,
    pub(crate) accessors: Vec<String>,
}

impl Builder {
    /// Adds an accessor of its own buffer view and returns its number.
    pub(crate) fn add(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
        more: &str,
    ) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"type":"{kind}","count":{count}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let offset = self.data.len();
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{}}}"#, bytes.len()));
        self.data.extend(bytes);
        self.views.len() - 1
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.add(bytemuck::cast_slice(values), 5126, kind, values.len() / width, "")
    }

    pub(crate) fn indices(&mut self, values: &[u16]) -> usize {
        self.add(bytemuck::cast_slice(values), 5123, "SCALAR", values.len(), "")
    }

    /// The JSON of the whole file; `rest` is what comes beside accessors and buffers.
    pub(crate) fn json(&self, rest: &str, buffer_uri: &str) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}{buffer_uri}}}],"bufferViews":[{}],"accessors":[{}],{rest}}}"#,
            self.data.len(),
            self.views.join(","),
            self.accessors.join(",")
        )
    }

    pub(crate) fn glb(&self, rest: &str) -> Vec<u8> {
        let mut json = self.json(rest, "").into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut data = self.data.clone();
        data.resize(data.len().next_multiple_of(4), 0);
        let word = |value: usize| (value as u32).to_le_bytes();
        [
            b"glTF",
            &word(2)[..],
            &word(12 + 8 + json.len() + 8 + data.len()),
            &word(json.len()),
            b"JSON",
            &json,
            &word(data.len()),
            b"BIN\0",
            &data,
        ]
        .concat()
    }

    pub(crate) fn load(&self, rest: &str) -> Scene {
        let scene = gltf::load_slice(&self.glb(rest), None, "made.glb").expect("a sound file");
        check_consistency(&scene);
        scene
    }

    pub(crate) fn error(&self, rest: &str) -> String {
        let loaded = gltf::load_slice(&self.glb(rest), None, "made.glb");
        loaded.expect_err("a faulty file").to_string()
    }
}

/// Corners of the unit square in the xy plane, counter-clockwise seen from +Z.
pub(crate) const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];

/// A builder whose accessor 0 is the square and accessor 1 its two triangles.
pub(crate) fn square() -> Builder {
    let mut builder = Builder::default();
    builder.floats("VEC3", &SQUARE);
    builder.indices(&[0, 1, 2, 0, 2, 3]);
    builder
}

/// The same of a solid: a tetrahedron of four triangles.
pub(crate) fn solid() -> Builder {
    let mut builder = Builder::default();
    builder.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    builder.indices(&[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
    builder
}

pub(crate) const ONE_MESH: &str =
    r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}]"#;

/// Materials, textures and an image: a PNG of one red pixel as a data URI.
pub(crate) fn textured_material(material: &str, sampler: &str) -> String {
    let png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";
    format!(
        r#""materials":[{{{material}}}],"textures":[{{"source":0,"sampler":0}}],"samplers":[{sampler}],
        "images":[{{"uri":"data:image/png;base64,{png}"}}]"#
    )
}

/// What every loaded scene promises to the rest of the program.
pub(crate) fn check_consistency(scene: &Scene) {
    let vertices = scene.positions.len();
    assert!(scene.positions.iter().all(|p| p.is_finite()));
    for length in [
        scene.normals.len(),
        scene.tangents.len(),
        scene.uvs[0].len(),
        scene.uvs[1].len(),
        scene.colors.len(),
    ] {
        assert!(length == 0 || length == vertices);
    }
    assert!(scene.triangles.as_flattened().iter().all(|&v| (v as usize) < vertices));
    assert_eq!(scene.triangles.len(), scene.triangle_materials.len());
    assert!(scene.triangle_materials.iter().all(|&m| (m as usize) < scene.materials.len()));
    assert!(scene.textures.iter().all(|t| (t.image as usize) < scene.images.len()));
    for normal in &scene.normals {
        assert!(*normal == Vec3::ZERO || (normal.length() - 1.0).abs() < 1e-4, "{normal}");
    }
    for tangent in &scene.tangents {
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-4 && tangent.w.abs() == 1.0);
    }
    for material in &scene.materials {
        for reference in &material.textures {
            assert!(
                reference.as_ref().is_none_or(|it| (it.texture as usize) < scene.textures.len())
            );
        }
    }
}
