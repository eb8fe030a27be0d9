//! A trained detector, and its file.

use crate::area::CLASSES;
use crate::boxes::iou;
use crate::context::ContextWeights;
use crate::error::{Error, Result};
use crate::features::{FEATURES, Variant};
use crate::learn::{Machines, elements, learn, overlap, score};
use crate::proposals::windows::WINDOW_FEATURES;
use crate::proposals::{Prepared, Proposal, Proposer};
use crate::spaces::space::{Space, SpaceSource};
use crate::svm::Linear;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use s3d_dataset::Context;
use s3d_geom::Aabb;
use s3d_io::Error as FileError;
use s3d_io::fs::{read_json, write_json};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The `format` of the file.
const FORMAT: &str = "s3d detector";
/// The version of the file, and of the features that its weights are for.
const VERSION: u32 = 2;

/// How a detector is trained.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainOptions {
    /// The source of everything random.
    pub seed: u64,
    /// The kind of spaces to search.
    pub spaces: SpaceSource,
    /// The machines to train.
    pub variants: Vec<Variant>,
    /// The most spaces to learn from, drawn at random. Time and memory grow with it.
    pub most_spaces: usize,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self { seed: 0, spaces: SpaceSource::default(), variants: vec![Variant::Full], most_spaces: 100 }
    }
}

/// A trained detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    format: String,
    version: u32,
    /// The seed that it was trained with.
    pub seed: u64,
    /// The kind of spaces to search.
    pub spaces: SpaceSource,
    /// The areas that it was trained on.
    pub areas: Vec<u32>,
    /// Proposes boxes.
    pub proposer: Proposer,
    /// Score the boxes: an entry for each variant.
    pub machines: Vec<Machines>,
}

/// An element that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The index of its class in [`CLASSES`].
    pub class: usize,
    /// Its box in the frame of the space, in metres.
    pub bbox: Aabb,
    /// The score by the machine of its class.
    pub score: f64,
    /// Its score in context: its gain, given the other boxes.
    pub in_context: f64,
}

