//! `s3d verify`: whether a data set is what its manifest and its own files say.

use super::{on_threads, print};
use crate::args::VerifyArgs;
use crate::failure::{Failure, Outcome};
use crate::verify::verify;
use s3d_io::Layout;

pub(crate) fn run(args: &VerifyArgs) -> Outcome<()> {
    let layout = Layout::new(args.output.clone());
    if !layout.manifest().is_file() {
        return Err(Failure::Call(format!(
            "{}: no data set is there (no manifest.json): give the folder of one",
            layout.root().display()
        )));
    }
    let report = on_threads(args.threads, || verify(&layout, args.full))?;
    print(&report.text())?;
    if let Some(why) = report.again() {
        return Err(Failure::Again(why));
    }
    match report.faults() {
        0 => Ok(()),
        1 => Err(Failure::Input(format!("{}: 1 fault", layout.root().display()))),
        n => Err(Failure::Input(format!("{}: {n} faults", layout.root().display()))),
    }
}
