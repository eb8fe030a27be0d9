//! Colours for the pixels of a depth picture, from the colour picture that was taken at the same time.

use crate::camera::PosedCamera;
use crate::error::{Error, Result};
use crate::raw::depth::{ColorPicture, DepthPicture};
use rayon::prelude::*;
use s3d_geom::glam::{DVec2, DVec3, dvec2};
use s3d_geom::{PhotoLens, Pose, Raster};

/// The most pixels of a colour picture along a side whose mean one depth pixel takes.
const MOST_MEAN: u32 = 8;

impl DepthPicture {
    /// Reads the colour of each pixel: the point that was measured is looked up in the colour picture.
    /// `None`: there is no colour picture. Pixels without a depth, and pixels whose points the colour camera
    /// does not show, are `None`. What hides what is not looked at, since both cameras are at nearly one
    /// place.
    ///
    /// `depth` is what [`read_depth`](Self::read_depth) returns.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the colour picture is damaged or its intrinsics are missing.
    ///
    /// # Panics
    /// If `depth` has another size than the lens.
    pub fn read_colors(&self, depth: &Raster<f32>) -> Result<Option<Raster<Option<[u8; 3]>>>> {
        let [width, height] = self.lens.size();
        assert_eq!([depth.width(), depth.height()], [width, height], "a depth of another size than its lens");
        let Some(color) = &self.color else { return Ok(None) };
        let image = color.picture.read()?;
        let lens = color.lens_for([image.width(), image.height()])?;

        // Pictures that are registered to each other show the same in the same pixels.
        if lens == self.lens && color.pose == self.pose {
            let pairs = depth.pixels().iter().zip(image.pixels());
            let colors = pairs.map(|(depth_m, color)| depth_m.is_finite().then_some(*color));
            return Ok(Some(Raster::from_vec(depth.width(), depth.height(), colors.collect())));
        }

        // A depth pixel covers several pixels of a larger colour picture.
        let ratio = lens.focal_px() / self.lens.focal_px();
        let side = (libm::round(ratio.max_element()) as u32).clamp(1, MOST_MEAN);
        let reach = Reach { image: &image, lens: &lens, pose: &color.pose, side };
        let width = width as usize;
        let colors = depth
            .pixels()
            .par_iter()
            .enumerate()
            .map(|(i, depth_m)| {
                let pixel = dvec2((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let direction = self.lens.direction(pixel)?;
                let point = point_of(&self.pose, direction, f64::from(*depth_m))?;
                reach.color(point)
            })
            .collect();
        Ok(Some(Raster::from_vec(depth.width(), depth.height(), colors)))
    }
}

impl ColorPicture {
    /// Returns the lens of the colour camera, for the size of the picture in its file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the picture cannot be read, or its intrinsics are missing or for
    /// another shape.
    pub fn lens(&self) -> Result<PhotoLens> {
        let (width, height) = self.picture.check()?;
        self.lens_for([width, height])
    }

    fn lens_for(&self, size: [u32; 2]) -> Result<PhotoLens> {
        lens_of(&self.camera, size).map_err(|message| Error::format(&self.picture.path, message))
    }
}

/// Returns the lens of a camera for pictures of this size. The error is a sentence.
fn lens_of(camera: &PosedCamera, size: [u32; 2]) -> std::result::Result<PhotoLens, String> {
    camera.photo_lens(size).map_err(|e| e.to_string())
}

/// Returns the place of a point in the world, from its depth along the optical axis.
fn point_of(pose: &Pose, direction: DVec3, depth_m: f64) -> Option<DVec3> {
    let along = direction * (depth_m / direction.z);
    let opengl = DVec3::new(along.x, -along.y, -along.z);
    along
        .is_finite()
        .then(|| pose.location + pose.world_from_camera * opengl)
}

/// A colour picture, from which points take their colours.
struct Reach<'a> {
    image: &'a Raster<[u8; 3]>,
    lens: &'a PhotoLens,
    pose: &'a Pose,
    /// The side of the square of pixels whose mean a point takes.
    side: u32,
}

impl Reach<'_> {
    fn color(&self, point: DVec3) -> Option<[u8; 3]> {
        let seen = self.pose.world_from_camera.transpose() * (point - self.pose.location);
        let pixel = self.lens.pixel(DVec3::new(seen.x, -seen.y, -seen.z))?;

        let start = pixel - DVec2::splat(0.5 * f64::from(self.side));
        let mut sums = [0u32; 3];
        let mut count = 0;
        for j in 0..self.side {
            for i in 0..self.side {
                let at = start + dvec2(f64::from(i) + 0.5, f64::from(j) + 0.5);
                let Some(color) = self.at(at) else { continue };
                sums.iter_mut().zip(color).for_each(|(sum, c)| *sum += u32::from(c));
                count += 1;
            }
        }
        (count > 0).then(|| sums.map(|sum| ((sum + count / 2) / count) as u8))
    }

    /// Returns the colour of the pixel that holds a place of the picture.
    fn at(&self, place: DVec2) -> Option<[u8; 3]> {
        let (width, height) = (self.image.width(), self.image.height());
        let is_inside = place.x >= 0.0 && place.y >= 0.0;
        let x = (place.x as u32).min(width.checked_sub(1)?);
        let y = (place.y as u32).min(height.checked_sub(1)?);
        let is_near = place.x <= f64::from(width) && place.y <= f64::from(height);
        (is_inside && is_near).then(|| self.image.at(x, y))
    }
}
