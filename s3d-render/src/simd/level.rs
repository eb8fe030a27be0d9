//! Which instructions kernels are compiled for and run with: asked of the processor once, when the program
//! runs.

use std::fmt;
use std::sync::OnceLock;

/// The environment variable that holds kernels to a level: see [`SimdLevel`].
const VARIABLE: &str = "S3D_SIMD";

/// The vector instructions that images are made with. All levels give the same bytes.
///
/// The highest that the processor has is used. The environment variable `S3D_SIMD`, read when the first image
/// is made, holds the program to a lower one: `scalar` or `avx2`. A level that the processor lacks, and any
/// other value, changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum SimdLevel {
    /// What every processor of the target has.
    Scalar,
    /// x86-64-v3: AVX2 and what comes with it.
    Avx2,
    /// x86-64-v4 and AVX512-VNNI.
    Avx512,
}

impl SimdLevel {
    const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// The level in use.
    ///
    /// ```
    /// assert!(["scalar", "avx2", "avx512"].contains(&s3d_render::SimdLevel::used().name()));
    /// ```
    pub fn used() -> Self {
        level().public()
    }

    /// As `S3D_SIMD` takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The instructions that every processor of the target has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar;

/// Proof that the processor has what [`Avx2::detect`] asks for.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

/// Proof that the processor has what [`Avx512::detect`] asks for.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    /// `simd::with_avx2` enables the same features.
    pub(crate) fn detect() -> Option<Self> {
        use std::arch::is_x86_feature_detected as has;
        let all = has!("avx2")
            && has!("fma")
            && has!("f16c")
            && has!("bmi1")
            && has!("bmi2")
            && has!("lzcnt")
            && has!("popcnt");
        all.then_some(Self(()))
    }
}

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    /// `simd::with_avx512` enables the same features.
    pub(crate) fn detect() -> Option<Self> {
        use std::arch::is_x86_feature_detected as has;
        let all = Avx2::detect().is_some()
            && has!("avx512f")
            && has!("avx512bw")
            && has!("avx512dq")
            && has!("avx512vl")
            && has!("avx512vnni");
        all.then_some(Self(()))
    }

    /// Whoever has these has those.
    #[inline(always)]
    pub(crate) fn avx2(self) -> Avx2 {
        Avx2(())
    }
}

/// A level and the proof that the processor has it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    Scalar(Scalar),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Level {
    fn public(self) -> SimdLevel {
        match self {
            Self::Scalar(_) => SimdLevel::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => SimdLevel::Avx512,
        }
    }

    /// The highest that the processor has and that is not above `most`.
    fn best(most: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if let (true, Some(proof)) = (most >= SimdLevel::Avx512, Avx512::detect()) {
                return Self::Avx512(proof);
            }
            if let (true, Some(proof)) = (most >= SimdLevel::Avx2, Avx2::detect()) {
                return Self::Avx2(proof);
            }
        }
        let _ = most;
        Self::Scalar(Scalar)
    }
}

/// All levels that the processor has.
#[cfg(test)]
pub(crate) fn all_levels() -> Vec<Level> {
    let mut levels: Vec<Level> = SimdLevel::ALL.into_iter().map(Level::best).collect();
    levels.dedup_by_key(|level| level.public());
    levels
}

/// The level that a value of [`VARIABLE`] allows at most.
fn allowed(value: Option<&str>) -> SimdLevel {
    let named = |level: &SimdLevel| value == Some(level.name());
    SimdLevel::ALL.into_iter().find(named).unwrap_or(SimdLevel::Avx512)
}

/// The level in use.
#[inline]
pub(crate) fn level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(|| Level::best(allowed(std::env::var(VARIABLE).ok().as_deref())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_holds_the_level_down_and_never_up() {
        let best = Level::best(SimdLevel::Avx512).public();
        for level in SimdLevel::ALL {
            assert_eq!(allowed(Some(level.name())), level);
            assert_eq!(Level::best(level).public(), level.min(best));
        }
        for other in [None, Some(""), Some("AVX2"), Some("neon")] {
            assert_eq!(Level::best(allowed(other)).public(), best);
        }
    }
}
