#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("settings"), |bytes: &[u8]| guided::judge("settings", bytes));
