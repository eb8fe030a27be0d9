//! Profiles: files for single point-cloud loaders, made from the S3DIS tree of a data set, in
//! `profiles/NAME`.
//!
//! A profile reads the tree's text files piece by piece, so its memory does not grow with a room.

mod arrays;
mod open3d_ml;
mod pickle;
mod pointcept;
pub(crate) mod room;

pub use room::{TreeInstance, TreeRoom};

use crate::context::Context;
use crate::error::{InputError, Result, UsageError};
pub(crate) use crate::options::profile::Profile;
use crate::parallel::for_each_in_order;
use crate::record::data_set::{DataSet, Listed};
use crate::record::listing;
use crate::record::manifest::Manifest;
use crate::store::change::Change;
use crate::store::lock::Lock;
use room::rooms_of;
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::{create_dir, write_whole};
use s3d_label::Taxonomy;
use std::fs;
use std::path::{Path, PathBuf};

/// The areas that loaders ask for, whether they exist or not.
const AREAS_OF_LOADERS: std::ops::RangeInclusive<u32> = 1..=6;

/// How profiles are written into a data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ProfileOptions {
    /// Replace what is in OUT/profiles/NAME.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

/// Writes the profiles into the data set in the folder `root`, to `profiles/NAME`.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if a profile exists and is not to be replaced.
/// [`Error::File`](crate::Error::File), [`Error::Cancelled`](crate::Error::Cancelled) or
/// [`Error::Temporary`](crate::Error::Temporary). After an error the data set is as it was before. After a
/// kill it is too, or the same call completes the change.
pub fn profile(
    root: impl Into<PathBuf>,
    wanted: &[Profile],
    options: &ProfileOptions,
    ctx: &Context,
) -> Result<()> {
    let layout = &Layout::new(root.into());
    let mut wanted = wanted.to_vec();
    wanted.sort();
    wanted.dedup();
    let names: Vec<&str> = wanted.iter().map(|profile| profile.name()).collect();
    let call = format!("profile {}", names.join(","));

    Manifest::require(layout)?;

    // The lock keeps others from replacing the data set.
    Lock::during(ctx, layout, |completed| {
        if completed.as_ref() == Some(&call) {
            ctx.info(format_args!(
                "{}: what a killed process had begun is complete",
                layout.root().display()
            ));
            return Ok(());
        }
        add(ctx, &DataSet::open_in(layout)?, &wanted, options.overwrite, &call)
    })
}

fn add(ctx: &Context, data: &DataSet, wanted: &[Profile], overwrite: bool, call: &str) -> Result<()> {
    let layout = &data.layout;
    let dirs: Vec<PathBuf> = wanted
        .iter()
        .map(|profile| layout.profile_dir(profile.name()))
        .collect();
    if let Some(dir) = dirs.iter().find(|dir| dir.exists() && !overwrite) {
        return Err(UsageError::Exists { path: dir.clone(), note: None }.into());
    }
    if !data.manifest.is_labelled() {
        let dataset = layout.root().to_owned();
        return Err(InputError::WithoutLabels { dataset, needs: "profiles need" }.into());
    }

    let areas = &data.manifest.area_numbers;
    let trees: Vec<PathBuf> = areas.iter().map(|area| layout.s3dis_area_dir(*area)).collect();
    data.files
        .require(ctx, |path| trees.iter().any(|tree| path.starts_with(tree)))?;

    let change = Change::begin(layout, &dirs)?;
    let staged = change.staged();
    write(&Source { ctx, layout, files: &data.files, taxonomy: &data.taxonomy }, staged, areas, wanted)?;

    let mut files = Vec::new();
    for profile in wanted {
        files.extend(listing::walk(&staged.profile_dir(profile.name()))?);
    }
    let changed = listing::records(ctx, staged, &files)?;

    let mut manifest = Manifest::read(layout)?;
    manifest.add_profiles(wanted);
    let folders: Vec<String> = wanted
        .iter()
        .map(|profile| format!("profiles/{}/", profile.name()))
        .collect();
    let is_gone = |path: &str| folders.iter().any(|folder| path.starts_with(folder));
    listing::write_changed(data, &mut manifest, changed, is_gone, staged)?;
    change.commit(call, &dirs)
}

/// Writes the profiles of a data set with these areas to their places in `staged`. The S3DIS tree must be
/// written.
pub(crate) fn write(source: &Source<'_>, staged: &Layout, areas: &[u32], profiles: &[Profile]) -> Result<()> {
    if profiles.is_empty() {
        return Ok(());
    }
    let mut rooms = Vec::new();
    for area in areas {
        rooms.extend(rooms_of(source.layout, source.taxonomy, *area)?);
    }

    for profile in profiles {
        let dir = staged.profile_dir(profile.name());
        create_dir(&dir)?;
        match profile {
            Profile::PointNet => arrays::write_pointnet(source, &dir, &rooms)?,
            Profile::Mmdet3d => arrays::write_mmdet3d(source, &dir, &rooms)?,
            Profile::Open3dMl => open3d_ml::write(source, &dir, &rooms)?,
            Profile::Pointcept => pointcept::write(source, &dir, areas, &rooms)?,
        }

        let place = source.layout.profile_dir(profile.name());
        source
            .ctx
            .info(format_args!("{}: {} rooms for {profile}", place.display(), rooms.len()));
    }
    Ok(())
}

/// The source of profiles.
pub(crate) struct Source<'a> {
    pub(crate) ctx: &'a Context,
    pub(crate) layout: &'a Layout,
    pub(crate) files: &'a Listed,
    /// The taxonomy of the tree's class and room names.
    pub(crate) taxonomy: &'a Taxonomy,
}

impl Source<'_> {
    /// Gives a file of the data set a second name, or copies it if the file system has no hard links.
    fn link(&self, from: &Path, to: &Path) -> Result<()> {
        let from = self.files.checked(from)?;
        match fs::hard_link(from, to) {
            Ok(()) => Ok(()),
            Err(_) => fs::copy(from, to)
                .map(drop)
                .map_err(|e| FileError::io(to, "copy to", e).into()),
        }
    }
}

/// Runs `work` on every room, on all threads.
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

/// Writes a text file, a line for each string.
fn write_lines(path: &Path, lines: impl IntoIterator<Item = String>) -> Result<()> {
    write_whole(path, |w| lines.into_iter().try_for_each(|line| writeln!(w, "{line}")))?;
    Ok(())
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
