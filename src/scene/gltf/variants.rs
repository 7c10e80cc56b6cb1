//! `KHR_materials_variants`: looks of one model, chosen by name.

use gltf::json;
use serde::Deserialize;
use serde_json::Value;

use super::document::Document;
use super::lenient::whole;
use super::limits::Fallible;
use super::objects::{Objects, member};
use crate::error::Notices;

const EXTENSION: &str = "KHR_materials_variants";

/// So many looks are named.
const MAX_NAMED: usize = 50;

/// A look of a model.
#[derive(Deserialize)]
struct Variant {
    #[serde(default)]
    name: String,
}

/// Which of the file's looks is shown.
pub(super) struct Look {
    /// Number of the variant; `None` is the default look.
    variant: Option<u64>,
}

impl Look {
    /// The look of a name, else the default one.
    pub(super) fn choose(
        document: &Document<'_>,
        name: Option<&str>,
        notices: &mut Notices,
    ) -> Fallible<Self> {
        let list = member(document.extensions, EXTENSION)?;
        let list = member(list.unwrap_or("{}"), "variants")?;
        let variants: Objects<'_, Variant> = Objects::new(list, "variant")?;
        let names = || variants.indices().map(|index| variants.get(index).map(|it| it.name));
        let list = || {
            let first = names().take(MAX_NAMED).collect::<Fallible<Vec<String>>>()?.join(", ");
            Fallible::Ok(match variants.len().saturating_sub(MAX_NAMED) {
                0 => first,
                more => format!("{first} and {more} more"),
            })
        };
        let Some(name) = name else {
            if variants.len() > 0 {
                notices.add(format!(
                    "the file has the variants {}; its default look is shown (--variant NAME)",
                    list()?
                ));
            }
            return Ok(Self { variant: None });
        };
        match names().position(|other| other.is_ok_and(|other| other == name)) {
            Some(number) => Ok(Self { variant: Some(number as u64) }),
            None if variants.len() == 0 => Err(format!("there is no variant {name}: it has none")),
            None => Err(format!("there is no variant {name} but {}", list()?)),
        }
    }

    /// Number of a primitive's material; `None` is the default one.
    pub(super) fn material(&self, primitive: &json::mesh::Primitive) -> Option<u32> {
        match self.variant.and_then(|variant| mapped(primitive, variant)) {
            Some(number) => Some(u32::try_from(number).unwrap_or(u32::MAX)),
            None => primitive.material.map(|material| material.value() as u32),
        }
    }
}

/// The material that a primitive has in a variant, if it is another one than usual.
fn mapped(primitive: &json::mesh::Primitive, variant: u64) -> Option<u64> {
    let extension = primitive.extensions.as_ref()?.others.get(EXTENSION)?;
    let mappings = extension.get("mappings")?.as_array()?;
    let mapping = mappings.iter().find(|mapping| {
        let variants = mapping.get("variants").and_then(Value::as_array);
        variants.is_some_and(|all| all.iter().any(|number| whole(number) == Some(variant)))
    })?;
    whole(mapping.get("material")?)
}
