//! Sixteen pixels at a time: the few operations of the visibility pass, on the widest registers.
//!
//! [`Portable`] implements them in plain Rust, which defines the results. `raster_x86.rs` implements them
//! with wide registers.
#![expect(
    clippy::expect_used,
    reason = "slices are cut to the length of the array: there is nothing left of the check"
)]

use std::ops::BitOr;

/// The number of pixels in a register, or in as many registers as that takes.
pub(crate) const LANES: usize = 16;

/// Operations on registers of [`RasterLanes::N`] pixels. A value is the proof that the processor has the
/// instructions.
pub(crate) trait RasterLanes: Copy {
    /// The number of pixels in a register, at most [`LANES`].
    const N: usize;
    /// `N` values of `f32`.
    type F: Copy;
    /// `N` booleans.
    type M: Copy;
    /// Registers of 8 pixels, for narrow faces.
    type Half: RasterLanes;

    fn half(self) -> Self::Half;
    fn splat(self, x: f32) -> Self::F;
    /// Loads the first `N` values of a slice. Panics if it is shorter, like all loads and stores.
    fn load(self, from: &[f32]) -> Self::F;
    /// Overwrites the first `N` values.
    fn store(self, to: &mut [f32], x: Self::F);
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// Compares a > b; false if one is NaN.
    fn greater(self, a: Self::F, b: Self::F) -> Self::M;
    /// Compares the bits of `a`, as an integer, with the bits of `b` plus `ulps`. For numbers from 0 on, the
    /// result is true if `a` is greater by more than so many steps of the last place.
    fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// Returns one bit a lane; the first lane is the lowest bit.
    fn bits(self, m: Self::M) -> u16;
    /// Overwrites the lanes in `m`.
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F);
    /// Overwrites the lanes in `m`.
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32);

    /// Writes the faces and depths of [`LANES`] pixels that see the faces in their slots. Panics if there is
    /// no such slot.
    #[inline(always)]
    fn resolve<const PANORAMA: bool>(
        self,
        slots: &[u32; LANES],
        line: &RowGroup<'_>,
        drawn: &[DrawnFace],
        faces: &mut [u32; LANES],
        depths: &mut [f32; LANES],
    ) {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            let DrawnFace { inverse_t, face, .. } = drawn[slots[k] as usize];
            faces[k] = face;
            let [at, across, bend] = along::<PANORAMA>(inverse_t, line);
            values[k] = at + across * line.u[k];
            if PANORAMA {
                values[k] += bend * line.v[k];
            }
        }
        for k in 0..LANES {
            depths[k] = (1.0 / values[k]).abs() as f32;
        }
    }
}

/// A face that was drawn. It fills half a cache line without padding, since its halves are loaded as numbers.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct DrawnFace {
    /// The coefficients [a, b, c] of 1/t as a function of the pixel, with u and v of its column and the level
    /// and the rise of its row ([`RowGroup`]): a + c·rise + b·u in a perspective view, and c·rise +
    /// level·(a·u + b·v) in a panorama.
    pub(crate) inverse_t: [f64; 3],
    pub(crate) face: u32,
    poor: u32,
}

impl DrawnFace {
    /// `poor` says that `inverse_t` is too poor to give a depth: single rays give it instead.
    #[inline(always)]
    pub(crate) const fn new(inverse_t: [f64; 3], face: u32, poor: bool) -> Self {
        Self { inverse_t, face, poor: poor as u32 }
    }

    pub(crate) fn is_poor(&self) -> bool {
        self.poor != 0
    }
}

/// [`LANES`] pixels of a row, in the form that the functions of a [`DrawnFace`] need.
#[derive(Clone, Copy)]
pub(crate) struct RowGroup<'a> {
    pub(crate) u: &'a [f64; LANES],
    pub(crate) v: &'a [f64; LANES],
    /// cos φ and sin φ of the row in a panorama; 0 and the row in a perspective view.
    pub(crate) level: f64,
    pub(crate) rise: f64,
}

/// Returns the function of a [`DrawnFace`] in a row: at + across·u + bend·v.
#[inline(always)]
pub(crate) fn along<const PANORAMA: bool>([a, b, c]: [f64; 3], line: &RowGroup<'_>) -> [f64; 3] {
    if PANORAMA {
        [c * line.rise, a * line.level, b * line.level]
    } else {
        [a + c * line.rise, b, 0.0]
    }
}

/// Plain arrays of eight, for any processor. The compiler uses the registers that every processor of the
/// target has.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

/// The number of values in a [`Portable`] register.
const WIDTH: usize = 8;

