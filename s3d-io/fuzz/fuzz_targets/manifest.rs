//! See ../src/lib.rs.
#![no_main]

libfuzzer_sys::fuzz_target!(init: s3d_io_fuzz::start("manifest"), |data: &[u8]| s3d_io_fuzz::run(data));
