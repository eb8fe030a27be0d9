//! `s3d`: see [`s3d_cli::run`].

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(s3d_cli::run(std::env::args_os()))
}
