//! `s3d pack --to usd`: each area as a scene of OpenUSD, with a mesh for each object and the views as
//! cameras.

use super::destination::Destination;
use super::multiview::views_of;
use super::source::Source;
use crate::context::Context;
use crate::error::Result;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::package::{UsdCamera, UsdObject, write_usd};
use s3d_label::{LabelId, LabelTable};
use std::collections::BTreeMap;

/// The name of faces without a label.
const UNLABELLED: &str = "unlabelled";

/// Writes `area_N.usda` for each area. Returns notes on how to use them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    // Files of colours tell the size of an image.
    [Domain::Pose, Domain::Rgb]
        .into_iter()
        .try_for_each(|domain| source.require(domain, "OpenUSD"))?;
    let table = source.data.labels()?;
    let progress = ctx.progress("packing", "areas", source.areas.len() as u64);
    for &area in &source.areas {
        ctx.check()?;
        let Some(file) = source.data.mesh(area)? else {
            let message = "there is no mesh: finish the export";
            return Err(FileError::format(&source.data.layout.rgb_obj(area), message).into());
        };
        let labels = match &table {
            Some(_) => source.data.face_votes(area)?.map(|votes| votes.label),
            None => None,
        };
        let labels = labels.unwrap_or_else(|| vec![0; file.mesh.faces().len()]);
        let objects = objects(source, area, table.as_ref(), &labels)?;
        let cameras = views_of(source, area)?.into_iter().map(|view| UsdCamera {
            name: format!("camera_{}_{}_{}", view.image.uuid, view.image.room, view.image.frame),
            size: view.size,
            intrinsics: view.k,
            world_from_camera: view.world_from_camera(),
        });
        let cameras: Vec<UsdCamera> = cameras.collect();
        write_usd(destination.path(), &format!("area_{area}"), &file.mesh, &objects, &cameras)?;
        progress.add(1);
    }
    Ok(vec![
        "an area a file; metres, Z up. Labels are SemanticsLabelsAPI:class and SemanticsLabelsAPI:instance"
            .to_owned(),
    ])
}

/// The objects of an area: a room after the other, and before them the faces without a label.
fn objects(
    source: &Source,
    area: u32,
    table: Option<&LabelTable>,
    label_of_face: &[u32],
) -> Result<Vec<UsdObject>> {
    let mut faces: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (face, label) in (0..).zip(label_of_face) {
        faces.entry(*label).or_default().push(face);
    }
    let object = |(index, faces): (u32, Vec<u32>)| {
        if index == 0 {
            return Ok(UsdObject { name: UNLABELLED.to_owned(), class: None, room: None, faces });
        }
        let id = LabelId(index);
        let Some((table, label)) = table.and_then(|table| Some((table, table.get(id)?))) else {
            let message = format!("there is no label {index}");
            return Err(FileError::format(&source.data.layout.votes_npz(area), message).into());
        };
        let (class, room) = (Some(label.class.to_string()), Some(label.room.to_string()));
        Ok(UsdObject { name: table.name_of(id), class, room, faces })
    };
    let mut objects = faces.into_iter().map(object).collect::<Result<Vec<_>>>()?;
    objects.sort_by(|a, b| a.room.cmp(&b.room));
    Ok(objects)
}
