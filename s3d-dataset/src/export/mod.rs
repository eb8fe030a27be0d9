//! The export: load → label → sample → score → select → render → tables.
//!
//! [`Export`] begins in a folder or goes on there, does the units of work that are left, writes each down in
//! a journal, and finishes the data set. A [`Shard`] does a part of the units.

// The one place that composes the stages: `run.rs` begins and ends in the folder, `job.rs` does the units,
// and `finish.rs` writes what belongs to the whole.

pub(crate) mod area;
pub(crate) mod bundled;
pub(crate) mod common;
pub(crate) mod finish;
pub(crate) mod images;
pub(crate) mod input;
pub(crate) mod job;
pub(crate) mod labels;
pub(crate) mod location;
pub(crate) mod modality;
pub(crate) mod plan;
pub(crate) mod points;
pub(crate) mod run;
pub(crate) mod scoring;
pub(crate) mod shard;
pub(crate) mod transfer;
pub(crate) mod views;

pub use input::memory::{MemoryScene, SceneSource, SharedScene};
pub use shard::assignment::Shard;

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::export::bundled::{PackageJob, export_bundled};
use crate::export::plan::Plan;
use crate::export::shard::export_shard;
use crate::options::ExportOptions;
use crate::record::data_set::DataSet;
use crate::store::new_folder::check_apart;
use crate::summary::Summary;
use job::export;
use run::{Run, Target};
use s3d_io::dataset::{Domain, Layout};
use std::path::{Path, PathBuf};

/// An export, which turns scenes into a data set. See the crate's page for an example.
#[derive(Clone, Debug)]
pub struct Export {
    scenes: Vec<SceneSource>,
    options: ExportOptions,
    overwrite: bool,
    allowed: Vec<String>,
    shard: Option<Shard>,
    plan: Option<PathBuf>,
}

impl Export {
    /// Makes an export of these scenes, one an area: paths of scene files (`scene.toml`) or of folders of
    /// published areas (`area_3`), or [values in memory](crate::export::MemoryScene).
    pub fn new<S: Into<SceneSource>>(scenes: impl IntoIterator<Item = S>) -> Self {
        Self {
            scenes: scenes.into_iter().map(Into::into).collect(),
            options: ExportOptions::default(),
            overwrite: false,
            allowed: Vec::new(),
            shard: None,
            plan: None,
        }
    }

    /// Sets the options.
    pub fn options(self, options: ExportOptions) -> Self {
        Self { options, ..self }
    }

    /// Sets whether an earlier data set, or an unfinished one of another call, is replaced. Other files stay.
    pub fn overwrite(self, overwrite: bool) -> Self {
        Self { overwrite, ..self }
    }

    /// Allows a name in the output folder to be there beforehand.
    pub fn allow(mut self, name: impl Into<String>) -> Self {
        self.allowed.push(name.into());
        self
    }

    /// Does only one of several parts of the work. The parts may be done anywhere, in any order, into one
    /// folder or one each; [`merge`](crate::merge()) makes one data set from them.
    pub fn shard(self, shard: Option<Shard>) -> Self {
        Self { shard, ..self }
    }

    /// Takes labels and scores from the folder that [`plan`](crate::plan()) made, instead of making them.
    pub fn plan(self, plan: Option<PathBuf>) -> Self {
        Self { plan, ..self }
    }

    /// Checks whether the folder `output` may be exported into, and changes nothing.
    ///
    /// # Errors
    /// [`Usage`](crate::Error::Usage) if the folder holds something else that is not to be replaced.
    pub fn check_output(&self, output: &Path, ctx: &Context) -> Result<()> {
        Run::new(ctx, &self.target(output.into())).look().map(drop)
    }

    /// Returns whether what an earlier call made is replaced.
    pub(crate) fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// Returns the export of only the modalities that `is_used` tells of, for a package for `whom`. Fails if
    /// none is left.
    pub(crate) fn keeping(&self, is_used: impl Fn(Domain) -> bool, whom: &str) -> Result<Self> {
        let mut kept = self.clone();
        kept.options.modalities.retain(|domain| is_used(*domain));
        if kept.options.modalities.is_empty() {
            let value = joined(&self.options.modalities);
            let why = format!("{whom} has no use for them");
            return Err(UsageError::InvalidValue { option: "modalities", value, why }.into());
        }
        Ok(kept)
    }

