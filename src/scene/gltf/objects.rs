//! Lists of a file's objects, each of which is read from the text when it is asked for.
//!
//! An object of the types that glTF's are read into takes up to a hundred times its text. So only where it begins
//! is kept, four bytes each, and what nobody asks for is never made.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use gltf::json::Index;
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use serde_json::value::RawValue;

use super::lenient;
use super::limits::Fallible;

/// The objects of one kind.
pub(super) struct Objects<'a, T> {
    /// The list they are in.
    text: &'a str,
    /// Where in it each begins.
    starts: Vec<u32>,
    kind: &'static str,
    read: PhantomData<fn() -> T>,
}

impl<'a, T> Objects<'a, T> {
    /// Those of a list, if there is one. `kind` is what one of them is called.
    pub(super) fn new(list: Option<&'a str>, kind: &'static str) -> Fallible<Self> {
        let text = list.unwrap_or("[]");
        let starts = serde_json::Deserializer::from_str(text)
            .deserialize_seq(Starts { base: text.as_ptr().addr() })
            .map_err(|cause| not_gltf(&format!("its {kind} list: {cause}")))?;
        Ok(Self { text, starts, kind, read: PhantomData })
    }

    pub(super) fn len(&self) -> usize {
        self.starts.len()
    }

    pub(super) fn indices(&self) -> impl Iterator<Item = Index<T>> {
        (0..self.starts.len() as u32).map(Index::new)
    }

    /// The object an index points at.
    pub(super) fn get(&self, index: Index<T>) -> Fallible<T>
    where
        T: DeserializeOwned,
    {
        self.get_as(index)
    }

    /// Some members of the object an index points at.
    pub(super) fn get_as<M: DeserializeOwned>(&self, index: Index<T>) -> Fallible<M> {
        read(self.text(index)?)
            .map_err(|cause| not_gltf(&format!("{} {index}: {cause}", self.kind)))
    }

    /// The text of an object and of what follows it, or a sentence that says that it is not there.
    pub(super) fn text(&self, index: Index<T>) -> Fallible<&'a str> {
        let (kind, count) = (self.kind, self.len());
        let start = self.starts.get(index.value()).ok_or_else(|| {
            format!("{kind} {index} is referred to, but the file has {count} of them")
        })?;
        Ok(&self.text[*start as usize..])
    }
}

/// A sentence about JSON that is something else.
pub(super) fn not_gltf(cause: &str) -> String {
    format!("its JSON does not describe glTF 2.0 ({cause})")
}

/// What a text begins with; numbers and members that only some writers write are understood, too.
pub(super) fn read<T: DeserializeOwned>(text: &str) -> serde_json::Result<T> {
    let reader = || serde_json::Deserializer::from_str(text);
    // Sound objects take the short way.
    T::deserialize(&mut reader()).or_else(|_| {
        let mut tree = Value::deserialize(&mut reader())?;
        lenient::make_whole(&mut tree);
        T::deserialize(tree)
    })
}

/// Members of an object by their names, the last of equal names, without those that are null.
pub(super) fn members(text: &str) -> Fallible<BTreeMap<Cow<'_, str>, &str>> {
    serde_json::Deserializer::from_str(text)
        .deserialize_map(Members)
        .map_err(|cause| not_gltf(&cause.to_string()))
}

/// One of the [`members`].
pub(super) fn member<'a>(text: &'a str, name: &str) -> Fallible<Option<&'a str>> {
    members(text).map(|found| found.get(name).copied())
}

struct Starts {
    base: usize,
}

impl<'de> Visitor<'de> for Starts {
    type Value = Vec<u32>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<u32>, A::Error> {
        let mut starts = Vec::new();
        while let Some(object) = list.next_element::<&RawValue>()? {
            starts.push((object.get().as_ptr().addr() - self.base) as u32);
        }
        Ok(starts)
    }
}

struct Members;

impl<'de> Visitor<'de> for Members {
    type Value = BTreeMap<Cow<'de, str>, &'de str>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Self::Value, A::Error> {
        let mut found = BTreeMap::new();
        while let Some((key, value)) = object.next_entry::<_, &RawValue>()? {
            found.insert(key, value.get());
        }
        found.retain(|_, value| *value != "null");
        Ok(found)
    }
}
