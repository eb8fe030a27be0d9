//! What single loaders of point clouds want, made from the S3DIS tree of a data set, in `profiles/NAME`.
//!
//! Each file below says at its top what its loader reads, and where it would stop. A profile reads the tree's text files
//! piece by piece; what is in memory does not grow with a room.

mod arrays;
mod open3d_ml;
mod pickle;
mod pointcept;
mod room;

use super::work::for_each_in_order;
use crate::console::Progress;
use crate::failure::Outcome;
use room::{TreeRoom, rooms_of};
use s3d_io::{Error, Layout, create_dir, write_whole};
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use tracing::info;

/// A loader that a data set can be written for besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Profile {
    Mmdet3d,
    Open3dMl,
    Pointcept,
    PointNet,
}

impl Profile {
    pub(crate) const ALL: [Self; 4] = [Self::Mmdet3d, Self::Open3dMl, Self::Pointcept, Self::PointNet];

    /// Its name, and that of its folder.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mmdet3d => "mmdet3d",
            Self::Open3dMl => "open3d-ml",
            Self::Pointcept => "pointcept",
            Self::PointNet => "pointnet",
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Profile {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|p| p.name() == word);
        found.ok_or_else(|| format!("{word:?} is none of pointcept, open3d-ml, mmdet3d and pointnet"))
    }
}

/// The areas that loaders ask for, there or not.
const AREAS_OF_LOADERS: std::ops::RangeInclusive<u32> = 1..=6;

/// Writes the profiles of a data set of these areas, whose S3DIS tree is written.
pub(crate) fn write(layout: &Layout, areas: &[u32], profiles: &[Profile]) -> Outcome<()> {
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
            Profile::PointNet => arrays::write_pointnet(&dir, &rooms)?,
            Profile::Mmdet3d => arrays::write_mmdet3d(&dir, &rooms)?,
            Profile::Open3dMl => open3d_ml::write(&dir, &rooms)?,
            Profile::Pointcept => pointcept::write(&dir, layout, areas, &rooms)?,
        }
        info!("{}: {} rooms for {profile}", dir.display(), rooms.len());
    }
    Ok(())
}

/// Does `work` on every room, on all threads.
fn for_each_room(rooms: &[TreeRoom], work: impl Fn(&TreeRoom) -> Outcome<()> + Sync) -> Outcome<()> {
    let progress = Progress::new("profile", "rooms", rooms.len() as u64);
    for_each_in_order(
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
fn write_lines(path: &Path, lines: impl IntoIterator<Item = String>) -> Outcome<()> {
    write_whole(path, |w| lines.into_iter().try_for_each(|line| writeln!(w, "{line}")))?;
    Ok(())
}

/// Gives a file a second name, or copies it where the file system knows no such thing.
fn link(from: &Path, to: &Path) -> Outcome<()> {
    match std::fs::hard_link(from, to) {
        Ok(()) => Ok(()),
        Err(_) => std::fs::copy(from, to).map(drop).map_err(|e| Error::io(to, "copy to", e).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_folders() {
        assert_eq!(Profile::ALL.map(Profile::name), s3d_io::PROFILES);
        for profile in Profile::ALL {
            assert_eq!(profile.name().parse(), Ok(profile));
        }
        assert!("PointNet".parse::<Profile>().unwrap_err().contains("open3d-ml"));
    }
}
