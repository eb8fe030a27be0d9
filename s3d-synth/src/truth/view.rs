//! What a device could see from where it was.

use crate::building::ScanLocation;
use crate::device::{DepthCamera, LaserScanner};
use s3d_geom::glam::Vec3;
use s3d_geom::{Lens, Pose};

/// The field of view of a device, its range and the least angle at which it measures.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where the device was: world metres.
    pub origin: Vec3,
    /// The field of view.
    pub field: Field,
    /// The smallest and the largest range, metres: along the optical axis for pictures, else along the ray.
    pub range_m: [f32; 2],
    /// The least cosine between a ray and the normal of a surface that it measures.
    pub least_cosine: f32,
}

/// The directions that a device sees.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// All azimuths, and the elevations between the sines of the lowest and the highest.
    Around([f32; 2]),
    /// What a camera sees.
    Picture(Pose, Lens),
}

/// The least cosine at which a laser scanner still measures a surface well.
const GLANCING_COSINE: f32 = 0.1;

impl View {
    /// Returns what a laser scanner can see from a location. Surfaces that it meets at less than 6° count as
    /// not seen.
    pub fn of_laser(location: &ScanLocation, scanner: &LaserScanner) -> Self {
        let sines = scanner.elevation_rad.map(|elevation| libm::sin(elevation) as f32);
        Self {
            origin: location.position.as_vec3(),
            field: Field::Around(sines),
            range_m: scanner.range_m,
            least_cosine: GLANCING_COSINE,
        }
    }

    /// Returns what a depth camera can see from a pose.
    pub fn of_camera(pose: &Pose, camera: &DepthCamera) -> Self {
        Self {
            origin: pose.location.as_vec3(),
            field: Field::Picture(*pose, camera.lens),
            range_m: camera.range_m,
            least_cosine: camera.least_cosine,
        }
    }

    /// Whether a place of a surface is in the field of view, within the range, and not too aslant. Surfaces
    /// are seen from their fronts alone.
    pub(super) fn may_see(&self, place: Vec3, normal: Vec3) -> bool {
        let way = place - self.origin;
        let length = way.length();
        let [nearest, farthest] = self.range_m;
        // No range along a ray is shorter than the one along the axis.
        if length < nearest || -normal.dot(way) < self.least_cosine * length {
            return false;
        }
        match &self.field {
            Field::Around([low, high]) => {
                length <= farthest && (low * length..=high * length).contains(&way.z)
            }
            Field::Picture(pose, lens) => {
                let seen = pose.opencv_from_world() * (place.as_dvec3() - pose.location);
                let is_in_range = (f64::from(nearest)..=f64::from(farthest)).contains(&seen.z);
                let [width, height] = [lens.width(), lens.height()].map(f64::from);
                let pixel = is_in_range.then(|| lens.project(seen)).flatten();
                pixel.is_some_and(|p| (0.0..width).contains(&p.x) && (0.0..height).contains(&p.y))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DVec3, vec3};

    #[test]
    fn a_laser_sees_all_around_but_its_tripod() {
        let location = ScanLocation { uuid: String::new(), position: DVec3::ZERO, yaw_rad: 0.0 };
        let view = View::of_laser(&location, &LaserScanner::default());
        assert!(view.may_see(vec3(3.0, 0.0, 0.0), Vec3::NEG_X) && view.may_see(Vec3::Z, Vec3::NEG_Z));
        // Behind its surface, too near, under the tripod, too aslant.
        assert!(!view.may_see(vec3(3.0, 0.0, 0.0), Vec3::X));
        assert!(!view.may_see(vec3(0.5, 0.0, 0.0), Vec3::NEG_X));
        assert!(!view.may_see(vec3(0.5, 0.0, -1.0), Vec3::Z));
        assert!(!view.may_see(vec3(20.0, 0.0, -1.5), Vec3::Z));
    }

    #[test]
    fn a_camera_sees_its_picture() {
        let view = View::of_camera(&Pose::level(DVec3::ZERO, 0.0), &DepthCamera::default());
        assert!(view.may_see(vec3(0.0, 3.0, 0.0), Vec3::NEG_Y));
        assert!(
            view.may_see(vec3(1.8, 3.0, 1.3), Vec3::NEG_Y) && !view.may_see(vec3(1.9, 3.0, 0.0), Vec3::NEG_Y)
        );
        assert!(
            !view.may_see(vec3(0.0, 4.1, 0.0), Vec3::NEG_Y) && !view.may_see(vec3(0.0, -3.0, 0.0), Vec3::Y)
        );
    }
}
