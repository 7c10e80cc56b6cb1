#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("textures"), |bytes: &[u8]| guided::judge("textures", bytes));
