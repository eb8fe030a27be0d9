//! The rays of pixels, row by row.

use super::{Directions, RangeImage};
use s3d_geom::PhotoLens;
use s3d_geom::glam::{DVec3, dvec2};

/// The rays of the middles of pixels, in OpenCV's axes of the sensor. A ray is as long as one metre of range.
pub(crate) struct Rays<'a> {
    image: &'a RangeImage,
    /// x of the rays of a lens without distortion, or sine and cosine of a column's azimuth.
    columns: Vec<[f64; 2]>,
}

impl RangeImage {
    pub(crate) fn rays(&self) -> Rays<'_> {
        let columns = match &self.directions {
            Directions::Lens(PhotoLens::Straight(lens)) if lens.distortion() == [0.0; 5] => {
                let x = |column| (f64::from(column) + 0.5 - lens.center_px().x) / lens.focal_px().x;
                (0..self.width()).map(|column| [x(column), 0.0]).collect()
            }
            Directions::Lens(_) => Vec::new(),
            Directions::Angles(grid) => grid.column_rays(),
        };
        Rays { image: self, columns }
    }
}

impl Rays<'_> {
    /// Fills x, y and z of the rays of a row; NaN if a pixel has none.
    pub(crate) fn row(&self, row: usize, rays: &mut [Vec<f32>; 3]) {
        let lens = match &self.image.directions {
            Directions::Angles(grid) => {
                let [sin_y, cos_y] = grid.row_ray(row);
                let ray = |[sin_x, cos_x]: &[f64; 2]| DVec3::new(cos_y * sin_x, sin_y, cos_y * cos_x);
                return fill(rays, self.columns.iter().map(ray));
            }
            Directions::Lens(lens) => lens,
        };

        let y = row as f64 + 0.5;
        if self.columns.is_empty() {
            let directions = (0..self.image.width()).map(|x| lens.direction(dvec2(f64::from(x) + 0.5, y)));
            fill(rays, directions.map(|d| d.map_or(DVec3::NAN, |d| d / d.z)));
        } else {
            let y = (y - lens.center_px().y) / lens.focal_px().y;
            let [across, down, ahead] = rays;
            across.clear();
            across.extend(self.columns.iter().map(|[x, _]| *x as f32));
            for (axis, number) in [(down, y as f32), (ahead, 1.0)] {
                axis.clear();
                axis.resize(self.columns.len(), number);
            }
        }
    }
}

fn fill([x, y, z]: &mut [Vec<f32>; 3], rays: impl Iterator<Item = DVec3>) {
    for axis in [&mut *x, y, z] {
        axis.clear();
    }
    for ray in rays {
        x.push(ray.x as f32);
        y.push(ray.y as f32);
        z.push(ray.z as f32);
    }
}
