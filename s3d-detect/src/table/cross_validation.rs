//! Trains and tests over the folds of the paper.

use crate::area::CLASSES;
use crate::error::{Error, Result};
use crate::features::{FEATURES, Variant, describe};
use crate::learn::{elements, random_scores};
use crate::model::{Detection, Model, TrainOptions, recalled};
use crate::proposals::Prepared;
use crate::spaces::parsed_area::ParsedArea;
use crate::spaces::space::Space;
use crate::svm::sparse::SparseRows;
use crate::table::precision::{Scored, average_precision};
use crate::table::{Row, Table};
use rayon::prelude::*;
use s3d_dataset::Context;
use s3d_geom::Aabb;
use std::collections::BTreeMap;

/// The rows besides the variants of the model.
const RANDOM: &str = "Random scores";
const NO_CONTEXT: &str = "Full model, no context";
const TRUE_BOXES: &str = "Full model on true boxes";
const RECALL: &str = "Proposals: recall";

/// The thresholds of IoU of the table.
pub const THRESHOLDS: [f64; 2] = [0.5, 0.25];

/// Detections in the world frame, by row and class.
type BoxesByRow = BTreeMap<(String, usize), Vec<Scored>>;

/// Returns the average precision over the folds of the paper, as far as their areas exist. Each number is the
/// mean over folds; a fold whose areas lack a class is left out. All variants are trained, whatever
/// `options.variants` says.
///
/// # Errors
/// [`Error::NoFold`] if the areas make no fold. Otherwise fails like [`Model::train`].
pub fn cross_validate(areas: &[ParsedArea], options: &TrainOptions, ctx: &Context) -> Result<Table> {
    let numbers: Vec<u32> = areas.iter().map(|a| a.number).collect();
    let folds = s3d_sample::folds(&numbers);
    if folds.is_empty() {
        return Err(Error::NoFold { areas: numbers });
    }

    let options = &TrainOptions { variants: Variant::ALL.to_vec(), ..options.clone() };
    let mut table = Table::new(options.seed);
    table.agreement = areas.iter().map(|a| (a.number, a.agreement)).collect();
    for fold in folds {
        let training = areas_of(&fold.train, areas);
        let testing = areas_of(&fold.test, areas);
        let spaces: Vec<&Space> = training.iter().flat_map(|a| &a.spaces).collect();
        ctx.info(format_args!(
            "fold {}: train on areas {:?}, test on {:?}",
            fold.number, fold.train, fold.test
        ));

        let model = Model::train(&spaces, options, ctx)?;
        let rows = test(&model, &testing, ctx)?;
        let told = rows
            .iter()
            .filter_map(|row| Some(format!("{} {:.1}", row.name, row.overall()?)));
        ctx.info(format_args!("fold {}: AP in %: {}", fold.number, told.collect::<Vec<_>>().join(", ")));
        table.rows_of_fold(rows);
    }
    Ok(table)
}

fn areas_of<'a>(wanted: &[u32], areas: &'a [ParsedArea]) -> Vec<&'a ParsedArea> {
    areas.iter().filter(|a| wanted.contains(&a.number)).collect()
}

/// Tests a model on areas. Returns a row for each of its machines and each comparison.
///
/// # Errors
/// [`Error::Dataset`] if the call is cancelled.
pub fn test(model: &Model, areas: &[&ParsedArea], ctx: &Context) -> Result<Vec<Row>> {
    let spaces: Vec<&Space> = areas.iter().flat_map(|a| &a.spaces).collect();
    let progress = ctx.progress("testing", "spaces", spaces.len() as u64);
    let tested = spaces.par_iter().map(|space| {
        ctx.check()?;
        let tested = test_space(model, space);
        progress.add(1);
        Ok(tested)
    });

    let mut found = BoxesByRow::new();
    let mut recalls = vec![[[0usize; 2]; 2]; CLASSES.len()];
    for (of_space, recall) in tested.collect::<Result<Vec<_>>>()? {
        for (key, boxes) in of_space {
            found.entry(key).or_default().extend(boxes);
        }
        for (sum, more) in recalls
            .iter_mut()
            .flatten()
            .flatten()
            .zip(recall.iter().flatten().flatten())
        {
            *sum += more;
        }
    }

    let names = model
        .machines
        .iter()
        .map(|m| m.variant.name())
        .chain([NO_CONTEXT, TRUE_BOXES, RANDOM]);
    let rows = names
        .filter(|name| found.keys().any(|(n, _)| n == name))
        .map(|name| Row {
            name: name.to_owned(),
            ap: THRESHOLDS.map(|threshold| {
                let classes = (0..CLASSES.len()).map(|class| {
                    let elements = areas.iter().flat_map(|a| a.elements.iter().map(|e| (a.number, e)));
                    let truth = elements
                        .filter(|(_, e)| e.class == class)
                        .map(|(a, e)| ((a, e.room), e.bbox));
                    let boxes = found.get(&(name.to_owned(), class)).map_or(&[][..], |f| f);
                    average_precision(boxes, &truth.collect::<Vec<_>>(), threshold)
                });
                classes.collect()
            }),
        });
    let mut rows: Vec<Row> = rows.collect();

    let of = |t: usize| recalls.iter().map(|r| share(r[t])).collect();
    rows.push(Row { name: RECALL.to_owned(), ap: [of(0), of(1)] });
    Ok(rows)
}

fn share([found, all]: [usize; 2]) -> Option<f64> {
    (all > 0).then(|| found as f64 / all as f64)
}

/// Returns the detections in a space by row and class, and the number of elements that its proposals overlap,
/// by class and threshold.
fn test_space(model: &Model, space: &Space) -> (BoxesByRow, Vec<[[usize; 2]; 2]>) {
    let prepared = Prepared::new(space);
    let proposals = model.proposer.propose(&prepared);
    let mut found = BoxesByRow::new();
    let mut put = |name: &str, class: usize, bbox: &Aabb, score: f64| {
        let scored = Scored { scene: (space.area, space.room_of(bbox)), bbox: space.to_world(bbox), score };
        found.entry((name.to_owned(), class)).or_default().push(scored);
    };

    for (machines, detections) in model.machines.iter().zip(model.detect(&prepared, &proposals)) {
        for Detection { class, bbox, score, in_context } in detections {
            put(machines.variant.name(), class, &bbox, in_context);
            if machines.variant == Variant::Full {
                put(NO_CONTEXT, class, &bbox, score);
            }
        }
    }

    let seed = model.seed ^ u64::from(space.area) << 32 ^ u64::from(space.number);
    for node in elements(&proposals, &random_scores(proposals.len(), seed)) {
        put(RANDOM, node.class, &node.bbox, node.score);
    }

    if let Some(full) = model.machines.iter().find(|m| m.variant == Variant::Full) {
        for element in &space.elements {
            let mut row = SparseRows::new(FEATURES);
            row.push(&describe(&space.index, space.frame.extent, &element.bbox));
            for (class, machine) in full.classes.iter().enumerate() {
                if let Some(machine) = machine {
                    put(TRUE_BOXES, class, &element.bbox, machine.score(row.row(0)));
                }
            }
        }
    }

    let recalls = (0..CLASSES.len())
        .map(|class| THRESHOLDS.map(|threshold| recalled(&prepared, &proposals, class, threshold)));
    (found, recalls.collect())
}
