//! `s3d profile`: what point cloud loaders want, from an existing data set.

use crate::args::ProfileArgs;
use crate::failure::{Failure, Outcome};
use crate::pipeline::lock::Lock;
use crate::pipeline::manifest::{Head, Manifest};
use crate::pipeline::{listing, profiles};
use s3d_io::{Error, Layout};
use std::fs;

pub(crate) fn run(args: &ProfileArgs) -> Outcome<()> {
    let layout = Layout::new(args.output.clone());
    Head::require(&layout)?;
    // Nobody may replace the data set meanwhile.
    Lock::during(&layout, || make(&layout, args))
}

fn make(layout: &Layout, args: &ProfileArgs) -> Outcome<()> {
    let head = Head::require(layout)?;
    let mut manifest = Manifest::read(layout)?;
    let mut wanted = args.profiles.clone();
    wanted.sort();
    wanted.dedup();
    for profile in &wanted {
        let dir = layout.profile_dir(profile.name());
        if dir.exists() && !args.overwrite {
            return Err(Failure::Call(format!(
                "{} is there already: replace it with --overwrite",
                dir.display()
            )));
        }
    }
    for profile in &wanted {
        let dir = layout.profile_dir(profile.name());
        if dir.exists() {
            fs::remove_dir_all(&dir).map_err(|e| Error::io(&dir, "remove", e))?;
        }
    }
    if let Err(e) = profiles::write(layout, &head.area_numbers, &wanted) {
        // Halves of profiles would stand in the way of the same call.
        for profile in &wanted {
            let _ = fs::remove_dir_all(layout.profile_dir(profile.name()));
        }
        return Err(e);
    }
    let names: Vec<&str> = wanted.iter().map(|p| p.name()).collect();
    manifest.add_profiles(&names);
    let mut files = Vec::new();
    for name in &names {
        files.extend(listing::walk(&layout.profile_dir(name))?);
    }
    let changed = listing::records(layout, &files)?;
    let is_gone = |path: &str| names.iter().any(|name| path.starts_with(&format!("profiles/{name}/")));
    listing::update(layout, &mut manifest, changed, is_gone)
}
