#![no_main]

libfuzzer_sys::fuzz_mutator!(|bytes: &mut [u8], length: usize, most: usize, seed: u32| {
    guided::mutate_gltf(bytes, length, most, seed)
});

libfuzzer_sys::fuzz_target!(init: guided::begin("gltf"), |bytes: &[u8]| guided::judge("gltf", bytes));
