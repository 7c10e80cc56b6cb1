//! Tests of gltf_files.
