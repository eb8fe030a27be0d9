//! Noise and colour arithmetic for the textures; the same on every platform.

/// A number in [0, 1) that looks random, for a place on a lattice.
pub(crate) fn hash(x: u32, y: u32, seed: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    for factor in [0x7feb_352d, 0x846c_a68b] {
        h = (h ^ (h >> 15)).wrapping_mul(factor);
    }
    ((h ^ (h >> 16)) >> 8) as f32 / (1 << 24) as f32
}

/// Smooth noise in [0, 1): lattice values blended; repeats every `period` cells in x and y.
pub(crate) fn value(x: f32, y: f32, period: u32, seed: u32) -> f32 {
    let xf = x.floor();
    let yf = y.floor();
    let x0 = wrapped(xf, period);
    let x1 = wrapped(xf + 1.0, period);
    let y0 = wrapped(yf, period);
    let y1 = wrapped(yf + 1.0, period);
    let fx = smooth(x - xf);
    let fy = smooth(y - yf);
    let row = |y| hash(x0, y, seed) * (1.0 - fx) + hash(x1, y, seed) * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

fn wrapped(v: f32, period: u32) -> u32 {
    (v as i64).rem_euclid(i64::from(period)) as u32
}

/// Four octaves of [`value`], in [0, 1); repeats every `period` units.
pub(crate) fn fractal(x: f32, y: f32, period: u32, seed: u32) -> f32 {
    (0..4)
        .map(|k| {
            let n = 1 << k;
            value(x * n as f32, y * n as f32, period * n, seed + k) / (2 * n) as f32
        })
        .sum::<f32>()
        / 0.9375
}

/// 0 below 0, 1 above 1, smooth in between.
pub(crate) fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// From `a` (`t` = 0) to `b` (`t` = 1).
pub(crate) fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// `color` brighter by `amount` of 255.
pub(crate) fn tint(color: [f32; 3], amount: f32) -> [f32; 3] {
    color.map(|c| c + amount)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_and_stays_in_range() {
        for i in 0..500 {
            let x = i as f32 * 0.37;
            let y = i as f32 * 0.91;
            for f in [value, fractal] {
                let v = f(x, y, 4, 3);
                assert!((0.0..1.0).contains(&v));
                assert!((v - f(x + 4.0, y - 4.0, 4, 3)).abs() < 1e-3);
            }
        }
        let mean = (0..4096).map(|i| hash(i % 64, i / 64, 1)).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.03, "{mean}");
    }
}
