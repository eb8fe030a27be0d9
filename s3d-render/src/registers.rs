//! Sixteen pixels at a time: the few operations that the visibility pass needs, on the widest registers there are.
//!
//! Which set of instructions a processor has is asked when the program runs ([`run`]). All sets give the same bits:
//! products and sums are rounded one by one, never fused.
#![allow(unsafe_code)]

/// Pixels in a register (or in as many registers as it takes).
pub(crate) const LANES: usize = 16;

/// A set of instructions, as the proof that the processor has it, and registers of [`Registers::N`] pixels.
pub(crate) trait Registers: Copy {
    /// Pixels at a time; at most [`LANES`].
    const N: usize;
    /// `N` times `f32`.
    type F: Copy;
    /// `N` times yes or no.
    type M: Copy;
    /// Registers of 8 pixels, for what is narrow.
    type Half: Registers;

    fn half(self) -> Self::Half;
    fn splat(self, x: f32) -> Self::F;
    /// The first `N` of a slice. Panics if it is shorter; so do the others.
    fn load(self, from: &[f32]) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a > b; no for what is not a number.
    fn above(self, a: Self::F, b: Self::F) -> Self::M;
    /// The bits of `a`, as an integer, are above those of `b` plus `steps`: for numbers from 0 on, `a` is greater by
    /// more than so many times the last place.
    fn steps_above(self, a: Self::F, b: Self::F, steps: i32) -> Self::M;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// One bit a lane, the first lane's the lowest.
    fn bits(self, m: Self::M) -> u16;
    /// Overwrites the lanes in `m`.
    fn store_f32(self, to: &mut [f32], m: Self::M, x: Self::F);
    /// Overwrites the lanes in `m`.
    fn store_u32(self, to: &mut [u32], m: Self::M, x: u32);

    /// Depths and faces of [`LANES`] pixels. A pixel's slot stands for a face and a function at + across·u + bend·v of
    /// the column, which is 1/t; `TURN` says whether it bends. Every set of instructions gives the same bits.
    #[inline(always)]
    fn resolve<const TURN: bool>(
        self,
        slots: &[u32; LANES],
        (u, v): (&[f64; LANES], &[f64; LANES]),
        drawn: impl Fn(u32) -> ([f64; 3], u32),
        faces: &mut [u32; LANES],
        depths: &mut [f32; LANES],
    ) {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            let ([at, across, bend], face) = drawn(slots[k]);
            faces[k] = face;
            values[k] = if TURN { at + across * u[k] + bend * v[k] } else { at + across * u[k] };
        }
        for k in 0..LANES {
            depths[k] = (1.0 / values[k]).abs() as f32;
        }
    }
}

/// Work that is compiled for every set of instructions. `run` and what it calls in its loops are `#[inline(always)]`.
pub(crate) trait Work {
    type Output;
    fn run<L: Registers>(self, lanes: L) -> Self::Output;
}

/// Runs `work` with the widest registers of the processor.
pub(crate) fn run<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f")
            && has!("avx512vl")
            && has!("avx512dq")
            && has!("avx512bw")
            && has!("bmi2")
            && has!("lzcnt")
        {
            // SAFETY: the processor has what the function is compiled for, which was just asked.
            return unsafe { x86::run_avx512(work) };
        }
        if has!("avx2") && has!("fma") && has!("bmi1") {
            // SAFETY: likewise.
            return unsafe { x86::run_avx2(work) };
        }
    }
    work.run(Portable::<LANES>)
}

/// Plain arrays of `N`, for any processor: the compiler uses the registers that every processor of the target has.
#[derive(Clone, Copy)]
pub(crate) struct Portable<const N: usize>;

impl<const N: usize> Registers for Portable<N> {
    const N: usize = N;
    type F = [f32; N];
    type M = [u32; N];
    type Half = Portable<8>;