/// Builds an array of eight values: `value` for each `k` from 0 to 7. It is written out, since loops in each
/// operation took most of the time to compile a kernel.
macro_rules! eight {
    ($k:ident => $value:expr) => {
        eight!($k => $value; 0, 1, 2, 3, 4, 5, 6, 7)
    };
    ($k:ident => $value:expr; $($n:literal),*) => {
        [$({
            let $k: usize = $n;
            $value
        }),*]
    };
}

/// Operations on arrays that touch no memory: the closure gives value `k` of the result.
macro_rules! portable {
    ($(fn $name:ident($($arg:ident: $type:ty),*) -> $out:ty = |$k:ident| $body:expr;)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: $type),*) -> $out {
            eight!($k => $body)
        }
    )*};
}

impl RasterLanes for Portable {
    const N: usize = WIDTH;
    type F = [f32; WIDTH];
    type M = [u32; WIDTH];
    type Half = Self;

    #[inline(always)]
    fn half(self) -> Self {
        self
    }

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; WIDTH]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        *from.first_chunk().expect(SHORT)
    }

    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        *to.first_chunk_mut().expect(SHORT) = x;
    }

    portable! {
        fn add(a: Self::F, b: Self::F) -> Self::F = |k| a[k] + b[k];
        fn mul(a: Self::F, b: Self::F) -> Self::F = |k| a[k] * b[k];
        fn min(a: Self::F, b: Self::F) -> Self::F = |k| if a[k] < b[k] { a[k] } else { b[k] };
        fn greater(a: Self::F, b: Self::F) -> Self::M = |k| if a[k] > b[k] { u32::MAX } else { 0 };
        fn greater_by_ulps(a: Self::F, b: Self::F, ulps: i32) -> Self::M = |k| {
            let above = a[k].to_bits() as i32 > (b[k].to_bits() as i32).wrapping_add(ulps);
            if above { u32::MAX } else { 0 }
        };
        fn and(a: Self::M, b: Self::M) -> Self::M = |k| a[k] & b[k];
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u16 {
        eight!(k => ((m[k] & 1) as u16) << k).into_iter().fold(0, BitOr::bitor)
    }

    #[inline(always)]
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        let to: &mut [f32; WIDTH] = to.first_chunk_mut().expect(SHORT);
        *to = eight!(k => if m[k] != 0 { x[k] } else { to[k] });
    }

    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let to: &mut [u32; WIDTH] = to.first_chunk_mut().expect(SHORT);
        *to = eight!(k => if m[k] != 0 { x } else { to[k] });
    }
}

/// Two registers side by side.
#[derive(Clone, Copy)]
pub(crate) struct Pair<L>(pub(crate) L);

/// Operations on both registers of a pair.
macro_rules! pair {
    ($(fn $name:ident($($arg:ident: $type:ty),*; $($same:ident: $same_type:ty),*) -> $out:ty;)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: $type,)* $($same: $same_type,)*) -> $out {
            (self.0.$name($($arg.0,)* $($same,)*), self.0.$name($($arg.1,)* $($same,)*))
        }
    )*};
}

impl<L: RasterLanes> RasterLanes for Pair<L> {
    const N: usize = 2 * L::N;
    type F = (L::F, L::F);
    type M = (L::M, L::M);
    type Half = L;

    pair! {
        fn add(a: Self::F, b: Self::F;) -> Self::F;
        fn mul(a: Self::F, b: Self::F;) -> Self::F;
        fn min(a: Self::F, b: Self::F;) -> Self::F;
        fn greater(a: Self::F, b: Self::F;) -> Self::M;
        fn greater_by_ulps(a: Self::F, b: Self::F; ulps: i32) -> Self::M;
        fn and(a: Self::M, b: Self::M;) -> Self::M;
    }

    #[inline(always)]
    fn half(self) -> L {
        self.0
    }

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        (self.0.splat(x), self.0.splat(x))
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        (self.0.load(from), self.0.load(&from[L::N..]))
    }

    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        self.0.store(to, x.0);
        self.0.store(&mut to[L::N..], x.1);
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u16 {
        self.0.bits(m.0) | self.0.bits(m.1) << L::N
    }

    #[inline(always)]
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        self.0.store_masked_f32(to, m.0, x.0);
        self.0.store_masked_f32(&mut to[L::N..], m.1, x.1);
    }

    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        self.0.store_masked_u32(to, m.0, x);
        self.0.store_masked_u32(&mut to[L::N..], m.1, x);
    }

    #[inline(always)]
    fn resolve<const PANORAMA: bool>(
        self,
        slots: &[u32; LANES],
        line: &RowGroup<'_>,
        drawn: &[DrawnFace],
        faces: &mut [u32; LANES],
        depths: &mut [f32; LANES],
    ) {
        self.0.resolve::<PANORAMA>(slots, line, drawn, faces, depths);
    }
}

/// The message of the panic if a slice is too short.
pub(crate) const SHORT: &str = "a slice as long as a register";
