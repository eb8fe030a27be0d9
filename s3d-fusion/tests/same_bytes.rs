//! The same mesh for any number of threads, and of tiles.

use crate::common::{Shape, circle, lens, picture, room};
use s3d_fusion::{Fusion, FusionOptions, RangeImage, Surface, Tile};
use s3d_geom::Raster;
use s3d_geom::glam::{DVec3, dvec3};

fn images() -> Vec<RangeImage> {
    let mut shapes = room(1.5);
    shapes.push(Shape::Sphere(dvec3(0.1, 0.0, -0.3), 0.4));
    let colored = |image: RangeImage| {
        let colors = (0..120 * 100)
            .map(|i: u32| [(i % 251) as u8, (i / 120) as u8, 90])
            .collect();
        image.with_colors(Raster::from_vec(120, 100, colors)).unwrap()
    };
    circle(DVec3::ZERO, 1.1, 0.4, 5)
        .iter()
        .map(|pose| colored(picture(&shapes, *pose, lens(120, 100, 80.0))))
        .collect()
}

fn options() -> FusionOptions {
    FusionOptions { cell_m: 0.04, ..FusionOptions::default() }
}

#[test]
fn threads_change_nothing() {
    let images = images();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut fusion = Fusion::new(options()).unwrap();
            images.iter().for_each(|image| fusion.add(image).unwrap());
            fusion.mesh().unwrap()
        })
    };
    let one = run(1);
    assert!(one.faces.len() > 10_000 && one.colors.len() == one.positions.len());
    assert_eq!(one, run(3));
}

#[test]
fn tiles_have_no_seam() {
    let images = images();
    let mut whole = Fusion::new(options()).unwrap();
    images.iter().for_each(|image| whole.add(image).unwrap());

    // Blocks are 32 cm: the room reaches from −5 to 5. Tiles meet in its middle.
    let mut tiles = Vec::new();
    for (x0, x1) in [(-9, -2), (-2, 1), (1, 9)] {
        for (y0, y1) in [(0, 9), (-9, 0)] {
            let tile = Tile { from: [x0, y0, -9], to: [x1, y1, 9] };
            let mut part = Fusion::within(options(), tile).unwrap();
            images.iter().for_each(|image| part.add(image).unwrap());
            assert!(part.blocks() < whole.blocks());
            tiles.push(part.surface());
        }
    }
    let joined = Surface::join(tiles).unwrap();
    assert_eq!(joined, whole.surface());
    assert_eq!(joined.into_mesh(0.1).unwrap(), whole.surface().into_mesh(0.1).unwrap());
}
