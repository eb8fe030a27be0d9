//! What an image measured, in the world.

use super::{Directions, RangeImage};
use s3d_geom::Pose;
use s3d_geom::glam::{DAffine3, DVec3, Vec3, dvec2};
use std::num::NonZeroU32;

impl RangeImage {
    /// Returns the corners of the smallest box along the axes of the world that holds all points that were
    /// measured, metres; `None` if nothing was.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (i, range) in self
            .ranges
            .pixels()
            .iter()
            .enumerate()
            .filter(|(_, range)| range.is_finite())
        {
            let Some(point) = self.point(i, *range) else { continue };
            (min, max) = (min.min(point), max.max(point));
        }
        (min.x <= max.x).then_some([min, max])
    }

    /// Returns the points of the pixels that lie on a surface, with its unit normals towards the sensor:
    /// world metres. `cell_m` is the size of what can be told apart later. Of rows and columns, each
    /// `every`-th is taken.
    pub fn surface_points(&self, cell_m: f32, every: NonZeroU32) -> (Vec<Vec3>, Vec<Vec3>) {
        let world_from_sensor = self.pose.opencv_from_world().transpose();
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        let (width, every) = (self.width() as usize, every.get() as usize);
        let surfels = self.surfels(cell_m);
        let taken = surfels.iter().enumerate().filter(|(i, surfel)| {
            surfel.weight > 0.0 && (i % width).is_multiple_of(every) && (i / width).is_multiple_of(every)
        });
        for (i, surfel) in taken {
            let Some(point) = self.point(i, surfel.range) else { continue };
            let ray = point - self.pose.location;
            let normal = (world_from_sensor * surfel.normal.as_dvec3()).normalize_or_zero();
            points.push(point.as_vec3());
            normals.push(if normal.dot(ray) > 0.0 { -normal } else { normal }.as_vec3());
        }
        (points, normals)
    }

    /// Returns the image as if the sensor had stood elsewhere: `motion`, which is rigid, leads from the world
    /// to the world.
    pub fn moved(self, motion: &DAffine3) -> Self {
        let location = motion.transform_point3(self.pose.location);
        let pose = Pose { location, world_from_camera: motion.matrix3 * self.pose.world_from_camera };
        Self { pose, ..self }
    }

    /// The place of a pixel at a range.
    fn point(&self, pixel: usize, range: f32) -> Option<DVec3> {
        let width = self.width() as usize;
        let [x, y] = [pixel % width, pixel / width];
        let ray = match &self.directions {
            Directions::Lens(lens) => lens.direction(dvec2(x as f64 + 0.5, y as f64 + 0.5)).map(|d| d / d.z),
            Directions::Angles(grid) => Some(grid.direction([x as u32, y as u32])),
        };
        let world_from_sensor = self.pose.opencv_from_world().transpose();
        ray.map(|ray| self.pose.location + world_from_sensor * (ray * f64::from(range)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RangeKind, SensorNoise};
    use s3d_geom::{Lens, PhotoLens, Raster};

    #[test]
    fn a_wall_is_where_it_was_measured_and_moves_with_the_sensor() {
        let lens = Lens::new([40, 30], dvec2(30.0, 30.0), dvec2(20.0, 15.0), [0.0; 5]).unwrap();
        let pose = Pose::level(DVec3::new(1.0, 2.0, 1.5), 0.0);
        let depth = Raster::filled(40, 30, 3.0);
        let noise = SensorNoise::LASER;
        let wall =
            RangeImage::from_depth(pose, PhotoLens::Straight(lens), RangeKind::Depth, depth, noise).unwrap();

        let [min, max] = wall.bounds().unwrap();
        assert!(min.abs_diff_eq(DVec3::new(-0.95, 5.0, 0.05), 1e-5), "{min}");
        assert!(max.abs_diff_eq(DVec3::new(2.95, 5.0, 2.95), 1e-5), "{max}");
        let (points, normals) = wall.surface_points(0.01, NonZeroU32::MIN);
        assert!(points.len() > 1000 && points.iter().all(|p| (p.y - 5.0).abs() < 1e-5));
        assert!(normals.iter().all(|n| n.abs_diff_eq(-Vec3::Y, 1e-4)));

        let turn = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let [min, max] = wall.moved(&turn).bounds().unwrap();
        assert!((min.x + 5.0).abs() < 1e-5 && (max.x + 5.0).abs() < 1e-5, "{min} {max}");
    }
}
