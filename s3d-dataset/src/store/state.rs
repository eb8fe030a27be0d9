//! The state of an output folder, read once, and whether an export may go into it.

use crate::context::Context;
use crate::error::{Difference, Held, Overwriting, Result, UsageError, passes};
use crate::record::manifest::{Head, Manifest};
use crate::record::request::{Request, begun_by_other_version, read_request};
use crate::store::backup::{BACKUP, MOVING, TRASH};
use crate::store::links::{refuse_link, refuse_links_below};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use std::ffi::OsStr;
use std::fs;
use std::path::PathBuf;

/// The state of an output folder when it was read.
#[derive(Debug)]
pub(crate) struct OutputState {
    /// The head of its manifest, if the manifest is ours.
    head: Option<Head>,
    /// The manifest of a complete data set, or the reason why this version of s3d cannot read it.
    manifest: Option<Result<Manifest, String>>,
    /// The request of an unfinished export.
    request: Option<Request>,
    /// The version of s3d that began an unfinished export whose request this version cannot read.
    other_version: Option<String>,
    /// Whether the unfinished export failed for good.
    failed: bool,
}

/// The content of an output folder, compared with a request.
#[derive(Debug)]
pub(super) enum Holding {
    /// Nothing of ours.
    Nothing,
    /// A complete data set.
    Complete {
        /// How its request differs.
        differences: Vec<Difference>,
    },
    /// An unfinished export.
    Unfinished {
        areas: Vec<u32>,
        /// How its request differs.
        differences: Vec<Difference>,
        failed: bool,
    },
    /// The rest of an unfinished export of these areas that cannot be continued.
    Leftover { areas: Vec<u32> },
}

impl OutputState {
    /// Reads the state of a folder.
    ///
    /// # Errors
    /// Fails if a file cannot be read now but may exist: see [`if_there`](crate::record::if_there).
    pub(crate) fn read(layout: &Layout) -> Result<Self> {
        let head = Head::read(&layout.manifest())?;
        let manifest = if head.as_ref().is_some_and(Head::is_complete) {
            match Manifest::read(layout) {
                Ok(manifest) => Some(Ok(manifest)),
                Err(e) if passes(&e) => return Err(e.into()),
                // The manifest is of another version, or the data set is half changed.
                Err(e) => Some(Err(e.to_string())),
            }
        } else {
            None
        };

        let request = read_request(layout)?;
        let other_version = if request.is_none() {
            begun_by_other_version(layout)?
        } else {
            None
        };
        Ok(Self { head, manifest, request, other_version, failed: layout.failed().exists() })
    }

    /// Returns whether an export into the folder has begun, or is complete.
    pub(crate) fn is_begun(&self) -> bool {
        self.head.is_some() || self.request.is_some()
    }

    /// Returns whether the folder holds a complete data set.
    pub(super) fn is_complete(&self) -> bool {
        self.manifest.is_some()
    }

    /// Returns whether an export was begun and is not complete.
    pub(super) fn has_request(&self) -> bool {
        self.request.is_some() || self.other_version.is_some()
    }

    /// Returns the state after the rest of an export beside a complete data set is removed.
    pub(super) fn without_request(self) -> Self {
        Self { request: None, other_version: None, failed: false, ..self }
    }

    /// Returns the areas that the manifest lists.
    pub(super) fn areas_of_manifest(&self) -> Vec<u32> {
        self.head.as_ref().map_or(Vec::new(), |head| head.area_numbers.clone())
    }

    /// Returns the areas that lie there, or may: of the manifest and of an unfinished export.
    fn areas_there(&self) -> Vec<u32> {
        let begun = self.request.as_ref().map_or(Vec::new(), Request::numbers);
        [self.areas_of_manifest(), begun].concat()
    }

    /// Compares the folder with a request.
    pub(super) fn compare(&self, request: &Request) -> Holding {
        if let Some(manifest) = &self.manifest {
            let differences = match manifest {
                Ok(manifest) => manifest.differences(request),
                Err(message) => vec![Difference::Other(message.clone())],
            };
            return Holding::Complete { differences };
        }

        if let Some(begun) = &self.request {
            return Holding::Unfinished {
                areas: begun.numbers(),
                differences: begun.differences(request),
                failed: self.failed,
            };
        }

        if self.head.is_none() {
            return Holding::Nothing;
        }
        let areas = self.areas_of_manifest();
        match &self.other_version {
            Some(there) => Holding::Unfinished {
                areas,
                differences: vec![Difference::Other(format!(
                    "version {there} of s3d there, {} now",
                    request.version
                ))],
                failed: self.failed,
            },
            None => Holding::Leftover { areas },
        }
    }

