//! The surfaces of finished tiles, kept in files so that a killed fuse goes on with them.
//!
//! They lie in a folder beside the output (`NewFile::kept`, `NewFolder::kept`). A list says what they were
//! made of: tiles of other inputs or options are removed. A file begins with the checksum of the rest.

use super::kept::Record;
use crate::context::Context;
use crate::error::Result;
use s3d_fusion::{Surface, Tile};
use s3d_io::fs::{Checksum, create_dir, read_file, read_json, write_bytes, write_json};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// The list of what the tiles were made of.
const LIST: &str = "tiles.json";

/// The kept tiles of one fuse.
pub(super) struct KeptTiles {
    folder: PathBuf,
    /// The tile around all that was measured.
    pub(super) around: Tile,
}

/// What the tiles were made of.
#[derive(PartialEq, Serialize, Deserialize)]
struct List {
    made_of: Record,
    from: [i32; 3],
    to: [i32; 3],
}

impl KeptTiles {
    /// Opens what an earlier call kept. Returns `None` if there is nothing, or if it was made of something
    /// else. `made_of` is only asked for if there is something.
    pub(super) fn open(folder: &Path, made_of: impl FnOnce() -> Result<Record>) -> Result<Option<Self>> {
        let Ok(list) = read_json::<List>(&folder.join(LIST)) else { return Ok(None) };
        let List { from, to, .. } = list;
        let kept = Self { folder: folder.to_owned(), around: Tile { from, to } };
        Ok((list.made_of == made_of()?).then_some(kept))
    }

    /// Begins to keep tiles, and removes those of another call.
    pub(super) fn begin(folder: &Path, made_of: Record, around: Tile) -> Result<Self> {
        let _ = fs::remove_dir_all(folder);
        create_dir(folder)?;
        let Tile { from, to } = around;
        write_json(&folder.join(LIST), &List { made_of, from, to })?;
        Ok(Self { folder: folder.to_owned(), around })
    }

    fn path(&self, tile: Tile, ending: &str) -> PathBuf {
        let [a, b] = [tile.from, tile.to].map(|place| place.map(|k| k.to_string()).join("_"));
        self.folder.join(format!("{a}_to_{b}.{ending}"))
    }

    /// Whether a tile was too large, and is cut.
    pub(super) fn is_cut(&self, tile: Tile) -> bool {
        self.path(tile, "cut").exists()
    }

    /// Notes that a tile was too large.
    pub(super) fn cut(&self, tile: Tile) -> Result<()> {
        write_bytes(&self.path(tile, "cut"), &[])?;
        Ok(())
    }

    /// Keeps the surface of a tile.
    pub(super) fn keep(&self, tile: Tile, surface: &Surface) -> Result<()> {
        let bytes = surface.to_bytes();
        let sum = Checksum::of(&bytes).to_string();
        write_bytes(&self.path(tile, "tile"), &[sum.as_bytes(), &bytes].concat())?;
        Ok(())
    }

    /// Returns the surface of a tile; `None` if it is not kept. A damaged file is told and removed.
    pub(super) fn read(&self, tile: Tile, ctx: &Context) -> Result<Option<Surface>> {
        let path = self.path(tile, "tile");
        if !path.exists() {
            return Ok(None);
        }
        let bytes = read_file(&path)?;
        let length = Checksum::of(&[]).to_string().len();
        let surface = bytes
            .split_at_checked(length)
            .filter(|(sum, rest)| *sum == Checksum::of(rest).to_string().as_bytes())
            .and_then(|(_, rest)| Surface::from_bytes(rest));
        if surface.is_none() {
            ctx.warn(format_args!("{}: a damaged tile: it is made again", path.display()));
            let _ = fs::remove_file(path);
        }
        Ok(surface)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuse::FuseOptions;
    use s3d_fusion::{Fusion, FusionOptions};

    #[test]
    fn tiles_come_back_to_the_same_call_alone() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("kept");
        let scan = dir.path().join("scan.xyz");
        fs::write(&scan, "1 2 3\n").unwrap();
        let record = || Record::of(std::slice::from_ref(&scan), &FuseOptions::default());
        let tile = Tile { from: [-3, 0, 1], to: [4, 5, 6] };
        let ctx = Context::default();
        assert!(KeptTiles::open(&folder, record).unwrap().is_none());

        let kept = KeptTiles::begin(&folder, record().unwrap(), tile).unwrap();
        let surface = Fusion::new(FusionOptions::default()).unwrap().surface();
        assert!(kept.read(tile, &ctx).unwrap().is_none() && !kept.is_cut(tile));
        kept.keep(tile, &surface).unwrap();
        kept.cut(tile).unwrap();
        let kept = KeptTiles::open(&folder, record).unwrap().unwrap();
        assert!(kept.around == tile && kept.is_cut(tile));
        assert_eq!(kept.read(tile, &ctx).unwrap(), Some(surface));

        // A damaged file is told, and made again.
        let path = kept.path(tile, "tile");
        let mut bytes = fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&path, bytes).unwrap();
        assert_eq!(kept.read(tile, &ctx).unwrap(), None);
        assert_eq!((ctx.warnings(), kept.read(tile, &ctx).unwrap()), (1, None));

        // The scan has changed.
        fs::write(&scan, "1 2 4\n").unwrap();
        assert!(KeptTiles::open(&folder, record).unwrap().is_none());
        let kept = KeptTiles::begin(&folder, record().unwrap(), tile).unwrap();
        assert!(kept.read(tile, &ctx).unwrap().is_none() && !kept.is_cut(tile));
    }
}
