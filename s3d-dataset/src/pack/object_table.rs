//! `s3d pack --to objects`: a table of the objects of all images.

use super::source::Source;
use crate::context::Context;
use crate::error::Result;
use crate::parallel::map_in_order;
use s3d_io::dataset::{Domain, Frame};
use s3d_io::package::{ObjectRow, ObjectTable};
use std::path::Path;

/// The number of images whose rows are in memory at a time.
const IMAGES: usize = 256;

/// Writes the table to the file `place`.
pub(super) fn pack(ctx: &Context, source: &Source, place: &Path) -> Result<()> {
    source.require(Domain::Objects, "a table of objects")?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut table = ObjectTable::create(place)?;
    for images in source.images.chunks(IMAGES) {
        let rows = map_in_order(
            ctx,
            images,
            || (),
            |(), image| {
                let frame_num = match image.frame {
                    Frame::View(number) => Some(number),
                    Frame::Panorama => None,
                };
                let row = |object| ObjectRow {
                    area: image.area,
                    camera_uuid: image.uuid.clone(),
                    room: image.room.clone(),
                    frame_num,
                    file: image.relative_path(Domain::Objects),
                    object,
                };
                let rows: Vec<ObjectRow> = source.data.objects(image)?.objects.into_iter().map(row).collect();
                progress.add(1);
                Ok(rows)
            },
        )?;
        table.push(&rows.into_iter().flatten().collect::<Vec<_>>())?;
    }
    table.finish()?;
    Ok(())
}
