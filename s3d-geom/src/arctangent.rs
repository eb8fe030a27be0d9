//! The arctangent as a polynomial, for kernels that compute it for several numbers at once.

/// The coefficients of a polynomial p in a², the highest power first: atan(a) is a · p(a²), from
/// 0 to 1.
///
/// They minimise the largest error, 4e-8, to which single precision adds its own.
///
/// ```
/// let a = 0.5_f32;
/// let p = s3d_geom::ARCTANGENT.iter().fold(0.0, |sum, c| sum * (a * a) + c);
/// assert!((a * p - a.atan()).abs() < 2e-7);
/// ```
pub const ARCTANGENT: [f32; 8] = [
    -0.004_056_03,
    0.021_868_023,
    -0.055_919_29,
    0.096_426_81,
    -0.139_088_08,
    0.199_465_99,
    -0.333_298_63,
    0.999_999_34,
];
