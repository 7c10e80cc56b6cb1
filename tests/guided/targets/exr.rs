#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("exr"), |bytes: &[u8]| guided::judge("exr", bytes));
