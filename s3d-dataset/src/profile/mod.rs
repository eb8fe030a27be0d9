//! What single loaders of point clouds want, made from the S3DIS tree of a data set, in `profiles/NAME`.
//!
//! Each file below says at its top what its loader reads, and where it would stop. A profile reads the tree's
//! text files piece by piece; what is in memory does not grow with a room.

mod arrays;
pub(crate) mod loader;
mod open3d_ml;
mod pickle;
mod pointcept;
mod room;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::work::for_each_in_order;
use crate::store::lock::Lock;
use crate::tables::listing;
use crate::tables::manifest::{Head, Manifest};
pub(crate) use loader::Profile;
use room::{TreeRoom, rooms_of};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::{create_dir, write_whole};
use std::fs;
use std::path::{Path, PathBuf};

/// The areas that loaders ask for, there or not.
const AREAS_OF_LOADERS: std::ops::RangeInclusive<u32> = 1..=6;

/// How profiles are written into a data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProfileOptions {
    /// Replace those that are there.
    pub overwrite: bool,
}

/// Writes what these loaders want into the data set in the folder `root`, to `profiles/NAME`.
///
/// # Errors
/// [`Error::Usage`] if one is there and not to be replaced; [`Error::File`]; [`Error::Cancelled`];
/// [`Error::Temporary`]. No half of a profile is left behind.
pub fn profile(
    root: impl Into<PathBuf>,
    wanted: &[Profile],
    options: &ProfileOptions,
    ctx: &Context,
) -> Result<()> {
    let layout = &Layout::new(root.into());
    Head::require(layout)?;
    // Nobody may replace the data set meanwhile.
    Lock::during(ctx, layout, || add(ctx, layout, wanted, options.overwrite))
}

fn add(ctx: &Context, layout: &Layout, wanted: &[Profile], overwrite: bool) -> Result<()> {
    let head = Head::require(layout)?;
    let mut manifest = Manifest::read(layout)?;
    let mut wanted = wanted.to_vec();
    wanted.sort();
    wanted.dedup();
    for profile in &wanted {
        let dir = layout.profile_dir(profile.name());
        if dir.exists() && !overwrite {
            return Err(Error::Usage(format!(
                "{} is there already: replace it with --overwrite",
                dir.display()
            )));
        }
    }
    for profile in &wanted {
        let dir = layout.profile_dir(profile.name());
        if dir.exists() {
            fs::remove_dir_all(&dir).map_err(|e| FileError::io(&dir, "remove", e))?;
        }
    }
    if let Err(e) = write(ctx, layout, &head.area_numbers, &wanted) {
        // Halves of profiles would stand in the way of the same call.
        for profile in &wanted {
            let _ = fs::remove_dir_all(layout.profile_dir(profile.name()));
        }
        return Err(e);
    }
    manifest.add_profiles(&wanted);
    let mut files = Vec::new();
    for profile in &wanted {
        files.extend(listing::walk(&layout.profile_dir(profile.name()))?);
    }
    let changed = listing::records(ctx, layout, &files)?;
    let is_gone =
        |path: &str| wanted.iter().any(|profile| path.starts_with(&format!("profiles/{}/", profile.name())));
    listing::update(layout, &mut manifest, changed, is_gone)
}

/// Writes the profiles of a data set of these areas, whose S3DIS tree is written.
pub(crate) fn write(ctx: &Context, layout: &Layout, areas: &[u32], profiles: &[Profile]) -> Result<()> {
    if profiles.is_empty() {
        return Ok(());
    }
    let mut rooms = Vec::new();
    for area in areas {
        rooms.extend(rooms_of(layout, *area)?);
    }
    for profile in profiles {
        let dir = layout.profile_dir(profile.name());
        create_dir(&dir)?;
        match profile {
            Profile::PointNet => arrays::write_pointnet(ctx, &dir, &rooms)?,
            Profile::Mmdet3d => arrays::write_mmdet3d(ctx, &dir, &rooms)?,
            Profile::Open3dMl => open3d_ml::write(ctx, &dir, &rooms)?,
            Profile::Pointcept => pointcept::write(ctx, &dir, layout, areas, &rooms)?,
        }
        ctx.info(format_args!("{}: {} rooms for {profile}", dir.display(), rooms.len()));
    }
    Ok(())
}

/// Does `work` on every room, on all threads.
fn for_each_room(
    ctx: &Context,
    rooms: &[TreeRoom],
    work: impl Fn(&TreeRoom) -> Result<()> + Sync,
) -> Result<()> {
    let progress = ctx.progress("profile", "rooms", rooms.len() as u64);
    for_each_in_order(
        ctx,
        rooms,
        || (),
        |(), room| {
            work(room)?;
            progress.add(1);
            Ok(())
        },
    )
}

/// Writes a text file of lines.
fn write_lines(path: &Path, lines: impl IntoIterator<Item = String>) -> Result<()> {
    write_whole(path, |w| lines.into_iter().try_for_each(|line| writeln!(w, "{line}")))?;
    Ok(())
}

/// Gives a file a second name, or copies it where the file system knows no such thing.
fn link(from: &Path, to: &Path) -> Result<()> {
    match std::fs::hard_link(from, to) {
        Ok(()) => Ok(()),
        Err(_) => std::fs::copy(from, to).map(drop).map_err(|e| FileError::io(to, "copy to", e).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_folders() {
        assert_eq!(Profile::ALL.map(Profile::name), s3d_io::dataset::PROFILES);
        for profile in Profile::ALL {
            assert_eq!(profile.name().parse(), Ok(profile));
        }
        assert!("PointNet".parse::<Profile>().unwrap_err().contains("open3d-ml"));
    }
}
