#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("hdr"), |bytes: &[u8]| guided::judge("hdr", bytes));
