//! Chooses the vector instructions of a program, in one place.
//!
//! # Levels
//!
//! [`level`] returns the highest [`ProvenLevel`] that the processor has. The environment variable `S3D_SIMD`
//! can hold it down: see [`SimdLevel`]. All levels give the same bytes.
//!
//! # Dispatch
//!
//! [`dispatch!`] compiles an expression once for each level and runs it at one. The expression gets a proof
//! ([`Scalar`], [`Avx2`], [`Avx512`]): a value that exists only if the processor has these instructions.
//!
//! Every function that the expression calls in a loop must be `#[inline(always)]`. Otherwise the compiler may
//! compile it for any processor and call it.
//!
//! ```
//! use s3d_simd::{ProvenLevel, dispatch, level};
//!
//! #[inline(always)]
//! fn sum(values: &[u32]) -> u32 {
//!     values.iter().sum()
//! }
//!
//! let values: Vec<u32> = (0..1000).collect();
//! assert_eq!(dispatch!(level(), _simd => sum(&values)), 499_500);
//!
//! // A test holds every level against the plain one.
//! for level in ProvenLevel::all() {
//!     assert_eq!(dispatch!(level, _simd => sum(&values)), 499_500);
//! }
//! ```
//!
//! # Why not a library
//!
//! Libraries that offer this (`fearless_simd`, `pulp`) bring register types of their own, which cost time in
//! our hottest kernels: see the book's page on speed.

use std::fmt;
use std::sync::OnceLock;

/// The environment variable that limits the level: see [`SimdLevel`].
const VARIABLE: &str = "S3D_SIMD";

/// A level of vector instructions. All levels give the same bytes.
///
/// A program uses the highest level that the processor has. The environment variable `S3D_SIMD`, read when
/// the first kernel runs, limits it to a lower one: `scalar` or `avx2`. A level that the processor lacks
/// changes nothing, nor does any other value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum SimdLevel {
    /// The instructions that every processor of the target has.
    Scalar,
    /// x86-64-v3: AVX2, FMA, F16C, BMI1, BMI2, LZCNT and POPCNT.
    Avx2,
    /// x86-64-v4 and AVX512-VNNI.
    Avx512,
}

impl SimdLevel {
    const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// Returns the level in use.
    ///
    /// ```
    /// assert!(["scalar", "avx2", "avx512"].contains(&s3d_simd::SimdLevel::used().name()));
    /// ```
    pub fn used() -> Self {
        level().name()
    }

    /// Returns the name of the level, as in `S3D_SIMD`.
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
pub struct Scalar;

/// Proof that the processor has AVX2, FMA, F16C, BMI1, BMI2, LZCNT and POPCNT.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

/// Proof that the processor has the instructions of [`Avx2`], and AVX-512 F, BW, DQ, VL and VNNI.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    /// Returns the proof, or `None` if the processor lacks any of these instructions.
    pub fn detect() -> Option<Self> {
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

    /// Runs `work`, a closure that is `#[inline(always)]`, compiled for these instructions.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn vectorize<R>(self, work: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        // SAFETY: `self` proves that the processor has the features that the function enables: `detect`.
        unsafe { compiled(work) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    /// Returns the proof, or `None` if the processor lacks any of these instructions.
    pub fn detect() -> Option<Self> {
        use std::arch::is_x86_feature_detected as has;
        let all = Avx2::detect().is_some()
            && has!("avx512f")
            && has!("avx512bw")
            && has!("avx512dq")
            && has!("avx512vl")
            && has!("avx512vnni");
        all.then_some(Self(()))
    }

    /// Returns the proof of the lower level, which this one includes.
    #[inline(always)]
    pub fn avx2(self) -> Avx2 {
        Avx2(())
    }

    /// Runs `work`, a closure that is `#[inline(always)]`, compiled for these instructions.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn vectorize<R>(self, work: impl FnOnce() -> R) -> R {
        #[target_feature(
            enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni"
        )]
        fn compiled<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        // SAFETY: `self` proves that the processor has the features that the function enables: `detect`.
        unsafe { compiled(work) }
    }
}

