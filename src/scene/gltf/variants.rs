//! `KHR_materials_variants`: looks of one model, chosen by name.

use gltf::json;
use serde_json::Value;

use super::Fallible;
use super::buffers::find;
use crate::error::Notices;

const EXTENSION: &str = "KHR_materials_variants";

/// Which of the file's looks is shown.
pub(super) struct Look {
    /// Number of the variant; `None` is the default look.
    variant: Option<u64>,
}

impl Look {
    /// The look of a name, else the default one.
    pub(super) fn choose(
        root: &json::Root,
        name: Option<&str>,
        notices: &mut Notices,
    ) -> Fallible<Self> {
        let extension = root.extensions.as_ref().and_then(|all| all.others.get(EXTENSION));
        let variants = extension.and_then(|all| all.get("variants")).and_then(Value::as_array);
        let names: Vec<&str> = variants
            .into_iter()
            .flatten()
            .map(|variant| variant.get("name").and_then(Value::as_str).unwrap_or_default())
            .collect();
        let Some(name) = name else {
            if !names.is_empty() {
                let names = names.join(", ");
                notices.add(format!(
                    "the file has the variants {names}; its default look is shown (--variant NAME)"
                ));
            }
            return Ok(Self { variant: None });
        };
        match names.iter().position(|other| *other == name) {
            Some(number) => Ok(Self { variant: Some(number as u64) }),
            None if names.is_empty() => Err(format!("there is no variant {name}: it has none")),
            None => Err(format!("there is no variant {name} but {}", names.join(", "))),
        }
    }

    /// Number of a primitive's material; `None` is the default one.
    pub(super) fn material(
        &self,
        root: &json::Root,
        primitive: &json::mesh::Primitive,
    ) -> Fallible<Option<usize>> {
        let material = match self.variant.and_then(|variant| mapped(primitive, variant)) {
            Some(number) => Some(json::Index::new(u32::try_from(number).unwrap_or(u32::MAX))),
            None => primitive.material,
        };
        if let Some(material) = material {
            find(&root.materials, material, "material")?;
        }
        Ok(material.map(|material| material.value()))
    }
}

/// The material that a primitive has in a variant, if it is another one than usual.
fn mapped(primitive: &json::mesh::Primitive, variant: u64) -> Option<u64> {
    let extension = primitive.extensions.as_ref()?.others.get(EXTENSION)?;
    let mappings = extension.get("mappings")?.as_array()?;
    let mapping = mappings.iter().find(|mapping| {
        let variants = mapping.get("variants").and_then(Value::as_array);
        variants.is_some_and(|all| all.iter().any(|number| number.as_u64() == Some(variant)))
    })?;
    mapping.get("material")?.as_u64()
}