    #[inline(always)]
    fn half(self) -> Self::Half {
        Portable
    }

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; N]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        *from.first_chunk().expect(SHORT)
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] + b[k])
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] * b[k])
    }

    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }

    #[inline(always)]
    fn above(self, a: Self::F, b: Self::F) -> Self::M {
        std::array::from_fn(|k| if a[k] > b[k] { u32::MAX } else { 0 })
    }

    #[inline(always)]
    fn steps_above(self, a: Self::F, b: Self::F, steps: i32) -> Self::M {
        std::array::from_fn(|k| {
            let above = a[k].to_bits() as i32 > (b[k].to_bits() as i32).wrapping_add(steps);
            if above { u32::MAX } else { 0 }
        })
    }

    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        std::array::from_fn(|k| a[k] & b[k])
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u16 {
        (0..N).fold(0, |bits, k| bits | ((m[k] & 1) as u16) << k)
    }

    #[inline(always)]
    fn store_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        let to: &mut [f32; N] = to.first_chunk_mut().expect(SHORT);
        *to = std::array::from_fn(|k| if m[k] != 0 { x[k] } else { to[k] });
    }

    #[inline(always)]
    fn store_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let to: &mut [u32; N] = to.first_chunk_mut().expect(SHORT);
        *to = std::array::from_fn(|k| if m[k] != 0 { x } else { to[k] });
    }
}

