//! What a ray hits.
