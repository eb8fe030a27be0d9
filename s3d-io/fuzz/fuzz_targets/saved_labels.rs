//! See ../../tests/feed/mod.rs.
#![no_main]

libfuzzer_sys::fuzz_target!(init: s3d_io_fuzz::start("saved_labels"), |data: &[u8]| s3d_io_fuzz::run(data));
