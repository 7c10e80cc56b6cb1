#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("maps"), |bytes: &[u8]| guided::judge("maps", bytes));
