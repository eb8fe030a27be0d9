//! Says which levels of vector instructions tests reach on this processor: `.ci/run` prints it.

#![allow(clippy::print_stdout)]

use s3d_simd::ProvenLevel;

fn main() {
    let levels: Vec<String> = ProvenLevel::all()
        .iter()
        .map(|level| level.name().to_string())
        .collect();
    println!("levels of vector instructions that this processor tests: {}", levels.join(", "));
}