    /// Refuses what cannot end in a package for `whom` at `place`: an export without the `required`
    /// modalities, a part of one, or one with profiles; a place in its input, or around it.
    pub(crate) fn check_packable(&self, required: &[Domain], whom: &str, place: &Path) -> Result<()> {
        let invalid = |option, value: String, why: &str| {
            let why = why.to_owned();
            Err(UsageError::InvalidValue { option, value, why }.into())
        };
        let ExportOptions { modalities, profiles, .. } = &self.options;
        if let Some(missing) = required.iter().find(|domain| !modalities.contains(domain)) {
            return invalid("modalities", joined(modalities), &format!("{whom} needs {missing}"));
        }
        if let Some(shard) = self.shard {
            let why = "a package is made whole: export the shards, merge them, and pack the data set";
            return invalid("shard", shard.to_string(), why);
        }
        if !profiles.is_empty() {
            let why = "profiles are files of a data set: export one, and pack it";
            return invalid("profiles", joined(profiles), why);
        }

        for scene in &self.scenes {
            let paths = match scene {
                SceneSource::Path(path) => std::slice::from_ref(path),
                SceneSource::Meshes { paths, .. } => paths,
                SceneSource::Memory(_) => &[],
            };
            paths.iter().try_for_each(|path| check_apart(place, path))?;
        }
        Ok(())
    }

    /// Makes a package: see [`export_bundled`]. The work goes on in the folder `work`, which holds nothing
    /// else.
    pub(crate) fn run_bundled<F: FnOnce() -> Result<(u64, u64)>>(
        &self,
        work: PathBuf,
        package: PackageJob<'_, impl FnOnce(DataSet) -> Result<F>>,
        ctx: &Context,
    ) -> Result<Summary> {
        let (options, plan) = self.checked(ctx)?;
        let target = Target { layout: Layout::new(work), overwrite: true, allowed: Vec::new() };
        export_bundled(&self.scenes, &target, &options, plan.as_ref(), package, ctx)
    }

    /// Returns the options as they are stored, and the plan.
    fn checked(&self, ctx: &Context) -> Result<(ExportOptions, Option<Plan>)> {
        if self.scenes.is_empty() {
            return Err(UsageError::NoScenes.into());
        }
        let options = self.options.canonical()?;
        let plan = self.plan.as_deref().map(|folder| Plan::open(ctx, folder)).transpose()?;
        Ok((options, plan))
    }

    fn target(&self, output: PathBuf) -> Target<'_> {
        let allowed = self.allowed.iter().map(String::as_str).collect();
        Target { layout: Layout::new(output), overwrite: self.overwrite, allowed }
    }

    /// Makes the data set in the folder `output`, on the threads of the current rayon pool. Continues where
    /// an equal call was stopped. After [`Cancelled`](crate::Error::Cancelled) or
    /// [`Temporary`](crate::Error::Temporary), the work so far is kept for the same call. After any other
    /// failure, the folder is as it was before.
    ///
    /// Returns what was made; `None` if all of it was there already.
    ///
    /// # Errors
    /// [`Usage`](crate::Error::Usage) if the options are out of range or the folder holds something else;
    /// [`Input`](crate::Error::Input) or [`File`](crate::Error::File) if the input is wrong;
    /// [`Cancelled`](crate::Error::Cancelled); [`Temporary`](crate::Error::Temporary).
    pub fn run(&self, output: impl Into<PathBuf>, ctx: &Context) -> Result<Option<Summary>> {
        let (options, plan) = self.checked(ctx)?;
        let target = self.target(output.into());
        match self.shard {
            Some(shard) => export_shard(ctx, &self.scenes, &target, &options, shard, plan.as_ref()),
            None => export(ctx, &self.scenes, &target, &options, plan.as_ref()),
        }
    }
}

/// Returns the words of options, with commas.
fn joined<T: ToString>(values: &[T]) -> String {
    values.iter().map(T::to_string).collect::<Vec<_>>().join(",")
}
