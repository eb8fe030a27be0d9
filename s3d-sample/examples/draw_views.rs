//! Prints the candidate views of a scan location as CSV, in degrees.
//!
//! `cargo run --example draw_views -- UUID [SEED [COUNT]]`
#![allow(clippy::print_stdout)] // It is a program.

use s3d_sample::{CANDIDATES_PER_LOCATION, ViewDistribution, draw_view};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let location = args.next().ok_or("usage: draw_views UUID [SEED [COUNT]]")?;
    let seed = args.next().map_or(Ok(0), |word| word.parse())?;
    let count = args.next().map_or(Ok(CANDIDATES_PER_LOCATION), |word| word.parse())?;
    println!("location,view,yaw_deg,pitch_deg,fov_deg");
    for number in 0..count {
        let view = draw_view(&ViewDistribution::default(), seed, &location, number);
        let [yaw, pitch, fov] = [view.yaw_rad, view.pitch_rad, view.fov_rad].map(f64::to_degrees);
        println!("{location},{number},{yaw:.6},{pitch:.6},{fov:.6}");
    }
    Ok(())
}
