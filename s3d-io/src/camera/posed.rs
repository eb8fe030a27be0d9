//! Cameras with poses: of photographs, or of views to render.

use crate::camera::narrow::{sentence, too_narrow};
use crate::camera::picture_file::PictureFile;
use s3d_geom::glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Camera, CameraError, FisheyeLens, Lens, PhotoLens, Pose};
use std::path::PathBuf;
use thiserror::Error;

/// A camera of a list that [`read_posed_cameras`](crate::camera::read_posed_cameras) reads.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedCamera {
    /// The name in the list: the file of a picture, a time stamp, or any word.
    pub name: String,
    /// The position and rotation.
    pub pose: Pose,
    /// The width and height of the picture in pixels, if the list tells them.
    pub size: Option<[u32; 2]>,
    /// How directions become pixels, if the list tells it.
    pub optics: Option<Optics>,
    /// The picture that was taken with the camera, if the list names one. The file may not exist.
    pub picture: Option<PictureFile>,
    /// The mask of the picture, if the list names one: a picture of the same size that is black where nothing
    /// may be shown. The file may not exist.
    pub mask: Option<PathBuf>,
    /// The line in the list, from 1; 0 if the list has no lines.
    pub line: u64,
}

/// How a camera maps directions to pixels, as far as lists of cameras tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Optics {
    /// A pinhole, perhaps behind a lens.
    Pinhole {
        /// Focal lengths in pixels.
        focal_px: DVec2,
        /// The principal point in pixels from the top left corner of the picture. `None`: the middle of the
        /// picture.
        center_px: Option<DVec2>,
        /// The distortion of the lens.
        distortion: Distortion,
    },
    /// A pinhole with square pixels and its centre in the middle.
    AngleOfView {
        /// The full horizontal angle, in (0, π).
        fov_rad: f64,
    },
    /// A panorama, twice as wide as high.
    Equirectangular,
}

/// The distortion of a lens, in OpenCV's terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Distortion {
    /// None: the lens is a pinhole.
    #[default]
    None,
    /// k₁ k₂ p₁ p₂ k₃, as in [`Lens`](s3d_geom::Lens).
    OpenCv([f64; 5]),
    /// k₁ k₂ k₃ k₄ of a fisheye lens: θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) is the
    /// distance from the axis.
    Fisheye([f64; 4]),
}

impl Distortion {
    /// Returns the distortion of OpenCV's numbers: none if all are 0.
    pub(crate) fn opencv(numbers: [f64; 5]) -> Self {
        if numbers == [0.0; 5] {
            Self::None
        } else {
            Self::OpenCv(numbers)
        }
    }
}

/// What a caller knows beside a list of cameras. It replaces what the list says, or fills in what it does not
/// say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GivenIntrinsics {
    /// The width of the images in pixels.
    pub width: Option<u32>,
    /// The height of the images in pixels.
    pub height: Option<u32>,
    /// How directions become pixels in images of that size.
    pub optics: Option<Optics>,
}

/// Why there can be no images of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum IntrinsicsError {
    /// Neither the list nor the caller tells the size.
    #[error("the size of its images is not known")]
    NoSize,
    /// Neither the list nor the caller tells focal lengths or an angle of view.
    #[error("neither its focal lengths nor its angle of view are known")]
    NoOptics,
    /// The size is not a panorama's, which is twice as wide as high.
    #[error("a panorama is twice as wide as high, not {width} × {height} pixels")]
    PanoramaSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// Only level panoramas are supported.
    #[error("it is a panorama that is tilted by {tilt_deg:.1}°: only level ones are supported")]
    TiltedPanorama {
        /// The angle between the panorama's up and the world's, degrees.
        tilt_deg: f64,
    },
    /// The photograph has another shape than the list tells.
    #[error(
        "the photograph has {} × {} pixels, and its camera is for {} × {}",
        found[0], found[1], told[0], told[1]
    )]
    OtherSize {
        /// Width and height of the photograph.
        found: [u32; 2],
        /// Width and height that the list tells.
        told: [u32; 2],
    },
    /// The principal point lies outside of the photograph.
    #[error(
        "the principal point ({}, {}) lies outside of the photograph of {} × {} pixels: is the camera for a \
         picture of another size?",
        center_px.x, center_px.y, size[0], size[1]
    )]
    CenterOutside {
        /// The principal point in pixels of the photograph.
        center_px: DVec2,
        /// Width and height of the photograph.
        size: [u32; 2],
    },
    /// A panorama has no lens.
    #[error("it is a panorama, which no lens took")]
    NoLens,
    /// No lens has these numbers.
    #[error(
        "no direction comes to the middle of its picture: focal lengths, principal point or distortion are \
         wrong"
    )]
    BadLens,
    /// No lens takes pictures that narrow.
    #[error("{}", sentence(*size, *focal_px))]
    TooNarrow {
        /// Width and height of the photograph.
        size: [u32; 2],
        /// Focal lengths in pixels of the photograph.
        focal_px: DVec2,
    },
    /// No camera has these numbers.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

