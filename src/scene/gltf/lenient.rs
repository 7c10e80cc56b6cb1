//! What real writers do that the types do not allow, and what the types allow though it is wrong.

use std::borrow::Cow;
use std::cell::Cell;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

use super::limits::Fallible;

/// Refuses text that is no JSON, and indices of more than 32 bits: the types would cut them to others.
/// Of extensions only those that are `read` count. Nothing is kept of the text; returns how many values are in it.
pub(super) fn check_indices(text: &str, read: &[&str]) -> Fallible<u64> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let values = Cell::new(0);
    Check { is_index: false, of_objects: false, of_extensions: false, read, values: &values }
        .deserialize(&mut reader)
        .and_then(|()| reader.end())
        .map(|()| values.get())
        .map_err(|cause| match cause.is_data() {
            true => cause.to_string(),
            false => format!("it is neither GLB nor valid glTF JSON ({cause})"),
        })
}

/// Looks at a value: are the numbers in it indices?
#[derive(Clone, Copy)]
struct Check<'c> {
    is_index: bool,
    /// The same for the values of objects in it, whatever their keys.
    of_objects: bool,
    /// Whether it has extensions, of which those that are not read may hold anything.
    of_extensions: bool,
    /// Names of those that are read.
    read: &'c [&'c str],
    /// Counts them.
    values: &'c Cell<u64>,
}

impl<'de> DeserializeSeed<'de> for Check<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<(), D::Error> {
        self.values.set(self.values.get() + 1);
        reader.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Check<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<(), E> {
        match self.is_index && number > u64::from(u32::MAX) {
            true => Err(E::custom(format!("the index {number} has more than 32 bits"))),
            false => Ok(()),
        }
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<(), E> {
        match self.is_index && number > f64::from(u32::MAX) {
            true => Err(E::custom(format!("the index {number} has more than 32 bits"))),
            false => Ok(()),
        }
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(self)?.is_some() {}
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<(), A::Error> {
        while let Some(key) = object.next_key::<Cow<'de, str>>()? {
            if key == "extras" || (self.of_extensions && !self.read.contains(&&*key)) {
                object.next_value::<IgnoredAny>()?;
            } else {
                let is_index = self.of_objects || is_of_index(&key);
                let of_objects = matches!(&*key, "attributes" | "targets");
                let of_extensions = key == "extensions";
                object.next_value_seed(Self { is_index, of_objects, of_extensions, ..self })?;
            }
        }
        Ok(())
    }
}

/// Whether whole numbers under a key say which object of the file is meant.
fn is_of_index(key: &str) -> bool {
    match key {
        "attributes" | "buffer" | "bufferView" | "camera" | "children" | "index" | "indices"
        | "input" | "joints" | "light" | "material" | "mesh" | "node" | "nodes" | "output"
        | "sampler" | "scene" | "skeleton" | "skin" | "source" | "targets" => true,
        _ => key == "inverseBindMatrices",
    }
}

/// A whole number of an extension, also if it is written `4.0`.
pub(super) fn whole(value: &Value) -> Option<u64> {
    let mut value = value.clone();
    make_whole(&mut value);
    value.as_u64()
}

/// Makes whole numbers that are written `4.0` whole, but for those in what others keep there.
pub(super) fn make_whole(value: &mut Value) {
    /// Beyond this, not every whole number is an `f64`.
    const EXACT: f64 = (1_u64 << 53) as f64;
    match value {
        Value::Number(number) if number.is_f64() => {
            let float = number.as_f64().unwrap_or(f64::NAN);
            if float.fract() == 0.0 && float.abs() < EXACT {
                *number = (float as i64).into();
            }
        }
        Value::Array(list) => list.iter_mut().for_each(make_whole),
        Value::Object(object) => {
            object.iter_mut().filter(|(key, _)| *key != "extras").for_each(|(_, v)| make_whole(v));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn indices_have_32_bits_and_other_numbers_what_they_want() {
        let check =
            |value: Value| check_indices(&value.to_string(), &["KHR_lights_punctual"]).map(|_| ());
        let large = 1_u64 << 32;
        assert_eq!(
            check(json!({"nodes": [{"translation": [large, 0, 0], "children": [1]}]})),
            Ok(())
        );
        assert_eq!(check(json!({"bufferViews": [{"byteLength": large}]})), Ok(()));
        assert_eq!(check(json!({"extras": {"node": large}})), Ok(()));
        assert_eq!(check(json!({"extensions": {"VENDOR_ids": {"node": large}}})), Ok(()));
        for wrong in [
            json!({"scenes": [{"nodes": [large]}]}),
            json!({"meshes": [{"primitives": [{"attributes": {"POSITION": large}}]}]}),
            json!({"nodes": [{"extensions": {"KHR_lights_punctual": {"light": large}}}]}),
            json!({"nodes": [{"mesh": 4294967296.0}]}),
        ] {
            assert!(check(wrong.clone()).unwrap_err().contains("more than 32 bits"), "{wrong}");
        }
        assert_eq!(check_indices(r#"{"a": [1, {"b": "c"}], "extras": [1, 2]}"#, &[]), Ok(5));
        assert!(check_indices("{} {}", &[]).unwrap_err().contains("valid glTF JSON"));
    }

    #[test]
    fn whole_numbers_become_so_but_not_in_what_others_keep_there() {
        let mut tree = json!({"n": [4.0, 0.5, 1e300], "extras": {"n": 4.0}});
        make_whole(&mut tree);
        let expected = json!({"n": [4, 0.5, 1e300], "extras": {"n": 4.0}});
        assert_eq!(tree, expected);
    }
}