const SHORT: &str = "a slice as long as a register";

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{LANES, Registers, SHORT, Work};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn run_avx512<W: Work>(work: W) -> W::Output {
        work.run(Avx512(()))
    }

    #[target_feature(enable = "avx2,fma,bmi1")]
    pub(super) fn run_avx2<W: Work>(work: W) -> W::Output {
        work.run(Avx2::<2>(()))
    }

    /// One register of 512 bits. Made only where the processor is known to have AVX-512 (F, VL, DQ, BW), AVX2 and FMA.
    #[derive(Clone, Copy)]
    pub(super) struct Avx512(());

    // SAFETY of all that follows: a value of the type exists only inside `run_avx512`, so the processor has the
    // instructions; loads and stores go through references to arrays of sixteen.
    impl Registers for Avx512 {
        const N: usize = LANES;
        type F = __m512;
        type M = __mmask16;
        type Half = Avx2<1>;

        #[inline(always)]
        fn half(self) -> Self::Half {
            Avx2(())
        }

        #[inline(always)]
        fn splat(self, x: f32) -> Self::F {
            unsafe { _mm512_set1_ps(x) }
        }

        #[inline(always)]
        fn load(self, from: &[f32]) -> Self::F {
            let from: &[f32; LANES] = from.first_chunk().expect(SHORT);
            unsafe { _mm512_loadu_ps(from.as_ptr()) }
        }

        #[inline(always)]
        fn add(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_add_ps(a, b) }
        }

        #[inline(always)]
        fn mul(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_mul_ps(a, b) }
        }

        #[inline(always)]
        fn min(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_min_ps(a, b) }
        }

        #[inline(always)]
        fn above(self, a: Self::F, b: Self::F) -> Self::M {
            unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b) }
        }

        #[inline(always)]
        fn steps_above(self, a: Self::F, b: Self::F, steps: i32) -> Self::M {
            unsafe {
                let b = _mm512_add_epi32(_mm512_castps_si512(b), _mm512_set1_epi32(steps));
                _mm512_cmpgt_epi32_mask(_mm512_castps_si512(a), b)
            }
        }

        #[inline(always)]
        fn and(self, a: Self::M, b: Self::M) -> Self::M {
            a & b
        }

        #[inline(always)]
        fn bits(self, m: Self::M) -> u16 {
            m
        }

        #[inline(always)]
        fn store_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
            let to: &mut [f32; LANES] = to.first_chunk_mut().expect(SHORT);
            unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), m, x) }
        }

        #[inline(always)]
        fn store_u32(self, to: &mut [u32], m: Self::M, x: u32) {
            let to: &mut [u32; LANES] = to.first_chunk_mut().expect(SHORT);
            unsafe { _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), m, _mm512_set1_epi32(x as i32)) }
        }

        #[inline(always)]
        fn resolve<const TURN: bool>(
            self,
            slots: &[u32; LANES],
            (u, v): (&[f64; LANES], &[f64; LANES]),
            drawn: impl Fn(u32) -> ([f64; 3], u32),
            faces: &mut [u32; LANES],
            depths: &mut [f32; LANES],
        ) {
            // SAFETY: as above; all memory is that of references to arrays of sixteen.
            unsafe {
                let all = _mm512_loadu_epi32(slots.as_ptr().cast());
                let u = [0, 8].map(|k| _mm512_loadu_pd(u.as_ptr().add(k)));
                let v = [0, 8].map(|k| _mm512_loadu_pd(v.as_ptr().add(k)));
                let mut values = [_mm512_setzero_pd(); 2];
                let mut seen = _mm512_setzero_si512();
                // One face after another, on the pixels that see it.
                let mut left = u16::MAX;
                while left != 0 {
                    let slot = slots[left.trailing_zeros() as usize];
                    let these = _mm512_cmpeq_epi32_mask(all, _mm512_set1_epi32(slot as i32));
                    let ([at, across, bend], face) = drawn(slot);
                    seen = _mm512_mask_set1_epi32(seen, these, face as i32);
                    for (k, these) in [these as u8, (these >> 8) as u8].into_iter().enumerate() {
                        let along = _mm512_mul_pd(_mm512_set1_pd(across), u[k]);
                        let mut value = _mm512_add_pd(_mm512_set1_pd(at), along);
                        if TURN {
                            value = _mm512_add_pd(value, _mm512_mul_pd(_mm512_set1_pd(bend), v[k]));
                        }
                        values[k] = _mm512_mask_mov_pd(values[k], these, value);
                    }
                    left &= !these;
                }
                _mm512_storeu_epi32(faces.as_mut_ptr().cast(), seen);
                for (k, value) in values.into_iter().enumerate() {
                    let depth = _mm512_abs_pd(_mm512_div_pd(_mm512_set1_pd(1.0), value));
                    _mm256_storeu_ps(depths.as_mut_ptr().add(8 * k), _mm512_cvtpd_ps(depth));
                }
            }
        }
    }

    /// One or two registers of 256 bits. Made only where the processor is known to have AVX2 and FMA.
    #[derive(Clone, Copy)]
    pub(super) struct Avx2<const R: usize>(());

    /// Registers of a register.
    const WIDE: usize = 8;

    // SAFETY: as above, with `run_avx2` and `run_avx512`; a reference to an array of eight for each register, or a slice
    // of eight times as many as there are registers.
    impl<const R: usize> Registers for Avx2<R> {
        const N: usize = R * WIDE;
        type F = [__m256; R];
        type M = [__m256; R];
        type Half = Avx2<1>;

        #[inline(always)]
        fn half(self) -> Self::Half {
            Avx2(())
        }

        #[inline(always)]
        fn splat(self, x: f32) -> Self::F {
            unsafe { [_mm256_set1_ps(x); R] }
        }

        #[inline(always)]
        fn load(self, from: &[f32]) -> Self::F {
            let from = &from[..Self::N];
            std::array::from_fn(|k| unsafe { _mm256_loadu_ps(from.as_ptr().add(k * WIDE)) })
        }

        #[inline(always)]
        fn add(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_add_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn mul(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_mul_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn min(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_min_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn above(self, a: Self::F, b: Self::F) -> Self::M {
            std::array::from_fn(|k| unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(a[k], b[k]) })
        }

        #[inline(always)]
        fn steps_above(self, a: Self::F, b: Self::F, steps: i32) -> Self::M {
            std::array::from_fn(|k| unsafe {
                let b = _mm256_add_epi32(_mm256_castps_si256(b[k]), _mm256_set1_epi32(steps));
                _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_castps_si256(a[k]), b))
            })
        }

        #[inline(always)]
        fn and(self, a: Self::M, b: Self::M) -> Self::M {
            std::array::from_fn(|k| unsafe { _mm256_and_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn bits(self, m: Self::M) -> u16 {
            (0..R).fold(0, |bits, k| bits | (unsafe { _mm256_movemask_ps(m[k]) } as u16) << (k * WIDE))
        }

        #[inline(always)]
        fn store_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
            let to = &mut to[..Self::N];
            for k in 0..R {
                unsafe {
                    let to = to.as_mut_ptr().add(k * WIDE);
                    _mm256_storeu_ps(to, _mm256_blendv_ps(_mm256_loadu_ps(to), x[k], m[k]));
                }
            }
        }

        #[inline(always)]
        fn store_u32(self, to: &mut [u32], m: Self::M, x: u32) {
            let to = &mut to[..Self::N];
            for (k, m) in m.into_iter().enumerate() {
                unsafe {
                    let to = to.as_mut_ptr().add(k * WIDE).cast();
                    let x = _mm256_castsi256_ps(_mm256_set1_epi32(x as i32));
                    _mm256_storeu_ps(to, _mm256_blendv_ps(_mm256_loadu_ps(to), x, m));
                }
            }
        }
    }
}
