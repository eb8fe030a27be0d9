//! Wider registers where the processor has them.

/// Work whose loops the compiler may vectorise. `run` and what it calls in its loops are `#[inline(always)]`, so that
/// they are compiled once for any processor of the target and once for one with AVX2.
pub(crate) trait Work {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs `work`, compiled for AVX2 if the processor has it: registers of eight `f32` instead of four double the speed of
/// the rays. The answer is the same, as no rounding depends on the width.
pub(crate) fn run<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which was just asked.
        #[allow(unsafe_code)]
        return unsafe { run_avx2(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<W: Work>(work: W) -> W::Output {
    work.run()
}
