//! The noise of a sensor.

use crate::FusionError;

/// The noise of a sensor's ranges: sigma = `constant_m` + `per_m`·r + `per_m2`·r² at the range r, for a
/// surface that the ray meets at a right angle.
///
/// ```
/// use s3d_fusion::SensorNoise;
///
/// let sigma_m = SensorNoise::STRUCTURED_LIGHT.sigma_m(2.0);
/// assert!((0.003..0.01).contains(&sigma_m));
/// assert!(SensorNoise::LASER.sigma_m(10.0) < sigma_m);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// The part that does not depend on the range, metres.
    pub constant_m: f32,
    /// The part that grows with the range, metres for each metre.
    pub per_m: f32,
    /// The part that grows with the square of the range, metres for each square metre.
    pub per_m2: f32,
}

impl SensorNoise {
    /// A terrestrial laser scanner: 1.5 mm, and 0.1 mm more each metre. Makers state 1 to 3 mm at 10 m.
    pub const LASER: Self = Self { constant_m: 0.0015, per_m: 0.0001, per_m2: 0.0 };

    /// A depth camera with structured light: 1 mm near, 5 mm at 2 m, 17 mm at 4 m. Source: the order of the
    /// figures of Khoshelham and Elberink 2012, "Accuracy and Resolution of Kinect Depth Data".
    pub const STRUCTURED_LIGHT: Self = Self { constant_m: 0.001, per_m: 0.0, per_m2: 0.001 };

    /// Returns the standard deviation of a range of `range_m`, metres.
    #[inline(always)]
    pub fn sigma_m(&self, range_m: f32) -> f32 {
        self.constant_m + range_m * (self.per_m + range_m * self.per_m2)
    }

    pub(crate) fn check(self) -> Result<Self, FusionError> {
        let Self { constant_m, per_m, per_m2 } = self;
        let parts = [constant_m, per_m, per_m2];
        if parts.iter().all(|p| p.is_finite() && *p >= 0.0) && parts.iter().any(|p| *p > 0.0) {
            Ok(self)
        } else {
            Err(FusionError::Noise { constant_m, per_m, per_m2 })
        }
    }
}