    /// Refuses a folder with an entry that s3d did not write, unless `overwrite` is set or the entry's name
    /// is one of `allowed`. Changes nothing.
    pub(crate) fn check(
        &self,
        ctx: &Context,
        layout: &Layout,
        overwrite: bool,
        allowed: &[&str],
    ) -> Result<()> {
        let root = layout.root();
        if layout.root_misleads_loaders() {
            ctx.warn(format_args!(
                "{}: \"rgb\" in the folder's name misleads loaders that swap it for another modality in \
                 whole paths",
                root.display()
            ));
        }

        let working = [layout.work_dir(), root.join(MOVING), root.join(BACKUP), root.join(TRASH)];
        working.iter().try_for_each(|path| refuse_link(path))?;

        // A plan's journals would be mistaken for an export's.
        if crate::store::is_plan(root) {
            return Err(UsageError::HoldsPlan { folder: root.to_owned() }.into());
        }

        let entries = match fs::read_dir(root) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            entries => entries.map_err(|e| FileError::io(root, "use as the output folder", e))?,
        };
        if overwrite || self.is_complete() || self.request.is_some() {
            return Ok(());
        }

        // An unfinished export without a request left these, and they cannot be continued.
        let leftover = layout.entries(&self.areas_of_manifest());
        for entry in entries {
            let path = entry.map_err(|e| FileError::io(root, "read", e))?.path();
            let name = path.file_name().unwrap_or_default();
            let is_leftover = self.head.is_some() && leftover.iter().any(|b| b.starts_with(&path));
            if is_leftover || is_working_name(name) || allowed.iter().any(|a| name == *a) {
                continue;
            }
            return Err(UsageError::Holds {
                folder: root.to_owned(),
                entry: name.display().to_string(),
                overwriting: Overwriting::Beside,
            }
            .into());
        }
        Ok(())
    }

    /// Refuses links among the folders that an export of `request` writes to or removes from.
    pub(crate) fn refuse_links(&self, layout: &Layout, request: &Request) -> Result<()> {
        let mut areas = request.numbers();
        areas.extend(self.areas_there());
        let mut entries = layout.entries(&areas);
        entries.extend(layout.shared_dirs());
        entries.push(layout.work_dir());
        entries.iter().try_for_each(|entry| refuse_links_below(entry))
    }

    /// Refuses a folder in which the data set, or an earlier one that it replaces, would overwrite its own
    /// input: one of the files or folders `inputs` of these areas.
    pub(crate) fn check_inputs<'p>(
        &self,
        layout: &Layout,
        mut areas: Vec<u32>,
        inputs: impl Iterator<Item = &'p PathBuf>,
    ) -> Result<()> {
        let Ok(root) = fs::canonicalize(layout.root()) else { return Ok(()) };

        // The areas of an earlier data set are replaced too.
        areas.extend(self.areas_there());
        let mut entries = Layout::new(&root).entries(&areas);
        entries.push(root.join(BACKUP));

        for path in inputs {
            let Ok(input) = fs::canonicalize(path) else { continue };
            let lies_in_output = entries.iter().any(|entry| input.starts_with(entry));
            if lies_in_output || input.is_dir() && root.starts_with(&input) {
                let folder = layout.root().to_owned();
                return Err(UsageError::OverInput { folder, input: path.clone() }.into());
            }
        }
        Ok(())
    }
}

impl Holding {
    /// Refuses to replace the data set or export of another call, unless `overwrite` is set.
    pub(super) fn refuse(&self, layout: &Layout, overwrite: bool) -> Result<()> {
        let (held, differences) = match self {
            Self::Complete { differences } => (&Held::DataSet, differences),
            Self::Unfinished { differences, failed: false, .. } => (&Held::UnfinishedExport, differences),
            Self::Unfinished { .. } | Self::Leftover { .. } | Self::Nothing => return Ok(()),
        };
        if overwrite || differences.is_empty() {
            return Ok(());
        }

        let folder = layout.root().to_owned();
        Err(UsageError::OtherCall { folder, held: *held, differences: differences.clone() }.into())
    }

    /// Returns whether this is a complete data set of the same request.
    pub(super) fn is_complete(&self) -> bool {
        matches!(self, Self::Complete { differences } if differences.is_empty())
    }

    /// Returns whether this is an unfinished export of the same request.
    pub(super) fn is_unfinished(&self) -> bool {
        matches!(self, Self::Unfinished { differences, .. } if differences.is_empty())
    }
}

/// Returns whether an export uses this name in an output folder while it works.
pub(crate) fn is_working_name(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name == ".s3d" || name.starts_with(".s3d-")
}
