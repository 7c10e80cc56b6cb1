//! Lists that grow with what belongs to a vertex or is known by its number.

/// Appends a value; its index.
pub(super) fn appended<T>(values: &mut Vec<T>, value: T) -> u32 {
    values.push(value);
    values.len() as u32 - 1
}

/// Appends the value of a vertex, if vertices have values.
pub(super) fn again<T: Copy>(values: &mut Vec<T>, vertex: usize) {
    values.extend(values.get(vertex).copied());
}
