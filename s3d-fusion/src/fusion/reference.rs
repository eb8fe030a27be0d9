//! The plain form of fusion: every voxel of a box, every image. Tests hold the sparse grid to it.

use super::images::Adding;
use super::view::View;
use super::{Fusion, FusionOptions};
use crate::grid::block::{Block, Voxel};
use crate::grid::{Place, VOXELS};
use crate::{RangeImage, RangeKind, SensorNoise};
use s3d_geom::glam::{DVec3, dvec2, dvec3};
use s3d_geom::{Lens, PhotoLens, Pose, Raster};
use std::collections::BTreeMap;

/// All blocks of a box after all images.
fn dense(images: &[RangeImage], fusion: &Fusion, from: Place, to: Place) -> BTreeMap<Place, Block> {
    let mut blocks = BTreeMap::new();
    for z in from[2]..to[2] {
        for y in from[1]..to[1] {
            for x in from[0]..to[0] {
                blocks.insert([x, y, z], Block::default());
            }
        }
    }
    for (number, image) in images.iter().enumerate() {
        let adding = Adding { image, scale: fusion.scale, tile: None, number: number as u32 };
        let (view, surfels) = (View::new(image), image.surfels(fusion.scale.cell as f32));
        for (place, block) in &mut blocks {
            adding.update(&view, &surfels, *place, block);
        }
    }
    blocks
}

/// Depth pictures of a ball before a slanted wall.
fn images(count: u32) -> Vec<RangeImage> {
    let (width, height) = (96, 80);
    let center = dvec2(48.0, 40.0);
    let lens = PhotoLens::Straight(Lens::new([width, height], dvec2(70.0, 70.0), center, [0.0; 5]).unwrap());
    let (ball, radius) = (dvec3(0.1, 1.2, 0.0), 0.3);
    let normal = dvec3(0.3, -1.0, 0.1).normalize();
    let picture = |k: u32| {
        let eye = dvec3(0.5 * f64::from(k) - 0.6, -0.2, 0.2 * f64::from(k));
        let pose = Pose::look_at(eye, dvec3(0.0, 1.3, 0.0), DVec3::Z).unwrap();
        let turn = pose.opencv_from_world().transpose();
        let depth = (0..width * height).map(|i| {
            let pixel = dvec2(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let ray = turn * lens.direction(pixel).unwrap();
            let o = eye - ball;
            let (a, b, c) = (ray.length_squared(), o.dot(ray), o.length_squared() - radius * radius);
            let hit = (-b - (b * b - a * c).sqrt()) / a;
            let wall = (DVec3::Y * 1.8 - eye).dot(normal) / ray.dot(normal);
            if hit.is_nan() { wall as f32 } else { hit as f32 }
        });
        let depth = Raster::from_vec(width, height, depth.collect());
        RangeImage::from_depth(pose, lens, RangeKind::Depth, depth, SensorNoise::LASER).unwrap()
    };
    (0..count).map(picture).collect()
}

#[test]
fn the_sparse_grid_is_the_dense_one() {
    let images = images(3);
    let mut fusion = Fusion::new(FusionOptions { cell_m: 0.03, ..FusionOptions::default() }).unwrap();
    images.iter().for_each(|image| fusion.add(image).unwrap());
    let blocks = dense(&images, &fusion, [-8, -2, -8], [9, 11, 9]);

    let mut crossings = 0;
    for (place, plain) in &blocks {
        let sparse = fusion.grid.block(*place);
        for i in 0..VOXELS {
            let expected = plain.voxel(i, 0);
            match sparse {
                // Blocks are made when a ray comes near: what earlier images saw of them from afar is not
                // kept.
                Some((block, free)) => match (block.voxel(i, free), expected) {
                    (Voxel::Distance { distance: a, .. }, Voxel::Distance { distance: b, .. }) => {
                        assert!((a - b).abs() < 0.2, "{place:?} {i}: {a} {b}");
                        crossings += usize::from(a == b);
                    }
                    (Voxel::Unknown, Voxel::Distance { distance: d, .. }) => {
                        assert!(d.abs() > 0.4, "{place:?} {i}: {d}")
                    }
                    (_, _) => {}
                },
                None => assert!(
                    !matches!(expected, Voxel::Distance { distance: d, .. } if d.abs() < 0.1),
                    "{place:?} {i}"
                ),
            }
        }
    }
    assert!(crossings > 20_000, "{crossings}");
}

#[test]
fn images_that_are_prepared_ahead_make_the_same_grid() {
    let images = images(3);
    let options = FusionOptions { cell_m: 0.03, ..FusionOptions::default() };
    let mut plain = Fusion::new(options.clone()).unwrap();
    images.iter().for_each(|image| plain.add(image).unwrap());

    let mut ahead = Fusion::new(options.clone()).unwrap();
    let other = Fusion::new(FusionOptions { cell_m: 0.05, ..options }).unwrap();
    let preparers = [ahead.preparer(), ahead.preparer(), other.preparer()];
    let prepared: Vec<_> = images.into_iter().zip(preparers).map(|(i, by)| by.prepare(i)).collect();
    prepared.iter().for_each(|image| ahead.add_prepared(image).unwrap());

    assert_eq!(plain.surface(), ahead.surface());
    assert!(plain.fits(plain.bytes()) && !plain.fits(plain.bytes() - 1));
}
