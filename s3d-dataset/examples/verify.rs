//! Checks a data set: `cargo run --release -p s3d-dataset --example verify OUT`.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, verify};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = std::env::args().nth(1).ok_or("give the folder of a data set")?;
    let report = verify(root, &VerifyOptions::default(), &Context::default())?;
    for group in &report.faults {
        println!("{} ({}): {} faults", group.topic, group.kind, group.count);
        for (file, fault) in &group.first {
            println!("  {file}: {fault}");
        }
    }
    println!("{} checks of {} files, {} faults", report.checks, report.files, report.fault_count());
    if report.fault_count() > 0 {
        Err("the data set is damaged".into())
    } else {
        Ok(())
    }
}
