//! Links in the folder of a data set. What is written or removed there must lie there: through a link it
//! would be files of somebody else. The folder itself may be a link, since its user names it.

use crate::error::{Result, UsageError};
use crate::record::listing::visit_below;
use std::fs;
use std::path::Path;

/// Refuses a path that is a link, unless the link leads to a file: files are replaced and removed by name,
/// which leaves what a link leads to as it was.
pub(super) fn refuse_link(path: &Path) -> Result<()> {
    if path.is_symlink() && !path.is_file() {
        let target = fs::read_link(path).unwrap_or_default();
        return Err(UsageError::Link { path: path.to_owned(), target }.into());
    }
    Ok(())
}

/// Refuses links among a folder and all that is below it.
pub(super) fn refuse_links_below(folder: &Path) -> Result<()> {
    refuse_link(folder)?;
    if !folder.is_dir() {
        return Ok(());
    }
    visit_below(folder, |path| {
        refuse_link(path)?;
        Ok(path.is_dir() && !path.is_symlink())
    })
}

/// Refuses links on the way from `root` to a folder below it.
pub(super) fn refuse_links_to(root: &Path, folder: &Path) -> Result<()> {
    let on_the_way = folder.ancestors().take_while(|path| *path != root);
    on_the_way.into_iter().try_for_each(refuse_link)
}