impl PosedCamera {
    /// Returns a camera of which only the name and the pose are known.
    pub fn new(name: impl Into<String>, pose: Pose) -> Self {
        let name = name.into();
        Self { name, pose, size: None, optics: None, picture: None, mask: None, line: 0 }
    }

    /// Returns the camera that takes the picture, without the distortion of its lens.
    ///
    /// `given` goes before what the list says. If only a size is given, the picture is scaled to it, with its
    /// focal lengths and principal point. If only the width is given, the height follows, and the other way
    /// round.
    ///
    /// # Errors
    /// [`IntrinsicsError`].
    pub fn camera(&self, given: &GivenIntrinsics) -> Result<Camera, IntrinsicsError> {
        let [width, height] = self.size_with(given)?;
        let pose = self.pose;
        let size = dvec2(f64::from(width), f64::from(height));

        let from_list = self.optics.map(|optics| match (optics, self.size) {
            (Optics::Pinhole { focal_px, center_px, distortion }, Some([w, h])) => {
                let scale = size / dvec2(f64::from(w), f64::from(h));
                let center_px = center_px.map(|c| c * scale);
                Optics::Pinhole { focal_px: focal_px * scale, center_px, distortion }
            }
            _ => optics,
        });

        match given.optics.or(from_list).ok_or(IntrinsicsError::NoOptics)? {
            Optics::Pinhole { focal_px, center_px, .. } => {
                let center_px = center_px.unwrap_or(size * 0.5);
                Ok(Camera::pinhole(pose, focal_px, center_px, width, height)?)
            }
            Optics::AngleOfView { fov_rad } => {
                let is_angle = fov_rad > 0.0 && fov_rad < std::f64::consts::PI;
                if !is_angle {
                    return Err(CameraError::AngleOfView(fov_rad).into());
                }
                Ok(Camera::perspective(pose, fov_rad, width, height))
            }
            Optics::Equirectangular => {
                /// The tilt that rounding can give a level pose, degrees.
                const LEVEL_DEG: f64 = 0.1;
                if width != height.saturating_mul(2) {
                    return Err(IntrinsicsError::PanoramaSize { width, height });
                }
                let tilt_deg = pose.up().angle_between(DVec3::Z).to_degrees();
                if tilt_deg > LEVEL_DEG {
                    return Err(IntrinsicsError::TiltedPanorama { tilt_deg });
                }
                Ok(Camera::equirectangular(pose, width))
            }
        }
    }

    /// Returns the lens that a photograph of `found` pixels (width, height) was taken through. Intrinsics for
    /// another size are scaled, because photographs are scaled before they are handed on. Intrinsics without
    /// a size are for the photograph itself.
    ///
    /// # Errors
    /// [`IntrinsicsError`]; [`OtherSize`](IntrinsicsError::OtherSize) if the proportions differ by more than
    /// a pixel of rounding.
    pub fn photo_lens(&self, found: [u32; 2]) -> Result<PhotoLens, IntrinsicsError> {
        let told = self.size.unwrap_or(found);
        let [size, told_size] = [found, told].map(|[w, h]| dvec2(f64::from(w), f64::from(h)));
        if found.contains(&0) || told.contains(&0) {
            return Err(CameraError::NoPixels {
                width: found[0].min(told[0]),
                height: found[1].min(told[1]),
            }
            .into());
        }

        let scale = size / told_size;
        let off = [(size.y - told_size.y * scale.x).abs(), (size.x - told_size.x * scale.y).abs()];
        if off.iter().all(|off| *off > 1.0) {
            return Err(IntrinsicsError::OtherSize { found, told });
        }

        let (focal_px, center_px, distortion) = match self.optics.ok_or(IntrinsicsError::NoOptics)? {
            Optics::Pinhole { focal_px, center_px, distortion } => {
                (focal_px * scale, center_px.map_or(size * 0.5, |c| c * scale), distortion)
            }
            Optics::AngleOfView { fov_rad } if fov_rad > 0.0 && fov_rad < std::f64::consts::PI => {
                (DVec2::splat(0.5 * size.x / libm::tan(0.5 * fov_rad)), size * 0.5, Distortion::None)
            }
            Optics::AngleOfView { fov_rad } => return Err(CameraError::AngleOfView(fov_rad).into()),
            Optics::Equirectangular => return Err(IntrinsicsError::NoLens),
        };
        if center_px.cmplt(DVec2::ZERO).any() || center_px.cmpgt(size).any() {
            return Err(IntrinsicsError::CenterOutside { center_px, size: found });
        }

        if too_narrow(found, focal_px).is_some() {
            return Err(IntrinsicsError::TooNarrow { size: found, focal_px });
        }

        let lens = match distortion {
            Distortion::None => Lens::new(found, focal_px, center_px, [0.0; 5]).map(PhotoLens::Straight),
            Distortion::OpenCv(k) => Lens::new(found, focal_px, center_px, k).map(PhotoLens::Straight),
            Distortion::Fisheye(k) => FisheyeLens::new(found, focal_px, center_px, k).map(PhotoLens::Fisheye),
        };
        lens.ok_or(IntrinsicsError::BadLens)
    }

