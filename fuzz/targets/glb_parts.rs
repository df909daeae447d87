#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| vesicle_fuzz::run("glb_parts", data));
