//! Wrap modes of textures, for coordinates in texels.

/// How a coordinate repeats: every `period`, and mirrored beyond `half` of it. A clamped texture has no
/// period, since its coordinates are brought to the edge when it is read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelWrap {
    pub(crate) divisor: f64,
    pub(crate) period: f64,
    pub(crate) half: f64,
}

impl TexelWrap {
    /// No repetition.
    pub(crate) const NONE: Self = Self { divisor: 1.0, period: 0.0, half: f64::INFINITY };

    pub(crate) fn repeat(period: f64) -> Self {
        Self { divisor: period, period, half: f64::INFINITY }
    }

    pub(crate) fn mirror(half: f64) -> Self {
        Self { divisor: 2.0 * half, period: 2.0 * half, half }
    }

    /// Returns the sign and the shift that bring `value` between 0 and the period, or between 0 and half of a
    /// mirrored period.
    #[inline(always)]
    pub(crate) fn sign_and_shift(self, value: f64) -> (f64, f64) {
        let turn = (value / self.divisor).floor() * self.period;
        if value - turn > self.half {
            (-1.0, turn + self.period)
        } else {
            (1.0, -turn)
        }
    }
}