impl Model {
    /// Trains on annotated spaces, on all threads of the current rayon pool. The same spaces and options give
    /// the same model for any number of threads.
    ///
    /// # Errors
    /// [`Error::NoElements`] if no space has an element. [`Error::Dataset`] if the call is cancelled.
    pub fn train(spaces: &[&Space], options: &TrainOptions, ctx: &Context) -> Result<Self> {
        let mut areas: Vec<u32> = spaces.iter().map(|s| s.area).collect();
        areas.dedup();
        let mut some: Vec<usize> = (0..spaces.len()).filter(|&i| !spaces[i].elements.is_empty()).collect();
        if some.is_empty() {
            return Err(Error::NoElements { areas });
        }

        some.shuffle(&mut ChaCha8Rng::seed_from_u64(options.seed));
        some.truncate(options.most_spaces.max(1));
        some.sort_unstable();
        let prepared: Vec<Prepared<'_>> = some.par_iter().map(|&i| Prepared::new(spaces[i])).collect();

        let proposer = Proposer::train(&prepared, options.seed, ctx)?;
        let progress = ctx.progress("proposing", "spaces", prepared.len() as u64);
        let proposals = prepared.par_iter().map(|space| {
            ctx.check()?;
            let found = proposer.propose(space);
            progress.add(1);
            Ok(found.into_iter().map(|p| (p, overlap(space, &p))).collect())
        });
        let proposals: Vec<Vec<(Proposal, f64)>> = proposals.collect::<Result<_>>()?;

        let machines = learn(&prepared, &proposals, &options.variants, options.seed, ctx)?;
        Ok(Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            seed: options.seed,
            spaces: options.spaces,
            areas,
            proposer,
            machines,
        })
    }

    /// Writes the model as JSON.
    ///
    /// # Errors
    /// [`Error::Dataset`] if the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_json(path, self)?;
        Ok(())
    }

    /// Reads a model, and checks that this version can use it.
    ///
    /// # Errors
    /// [`Error::Dataset`] if the file is missing, is no model or one of another version, or holds values that
    /// no model has.
    pub fn load(path: &Path) -> Result<Self> {
        let value: serde_json::Value = read_json(path)?;
        let fault = |what: String| Error::from(FileError::format(path, what));
        if value["format"] != FORMAT {
            return Err(fault(format!("is no model: \"format\" is not \"{FORMAT}\"")));
        }
        if value["version"] != VERSION {
            let version = &value["version"];
            return Err(fault(format!(
                "is a model of version {version}, and this is for {VERSION}: train it again"
            )));
        }
        let model: Self = serde_json::from_value(value).map_err(|e| fault(e.to_string()))?;
        match model.fault() {
            Some(what) => Err(fault(what)),
            None => Ok(model),
        }
    }

    /// Returns the first fault of a model that was read.
    fn fault(&self) -> Option<String> {
        if self.machines.is_empty() {
            return Some("no machines".to_owned());
        }
        self.fault_of_windows()
            .or_else(|| self.machines.iter().find_map(fault_of_machines))
    }

    fn fault_of_windows(&self) -> Option<String> {
        for size in &self.proposer.sizes {
            let sizes = size.size_m.iter().chain(&size.bottom_m);
            if size.class >= CLASSES.len() || sizes.clone().any(|m| !m.is_finite() || m.abs() > 1e4) {
                return Some(format!("a window of class {} and {:?} m", size.class, size.size_m));
            }
            if !fits(&size.machine, WINDOW_FEATURES) {
                return Some(format!("a window's machine has not {WINDOW_FEATURES} finite weights"));
            }
        }
        None
    }

    /// Finds the elements of a space among proposals of [`Proposer::propose`]: a list for each entry of
    /// [`Model::machines`].
    pub fn detect(&self, prepared: &Prepared<'_>, proposals: &[Proposal]) -> Vec<Vec<Detection>> {
        let machines: Vec<&[Option<Linear>]> = self.machines.iter().map(|m| &*m.classes).collect();
        let scores = score(prepared, proposals, &machines);
        let found = self.machines.iter().zip(&scores).map(|(machines, scores)| {
            let nodes = elements(proposals, scores);
            let (_, gains) = machines.context.infer(&nodes);
            nodes
                .iter()
                .zip(gains)
                .map(|(n, in_context)| Detection { class: n.class, bbox: n.bbox, score: n.score, in_context })
                .collect()
        });
        found.collect()
    }
}

/// Returns the fault of the machines of one variant.
fn fault_of_machines(machines: &Machines) -> Option<String> {
    let name = machines.variant.name();
    let count = machines.classes.len();
    if count != CLASSES.len() {
        return Some(format!("{name}: {count} machines for {} classes", CLASSES.len()));
    }
    if !machines.classes.iter().flatten().all(|m| fits(m, FEATURES)) {
        return Some(format!("{name}: a machine has not {FEATURES} finite weights"));
    }

    let context = &machines.context;
    let plain = ContextWeights::default();
    let has_all = context.unary.len() == plain.unary.len() && context.pairwise.len() == plain.pairwise.len();
    let mut weights = context.unary.iter().flatten().chain(&context.pairwise);
    if !has_all || weights.any(|w| !w.is_finite()) {
        let count = plain.pairwise.len();
        return Some(format!("{name}: the context has other weights than {count} finite ones"));
    }
    None
}

/// Whether a machine has this number of weights, all finite.
fn fits(machine: &Linear, count: usize) -> bool {
    let Linear { weights, bias } = machine;
    weights.len() == count && bias.is_finite() && weights.iter().all(|w| w.is_finite())
}

/// Returns how many elements of a class a proposal of the class overlaps by more than `threshold`, and how
/// many there are.
pub fn recalled(prepared: &Prepared<'_>, proposals: &[Proposal], class: usize, threshold: f64) -> [usize; 2] {
    let of_class = || proposals.iter().filter(|p| p.class == class);
    let found = prepared
        .truth(class)
        .filter(|b| of_class().any(|p| iou(b, &p.bbox) > threshold))
        .count();
    [found, prepared.truth(class).count()]
}
