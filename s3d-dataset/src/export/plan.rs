//! A plan: labels and scores, made before an export and shared by its shards.
//!
//! The folder of a plan holds `plan.jsonl` (its request, and the label table), `area_N` (a [`LabelledArea`],
//! with its label files in `area_N/3d` as the data set has them), and journals of labels and scores in
//! `.s3d/journal`, a file for each process that worked on it. Processes need not know of one another: each
//! labels the areas that it scores in, if no other has, and scores its share of their locations.

use crate::context::Context;
use crate::error::{Error, Held, InputError, Result, UsageError};
use crate::export::transfer::bring;
use crate::record::checked::read_checked;
use crate::record::journal::{Done, Finished, Unit};
use crate::record::label_list::LabelList;
use crate::record::request::Request;
use crate::store::{is_plan, plan_file};
use crate::survey::labelled_area::LabelledArea;
use s3d_io::Error as FileError;
use s3d_io::dataset::{FileRecord, Layout};
use s3d_label::LabelTable;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The most units that a message names.
const MAX_NAMED: usize = 4;

/// A plan that was made.
pub(crate) struct Plan {
    layout: Layout,
    file: PlanFile,
    finished: Finished,
}

/// `plan.jsonl`.
#[derive(Serialize, Deserialize)]
pub(crate) struct PlanFile {
    /// What the plan is for, with only the options that labels and scores depend on.
    pub(crate) request: Request,
    pub(crate) labels: LabelList,
}

pub(crate) fn read_plan_file(path: &Path) -> Result<PlanFile> {
    // Without this file, nothing tells what the rest of the folder is for.
    let again = "remove the folder, and call `s3d plan` again";
    read_checked(path).map_err(|e| match e {
        Error::File(FileError::Format { .. }) => {
            FileError::format(path, format!("is damaged, or of another version of s3d: {again}")).into()
        }
        other => other,
    })
}

pub(crate) fn area_folder(folder: &Path, area: u32) -> PathBuf {
    folder.join(format!("area_{area}"))
}

impl Plan {
    /// Opens the plan in a folder.
    ///
    /// # Errors
    /// If the folder holds no plan, or a damaged one.
    pub(crate) fn open(ctx: &Context, folder: &Path) -> Result<Self> {
        let path = plan_file(folder);
        if !is_plan(folder) {
            return Err(FileError::format(folder, "holds no plan: make one with `s3d plan`").into());
        }
        let file = read_plan_file(&path)?;
        let layout = Layout::new(folder);
        let finished = Finished::read(ctx, &layout)?;
        Ok(Self { layout, file, finished })
    }

    /// The label table.
    pub(crate) fn table(&self) -> Result<LabelTable> {
        self.file.labels.table(&plan_file(self.layout.root()))
    }

    /// The request that the plan was made for.
    pub(crate) fn request(&self) -> &Request {
        &self.file.request
    }

    /// Refuses an export that the plan was not made for.
    pub(crate) fn refuse_other(&self, request: &Request) -> Result<()> {
        refuse_other(self.layout.root(), &self.file.request, request)
    }

    /// Refuses a plan that is not complete.
    pub(crate) fn require_complete(&self) -> Result<()> {
        let mut missing = Vec::new();
        for area in self.file.request.numbers() {
            let labels = self.finished.labels(area);
            match labels.filter(|_| LabelledArea::is_in(&area_folder(self.layout.root(), area))) {
                Some(labels) => {
                    missing.extend(labels.locations.iter().map(|uuid| Unit::Scores(area, uuid.clone())));
                }
                None => missing.push(Unit::Labels(area)),
            }
        }

        missing.retain(|unit| matches!(unit, Unit::Labels(_)) || !self.finished.has(unit));
        if missing.is_empty() {
            return Ok(());
        }

        let named: Vec<String> = missing.iter().take(MAX_NAMED).map(Unit::to_string).collect();
        let more = if missing.len() > MAX_NAMED { " and more" } else { "" };
        let root = self.layout.root().display();

        Err(InputError::Incomplete {
            what: format!("{root} is not complete: {}{more} missing", named.join(", ")),
            remedy: "call `s3d plan` again, each shard of it if it has some".to_owned(),
        }
        .into())
    }

    /// Reads a labelled area.
    pub(crate) fn area(&self, area: u32) -> Result<LabelledArea> {
        let taxonomy = self.file.labels.taxonomy(&plan_file(self.layout.root()))?;
        taxonomy.reading(|| LabelledArea::read(&area_folder(self.layout.root(), area), area))
    }

    /// Brings the label files of an area into a data set. Returns their records.
    pub(crate) fn bring_labels(&self, area: u32, to: &Layout) -> Result<Vec<FileRecord>> {
        let files = self
            .finished
            .labels(area)
            .map_or(Vec::new(), |labels| labels.files.clone());
        for record in &files {
            if let Some(fault) = bring(record, self.layout.root(), to.root())? {
                let what = format!("{}/{fault}", self.layout.root().display());
                let remedy = "call `s3d plan` again, and it is made anew".to_owned();
                return Err(InputError::Incomplete { what, remedy }.into());
            }
        }
        Ok(files)
    }

    /// The scores of a location.
    pub(crate) fn scores(&self, area: u32, uuid: &str) -> Result<Done> {
        let done = self.finished.get(&Unit::Scores(area, uuid.to_owned()));
        done.cloned().ok_or_else(|| {
            let root = self.layout.root().display();
            InputError::Incomplete {
                what: format!("{root}: the scores of location {uuid} of area {area} are missing"),
                remedy: "call `s3d plan` again".to_owned(),
            }
            .into()
        })
    }
}

pub(crate) fn refuse_other(folder: &Path, there: &Request, now: &Request) -> Result<()> {
    let differences = there.differences(&now.of_plan());
    if differences.is_empty() {
        return Ok(());
    }
    Err(UsageError::OtherCall { folder: folder.to_owned(), held: Held::Plan, differences }.into())
}
