#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| axisbridge_tests::fuzz::run("config", data));
