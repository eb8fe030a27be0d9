//! What the numbers of an image mean: classes, or instances with a class.

use super::super::names::ClassNames;
use s3d_dataset::Result;
use s3d_io::Error as FileError;
use s3d_label::Class;
use std::path::Path;

/// Numbers of the background unless a list names them, where a list says what numbers are.
const BACKGROUND: [u32; 3] = [0, 255, 65_535];

/// The numbers of one image.
pub(super) struct Numbers<'n, 't> {
    path: &'n Path,
    /// The list of this image alone: its numbers are instances.
    own: Option<ClassNames<'t>>,
    names: &'n ClassNames<'t>,
}

/// The meaning of a number.
pub(super) enum Meaning {
    Nothing,
    Class(Class),
    /// An instance of this image.
    Instance(Class),
}

impl<'n, 't> Numbers<'n, 't> {
    /// Reads the list beside an image, if there is one. `names` are those of the folder.
    ///
    /// # Errors
    /// [`FileError`] if the list is damaged.
    pub(super) fn of(path: &'n Path, names: &'n ClassNames<'t>) -> Result<Self> {
        let places = ["json", "csv"].map(|ending| path.with_extension(ending));
        let file = places.into_iter().find(|path| path.is_file());
        let own = file.map(|file| ClassNames::read(file, names.taxonomy)).transpose()?;
        Ok(Self { path, own, names })
    }

    /// Whether numbers of this image may be instances.
    pub(super) fn have_instances(&self) -> bool {
        self.own.is_some() || self.names.has_ranges()
    }

    /// # Errors
    /// [`FileError`] for a number without a meaning.
    pub(super) fn of_number(&self, number: u32) -> Result<Meaning> {
        let wanted = i64::from(number);
        let names = self.own.as_ref().unwrap_or(self.names);
        if names.are_said() && BACKGROUND.contains(&number) && !names.knows(wanted) {
            return Ok(Meaning::Nothing);
        }
        if let Some(class) = names.class_of_range(wanted) {
            return Ok(class.map_or(Meaning::Nothing, Meaning::Instance));
        }
        match names.class_of_number(wanted) {
            Ok(None) => Ok(Meaning::Nothing),
            Ok(Some(class)) if self.own.is_some() => Ok(Meaning::Instance(class)),
            Ok(Some(class)) => Ok(Meaning::Class(class)),
            Err(_) if number == 65_535 => Ok(Meaning::Nothing),
            Err(why) => Err(FileError::format(self.path, format!("has a pixel of {why}")).into()),
        }
    }
}
