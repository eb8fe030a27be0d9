//! Analytic scenes, and sensors that see them by exact rays.

use s3d_fusion::{FusedMesh, Fusion, FusionOptions, RangeImage, RangeKind, SensorNoise};
use s3d_geom::glam::{DMat3, DVec3, Vec3, dvec2, dvec3};
use s3d_geom::{Lens, PhotoLens, Pose, Raster};

/// A body or a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// The half space below a plane through a point, with its normal.
    Plane(DVec3, DVec3),
    /// A box by its middle, half size and rotation.
    Cuboid(DVec3, DVec3, DMat3),
    Sphere(DVec3, f64),
}

impl Shape {
    pub(crate) fn cuboid(low: DVec3, high: DVec3) -> Self {
        Self::Cuboid((low + high) * 0.5, (high - low) * 0.5, DMat3::IDENTITY)
    }

    /// The multiple of the ray at the first hit.
    fn hit(&self, origin: DVec3, ray: DVec3) -> Option<f64> {
        match *self {
            Self::Plane(at, normal) => {
                let along = ray.dot(normal);
                Some((at - origin).dot(normal) / along).filter(|t| along < 0.0 && *t > 0.0)
            }
            Self::Cuboid(middle, half, turn) => {
                let (o, r) = (turn.transpose() * (origin - middle), turn.transpose() * ray);
                let (a, b) = ((-half - o) / r, (half - o) / r);
                let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
                (near <= far && near > 0.0).then_some(near)
            }
            Self::Sphere(middle, radius) => {
                let o = origin - middle;
                let (a, b, c) = (ray.length_squared(), o.dot(ray), o.length_squared() - radius * radius);
                let root = b * b - a * c;
                Some((-b - root.sqrt()) / a).filter(|t| root >= 0.0 && *t > 0.0)
            }
        }
    }

    /// The signed distance of a point, negative inside.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Self::Plane(at, normal) => (p - at).dot(normal),
            Self::Cuboid(middle, half, turn) => {
                let q = (turn.transpose() * (p - middle)).abs() - half;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Sphere(middle, radius) => p.distance(middle) - radius,
        }
    }
}

/// The walls, floor and ceiling of a cube about the origin.
pub(crate) fn room(half: f64) -> Vec<Shape> {
    let walls = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    walls.map(|w| Shape::Plane(w * half, -w)).to_vec()
}

/// The distance of a point to the surface of several shapes.
pub(crate) fn distance(shapes: &[Shape], p: Vec3) -> f64 {
    shapes
        .iter()
        .map(|s| s.distance(p.as_dvec3()))
        .fold(f64::INFINITY, f64::min)
        .abs()
}

pub(crate) fn first_hit(shapes: &[Shape], origin: DVec3, ray: DVec3) -> f64 {
    shapes
        .iter()
        .filter_map(|s| s.hit(origin, ray))
        .fold(f64::NAN, f64::min)
}

pub(crate) fn lens(width: u32, height: u32, focal: f64) -> PhotoLens {
    let center = dvec2(f64::from(width), f64::from(height)) * 0.5;
    PhotoLens::Straight(Lens::new([width, height], dvec2(focal, focal), center, [0.0; 5]).unwrap())
}

/// What a depth camera sees, without noise.
pub(crate) fn picture(shapes: &[Shape], pose: Pose, lens: PhotoLens) -> RangeImage {
    let [width, height] = lens.size();
    let turn = pose.opencv_from_world().transpose();
    let depth = |i: u32| {
        let pixel = dvec2(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        let ray = lens.direction(pixel).unwrap();
        first_hit(shapes, pose.location, turn * (ray / ray.z)) as f32
    };
    let depth = Raster::from_vec(width, height, (0..width * height).map(depth).collect());
    RangeImage::from_depth(pose, lens, RangeKind::Depth, depth, SensorNoise::LASER).unwrap()
}

pub(crate) fn look(eye: DVec3, target: DVec3) -> Pose {
    let up = if (target - eye).truncate().length() > 1e-6 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    Pose::look_at(eye, target, up).unwrap()
}

/// Eyes on a circle that look at a point.
pub(crate) fn circle(target: DVec3, radius: f64, height: f64, count: u32) -> Vec<Pose> {
    (0..count)
        .map(|i| {
            let (y, x) = (std::f64::consts::TAU * f64::from(i) / f64::from(count) + 0.3).sin_cos();
            look(target + dvec3(radius * x, radius * y, height), target)
        })
        .collect()
}

pub(crate) fn fusion(cell_m: f64) -> Fusion {
    Fusion::new(FusionOptions { cell_m, ..FusionOptions::default() }).unwrap()
}

/// The mesh of what cameras see of shapes.
pub(crate) fn fused(shapes: &[Shape], poses: &[Pose], lens: PhotoLens, cell_m: f64) -> FusedMesh {
    let mut fusion = fusion(cell_m);
    poses
        .iter()
        .for_each(|pose| fusion.add(&picture(shapes, *pose, lens)).unwrap());
    fusion.mesh().unwrap()
}

/// The mean and the largest distance of vertices from the surface of shapes.
pub(crate) fn errors(shapes: &[Shape], mesh: &FusedMesh) -> [f64; 2] {
    let all = mesh.positions.iter().map(|p| distance(shapes, *p));
    let sum: f64 = all.clone().sum();
    [sum / mesh.positions.len() as f64, all.fold(0.0, f64::max)]
}
