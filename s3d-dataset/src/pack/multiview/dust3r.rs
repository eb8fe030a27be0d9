//! `s3d pack --to dust3r`: what the ScanNet++ loaders of DUSt3R and MUSt3R read.

use super::{QUALITY, View, depth_mm, overlaps, require, views_of, write_each};
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::pack::destination::Destination;
use crate::pack::options::PackageKind;
use crate::pack::source::Source;
use s3d_io::dataset::Domain;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, encode_gray16, encode_jpeg};
use s3d_io::package::{Dust3rImage, Dust3rScene, write_dust3r};

/// Writes a scene for each area. Returns notes on how to use them.
pub(in crate::pack) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
) -> Result<Vec<String>> {
    require(source, PackageKind::Dust3r)?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut scenes = Vec::new();
    for &area in &source.areas {
        let views = views_of(source, area)?;
        let pairs: Vec<(usize, usize, f32)> = both_ways(&overlaps(ctx, source, area, &views)?);
        if pairs.is_empty() {
            ctx.warn(format_args!("area {area} has no pair of views that see the same: it is left out"));
            continue;
        }

        let name = format!("area_{area}");
        let folder = destination.path().join(&name);
        for below in ["images", "depth"] {
            create_dir(&folder.join(below))?;
        }
        let images = write_each(ctx, &views, &progress, |view| {
            let stem = view.image.stem();
            let color = source.rgb8(view.image, Domain::Rgb)?;
            write_bytes(&folder.join(format!("images/{stem}.jpg")), &encode_jpeg(&color, QUALITY))?;
            let depth = encode_gray16(&depth_mm(source, view)?, Compression::default());
            write_bytes(&folder.join(format!("depth/{stem}.png")), &depth)?;
            Ok(image(view, stem))
        })?;
        scenes.push(Dust3rScene { name, images, pairs });
    }

    if scenes.is_empty() {
        let what = "pairs of views".to_owned();
        return Err(InputError::NothingToPack { dataset: source.data.layout.root().to_owned(), what }.into());
    }
    write_dust3r(&destination.path().join("all_metadata.npz"), &scenes)?;
    Ok(vec![
        "dust3r.datasets.scannetpp.ScanNetpp(split='train', ROOT=FOLDER, resolution=224) reads it; a scene \
         is an area"
            .to_owned(),
        "depth is in millimetres, 0 where missing; the centre of the first pixel is (0, 0)".to_owned(),
    ])
}

/// Returns each pair once, with the smaller share of both directions. A direction that was left out counts as
/// 0 and leaves out the pair.
fn both_ways(overlaps: &[(usize, usize, f32)]) -> Vec<(usize, usize, f32)> {
    let mut pairs = Vec::new();
    for &(a, b, share) in overlaps.iter().filter(|(a, b, _)| a < b) {
        let back = overlaps.binary_search_by_key(&(b, a), |(from, to, _)| (*from, *to));
        if let Ok(back) = back {
            pairs.push((a, b, share.min(overlaps[back].2)));
        }
    }
    pairs
}

/// Returns what the archive holds of a view.
fn image(view: &View<'_>, name: String) -> Dust3rImage {
    let (intrinsics, world_from_camera) = (view.k_from_pixel_centres(), view.world_from_camera());
    Dust3rImage { name, intrinsics, world_from_camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_counts_once_with_its_smaller_share() {
        let overlaps = [(0, 1, 0.5), (0, 2, 0.3), (1, 0, 0.25), (1, 2, 0.4), (2, 1, 0.75)];
        assert_eq!(both_ways(&overlaps), [(0, 1, 0.25), (1, 2, 0.4)]);
    }
}
