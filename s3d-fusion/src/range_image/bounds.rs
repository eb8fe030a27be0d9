//! The box of what an image measured.

use super::{Directions, RangeImage};
use s3d_geom::glam::{DVec3, dvec2};

impl RangeImage {
    /// Returns the corners of the smallest box along the axes of the world that holds all points that were measured,
    /// metres; `None` if nothing was.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let world_from_opencv = self.pose.opencv_from_world().transpose();
        let width = self.width() as usize;
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (i, range) in self
            .ranges
            .pixels()
            .iter()
            .enumerate()
            .filter(|(_, range)| range.is_finite())
        {
            let [x, y] = [i % width, i / width];
            let ray = match &self.directions {
                Directions::Lens(lens) => {
                    lens.direction(dvec2(x as f64 + 0.5, y as f64 + 0.5)).map(|d| d / d.z)
                }
                Directions::Angles(grid) => Some(grid.direction([x as u32, y as u32])),
            };
            let Some(ray) = ray else { continue };
            let point = self.pose.location + world_from_opencv * (ray * f64::from(*range));
            (min, max) = (min.min(point), max.max(point));
        }
        (min.x <= max.x).then_some([min, max])
    }
}
