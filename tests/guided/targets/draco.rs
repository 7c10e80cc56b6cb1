#![no_main]

libfuzzer_sys::fuzz_target!(init: guided::begin("draco"), |bytes: &[u8]| guided::judge("draco", bytes));