    /// Returns the width and height of the images in pixels.
    fn size_with(&self, given: &GivenIntrinsics) -> Result<[u32; 2], IntrinsicsError> {
        let size = match (given.width, given.height, self.size) {
            (Some(width), Some(height), _) => [width, height],
            (Some(width), None, Some([w, h])) => [width, scaled_side(h, width, w)],
            (None, Some(height), Some([w, h])) => [scaled_side(w, height, h), height],
            (None, None, Some(size)) => size,
            _ => return Err(IntrinsicsError::NoSize),
        };
        let [width, height] = size;
        if width == 0 || height == 0 {
            Err(CameraError::NoPixels { width, height }.into())
        } else {
            Ok(size)
        }
    }

    /// Returns whether the picture is a panorama. It may be tilted.
    pub fn is_panorama(&self) -> bool {
        self.optics == Some(Optics::Equirectangular)
    }

    /// Returns whether a lens distorts the picture. [`camera`](Self::camera) leaves the distortion out.
    pub fn is_distorted(&self) -> bool {
        matches!(self.optics, Some(Optics::Pinhole { distortion, .. }) if distortion != Distortion::None)
    }
}

/// Returns a side of a picture in pixels, scaled by `to` / `from`. It is at least 1.
fn scaled_side(side: u32, to: u32, from: u32) -> u32 {
    let scaled = f64::from(side) * f64::from(to) / f64::from(from.max(1));
    (scaled.round() as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Projection;

    fn posed(size: Option<[u32; 2]>, optics: Option<Optics>) -> PosedCamera {
        let pose = Pose::level(DVec3::ONE, 0.3);
        PosedCamera { size, optics, ..PosedCamera::new("a", pose) }
    }

    const PHONE: Optics = Optics::Pinhole {
        focal_px: DVec2::new(1600.0, 1604.0),
        center_px: Some(DVec2::new(950.0, 530.0)),
        distortion: Distortion::OpenCv([0.1, 0.0, 0.0, 0.0, 0.0]),
    };

    fn sized(width: Option<u32>, height: Option<u32>) -> GivenIntrinsics {
        GivenIntrinsics { width, height, optics: None }
    }

    #[test]
    fn a_smaller_picture_shows_the_same() {
        let posed = posed(Some([1920, 1080]), Some(PHONE));
        let full = posed.camera(&GivenIntrinsics::default()).unwrap();
        assert_eq!((full.width, full.height, full.focal_px()), (1920, 1080, dvec2(1600.0, 1604.0)));
        assert!(posed.is_distorted());
        for given in [sized(Some(480), None), sized(None, Some(270)), sized(Some(480), Some(270))] {
            let small = posed.camera(&given).unwrap();
            assert_eq!((small.width, small.height), (480, 270));
            // The corner of the picture stays the corner, and so does everything else.
            let a = full.direction(1920.0, 40.0);
            let b = small.direction(480.0, 10.0);
            assert!(a.abs_diff_eq(b, 1e-12), "{a} {b}");
        }

        let given = GivenIntrinsics {
            optics: Some(Optics::AngleOfView { fov_rad: 1.0 }),
            ..sized(Some(100), Some(70))
        };
        let other = posed.camera(&given).unwrap();
        assert_eq!(other.projection, Projection::Perspective { fov_rad: 1.0 });
    }

    #[test]
    fn what_is_not_known_is_named() {
        let none = GivenIntrinsics::default();
        assert_eq!(posed(None, Some(PHONE)).camera(&none), Err(IntrinsicsError::NoSize));
        assert_eq!(posed(None, None).camera(&sized(Some(8), None)), Err(IntrinsicsError::NoSize));
        assert_eq!(posed(Some([8, 8]), None).camera(&none), Err(IntrinsicsError::NoOptics));
        // The focal lengths are for the given size if the list has none.
        let camera = posed(None, Some(PHONE)).camera(&sized(Some(1920), Some(1080))).unwrap();
        assert_eq!(camera.focal_px(), dvec2(1600.0, 1604.0));
        let flat = posed(Some([8, 8]), Some(Optics::AngleOfView { fov_rad: 4.0 })).camera(&none);
        assert_eq!(flat, Err(IntrinsicsError::Camera(CameraError::AngleOfView(4.0))));
        assert!(posed(Some([0, 8]), Some(PHONE)).camera(&none).is_err());
    }

    fn phone_lens(found: [u32; 2]) -> Result<PhotoLens, IntrinsicsError> {
        posed(Some([1920, 1080]), Some(PHONE)).photo_lens(found)
    }

    #[test]
    fn photographs_have_the_shape_that_their_camera_tells() {
        let camera = posed(Some([1920, 1080]), Some(PHONE));
        let full = phone_lens([1920, 1080]).unwrap();
        // A third of the size, rounded: the corner stays the corner.
        let small = phone_lens([641, 360]).unwrap();
        let a = full.direction(dvec2(1800.0, 90.0)).unwrap();
        let b = small.direction(dvec2(1800.0 * 641.0 / 1920.0, 30.0)).unwrap();
        assert!(a.abs_diff_eq(b, 1e-9));
        for found in [[1080, 1920], [1920, 1088], [640, 480]] {
            assert_eq!(phone_lens(found), Err(IntrinsicsError::OtherSize { found, told: [1920, 1080] }));
        }

        // Intrinsics without a size are for the photograph. A principal point outside says that they are not.
        let unsized_camera = PosedCamera { size: None, ..camera.clone() };
        assert_eq!(unsized_camera.photo_lens([1920, 1080]), Ok(full));
        let outside = unsized_camera.photo_lens([640, 480]).unwrap_err().to_string();
        assert!(outside.contains("(950, 530) lies outside of the photograph of 640 × 480"), "{outside}");
        assert_eq!(
            PosedCamera { optics: None, ..camera.clone() }.photo_lens([8, 8]).err(),
            Some(IntrinsicsError::OtherSize { found: [8, 8], told: [1920, 1080] })
        );
        let of = |optics| PosedCamera { optics, size: None, ..camera.clone() }.photo_lens([64, 32]);
        assert_eq!(of(None), Err(IntrinsicsError::NoOptics));
        assert_eq!(of(Some(Optics::Equirectangular)), Err(IntrinsicsError::NoLens));
        assert!(of(Some(Optics::AngleOfView { fov_rad: 1.0 })).is_ok());
        let distortion = Distortion::Fisheye([f64::NAN; 4]);
        let bad = Optics::Pinhole { focal_px: DVec2::ONE, center_px: None, distortion };
        assert_eq!(of(Some(bad)), Err(IntrinsicsError::BadLens));
        // A digit too many.
        let focal_px = DVec2::splat(3000.0);
        let narrow = Optics::Pinhole { focal_px, center_px: None, distortion: Distortion::None };
        let error = of(Some(narrow)).unwrap_err();
        assert_eq!(error, IntrinsicsError::TooNarrow { size: [64, 32], focal_px });
        assert!(error.to_string().contains("angle of view of 1.22°"), "{error}");
    }

    #[test]
    fn panoramas_are_level_and_twice_as_wide() {
        let none = GivenIntrinsics::default();
        let mut panorama = posed(Some([64, 32]), Some(Optics::Equirectangular));
        assert!(panorama.camera(&none).unwrap().is_panorama());
        panorama.size = Some([64, 64]);
        let size = IntrinsicsError::PanoramaSize { width: 64, height: 64 };
        assert_eq!(panorama.camera(&none), Err(size));
        panorama.size = Some([64, 32]);
        panorama.pose = panorama.pose.turned(0.0, 0.1);
        assert!(
            panorama
                .camera(&none)
                .unwrap_err()
                .to_string()
                .contains("tilted by 5.7°")
        );
    }
}
