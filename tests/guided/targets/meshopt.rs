#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("meshopt"), |bytes: &[u8]| guided::judge("meshopt", bytes));