/// A level and the proof that the processor has it.
#[derive(Clone, Copy, Debug)]
pub enum ProvenLevel {
    /// The plain form, which defines the results.
    Scalar(Scalar),
    /// See [`Avx2`].
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// See [`Avx512`].
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl ProvenLevel {
    /// Returns the level without its proof.
    pub fn name(self) -> SimdLevel {
        match self {
            Self::Scalar(_) => SimdLevel::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => SimdLevel::Avx512,
        }
    }

    /// Returns the highest level that the processor has, but not above `most`.
    fn best(most: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if most >= SimdLevel::Avx512
                && let Some(proof) = Avx512::detect()
            {
                return Self::Avx512(proof);
            }
            if most >= SimdLevel::Avx2
                && let Some(proof) = Avx2::detect()
            {
                return Self::Avx2(proof);
            }
        }
        let _ = most;
        Self::Scalar(Scalar)
    }

    /// Returns this level, but AVX2 instead of AVX-512: for work that gains nothing from wider registers.
    #[inline]
    pub fn without_avx512(self) -> Self {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(proof) => Self::Avx2(proof.avx2()),
            other => other,
        }
    }

    /// Returns all levels that the processor has, whatever the environment says. The plain level is the
    /// first. For tests, which hold each level against the plain one.
    pub fn all() -> Vec<Self> {
        let mut levels: Vec<Self> = SimdLevel::ALL.into_iter().map(Self::best).collect();
        levels.dedup_by_key(|level| level.name());
        levels
    }
}

/// Returns the highest level that a value of [`VARIABLE`] allows.
fn allowed(value: Option<&str>) -> SimdLevel {
    SimdLevel::ALL
        .into_iter()
        .find(|level| value == Some(level.name()))
        .unwrap_or(SimdLevel::Avx512)
}

/// Returns the level in use, with its proof.
#[inline]
pub fn level() -> ProvenLevel {
    static LEVEL: OnceLock<ProvenLevel> = OnceLock::new();
    *LEVEL.get_or_init(|| ProvenLevel::best(allowed(std::env::var(VARIABLE).ok().as_deref())))
}

/// Prefetches the cache line in which `thing` begins, so that it arrives from memory while the program does
/// something else. It changes no result, and does nothing on processors other than x86-64.
#[inline(always)]
pub fn prefetch<T>(thing: &T) {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    // SAFETY: every x86-64 processor has SSE; the instruction reads nothing that the program sees.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(thing).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = thing;
}

/// Runs an expression at a [`ProvenLevel`]: `dispatch!(level, simd => work)` is the value of `work`.
///
/// The expression is compiled once for each level. In it, `simd` is the proof of the level. Every function
/// that `work` calls in its loops must be `#[inline(always)]`.
#[macro_export]
macro_rules! dispatch {
    ($level:expr, $simd:ident => $work:expr) => {
        match $level {
            $crate::ProvenLevel::Scalar($simd) => $work,
            #[cfg(target_arch = "x86_64")]
            $crate::ProvenLevel::Avx2($simd) => $simd.vectorize(
                #[inline(always)]
                || $work,
            ),
            #[cfg(target_arch = "x86_64")]
            $crate::ProvenLevel::Avx512($simd) => $simd.vectorize(
                #[inline(always)]
                || $work,
            ),
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_holds_the_level_down_and_never_up() {
        let best = ProvenLevel::best(SimdLevel::Avx512).name();
        for level in SimdLevel::ALL {
            assert_eq!(allowed(Some(level.name())), level);
            assert_eq!(ProvenLevel::best(level).name(), level.min(best));
        }
        for other in [None, Some(""), Some("AVX2"), Some("neon")] {
            assert_eq!(ProvenLevel::best(allowed(other)).name(), best);
        }
    }

    #[test]
    fn all_levels_run_and_the_plain_one_is_first() {
        let sums = ProvenLevel::all().into_iter().map(|level| {
            assert!(level.without_avx512().name() <= SimdLevel::Avx2.min(level.name()));
            dispatch!(level, _simd => [1u32, 2, 3].iter().sum::<u32>())
        });
        assert!(sums.eq(ProvenLevel::all().iter().map(|_| 6)));
        assert_eq!(ProvenLevel::all()[0].name(), SimdLevel::Scalar);
    }
}
