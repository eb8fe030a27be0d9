//! The filters of EXT_meshopt_compression and KHR_meshopt_compression: what elements become after they are
//! unpacked.

/// Turns octahedral coordinates into unit vectors: signed bytes, or 16-bit numbers in elements of 8 bytes.
/// The fourth number of an element stays.
pub(crate) fn octahedral(data: &mut [u8], stride: usize) {
    if stride == 4 {
        for [x, y, z, _] in data.as_chunks_mut::<4>().0 {
            let vector = unit_vector([*x, *y, *z].map(|v| f32::from(v as i8)), 127.0);
            [*x, *y, *z] = vector.map(|v| v as u8);
        }
    } else {
        each_short(data, |[x, y, z, w]| {
            let [x, y, z] = unit_vector([x, y, z].map(f32::from), 32767.0);
            [x as i16, y as i16, z as i16, w]
        });
    }
}

/// `one` is the number that stands for 1. The third coordinate is what 1 was when the vector was packed.
fn unit_vector([x, y, one_was]: [f32; 3], one: f32) -> [i32; 3] {
    let z = one_was - x.abs() - y.abs();
    // The lower half of the octahedron is folded out.
    let fold = z.min(0.0);
    let x = x + if x >= 0.0 { fold } else { -fold };
    let y = y + if y >= 0.0 { fold } else { -fold };
    let scale = one / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| rounded(v * scale))
}

/// Turns the three smaller numbers of unit quaternions into all four.
pub(crate) fn quaternions(data: &mut [u8]) {
    each_short(data, |[x, y, z, code]| {
        // The lowest two bits say which number is left out, the others what 1/√2 was.
        let one_was = f32::from(code | 3);
        let [x, y, z] = [x, y, z].map(f32::from);
        let square = one_was * one_was * 2.0 - x * x - y * y - z * z;
        let scale = 32767.0 / std::f32::consts::SQRT_2 / one_was;
        let mut turned = [square.max(0.0).sqrt(), x, y, z].map(|v| rounded(v * scale) as i16);
        turned.rotate_right((code & 3) as usize);
        turned
    });
}

/// Turns numbers of a mantissa of 24 bits and an exponent of 8 into floats.
pub(crate) fn exponential(data: &mut [u8]) {
    for number in data.as_chunks_mut().0 {
        let packed = i32::from_le_bytes(*number);
        let mantissa = (packed << 8) >> 8;
        let power = f32::from_bits(((packed >> 24).wrapping_add(127) as u32) << 23);
        *number = (power * mantissa as f32).to_le_bytes();
    }
}

/// Turns luma and two differences into colours: bytes, or 16-bit numbers in elements of 8 bytes.
pub(crate) fn colors(data: &mut [u8], stride: usize) {
    if stride == 4 {
        for [y, co, cg, a] in data.as_chunks_mut::<4>().0 {
            let packed = [i32::from(*y), i32::from(*co as i8), i32::from(*cg as i8), i32::from(*a)];
            [*y, *co, *cg, *a] = color(packed, 255.0).map(|v| v as u8);
        }
    } else {
        each_short(data, |[y, co, cg, a]| {
            let packed = [i32::from(y as u16), i32::from(co), i32::from(cg), i32::from(a as u16)];
            color(packed, 65535.0).map(|v| v as u16 as i16)
        });
    }
}

/// The highest bit of alpha says what 1 was. The numbers have at most 16 bits, so no sum overflows.
fn color([y, co, cg, a]: [i32; 4], one: f32) -> [i32; 4] {
    let one_was = [1, 2, 4, 8].into_iter().fold(a, |ones, n| ones | ones >> n);
    let alpha = a << 1 & one_was | a & 1;
    let scale = one / one_was as f32;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|v| (v as f32 * scale + 0.5) as i32)
}

fn each_short(data: &mut [u8], turned: impl Fn([i16; 4]) -> [i16; 4]) {
    for element in data.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *element;
        let shorts = turned([[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes));
        let [[a, b], [c, d], [e, f], [g, h]] = shorts.map(i16::to_le_bytes);
        *element = [a, b, c, d, e, f, g, h];
    }
}

/// Rounds to the nearest whole number, halves away from zero. A number that is none becomes 0.
fn rounded(v: f32) -> i32 {
    (v + if v >= 0.0 { 0.5 } else { -0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::gltf::packed::meshopt::tests::hex;

    fn shorts(data: &[u8]) -> Vec<i16> {
        data.as_chunks().0.iter().map(|b| i16::from_le_bytes(*b)).collect()
    }

    /// Packed by meshoptimizer 1.3.0, from npm.
    #[test]
    fn filters_give_vectors_rotations_numbers_and_colours() {
        let vectors =
            [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.6, -0.8, 0.0, 1.0], [-0.48, 0.6, -0.64, 0.0]];
        let near = |found: &[f32], expected: &[f32], most: f32| {
            let is_near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < most);
            assert!(is_near && found.len() == expected.len(), "{found:?} {expected:?}");
        };

        let mut data = hex("00000000ff070000ff07ff07ff0700006d036efbff07ff7fcbfac405ff070000");
        octahedral(&mut data, 8);
        let found: Vec<f32> = shorts(&data).into_iter().map(|v| f32::from(v) / 32767.0).collect();
        near(&found, vectors.as_flattened(), 0.001);
        let mut data = hex("00007f007f7f7f0036b77f7fad5c7f00");
        octahedral(&mut data, 4);
        let found: Vec<f32> = data.iter().map(|v| f32::from(*v as i8) / 127.0).collect();
        near(&found, vectors.as_flattened(), 0.02);

        // A rotation and its opposite are the same.
        let mut data = hex("000000000000ff1f261b00000000ff1fdae400000000fd1fa01660e9a016fc1f");
        quaternions(&mut data);
        let found: Vec<f32> = shorts(&data).into_iter().map(|v| f32::from(v) / 32767.0).collect();
        let expected: [[f32; 4]; 4] =
            [[0.0, 0.0, 0.0, 1.0], [0.6, 0.0, 0.0, 0.8], [0.0, -0.8, 0.6, 0.0], [0.5, 0.5, -0.5, 0.5]];
        for (found, expected) in found.chunks(4).zip(expected) {
            let dot: f32 = found.iter().zip(expected).map(|(a, b)| a * b).sum();
            assert!(dot.abs() > 0.9999, "{found:?} {expected:?}");
        }

        let mut data = hex("000000f3002000f300d8fff4040000f4");
        exponential(&mut data);
        let found: Vec<f32> = data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        near(&found, &[0.0, 1.0, -2.5, 0.001], 0.0001);

        let expected = [1.0, 0.0, 0.0, 1.0, 0.25, 0.5, 0.75, 0.5];
        let mut data = hex("0010ff1f01f0ff3f002001f000000030");
        colors(&mut data, 8);
        let found: Vec<f32> = shorts(&data)
            .into_iter()
            .map(|v| f32::from(v as u16) / 65535.0)
            .collect();
        near(&found, &expected, 0.001);
        let mut data = hex("407fc1ff80c100c0");
        colors(&mut data, 4);
        let found: Vec<f32> = data.iter().map(|v| f32::from(*v) / 255.0).collect();
        near(&found, &expected, 0.02);
    }

    #[test]
    fn any_numbers_do_no_harm() {
        for seed in 0..=u16::MAX {
            let mut data: Vec<u8> = seed.to_le_bytes().repeat(4);
            octahedral(&mut data, 4);
            colors(&mut data, 4);
            quaternions(&mut data);
            exponential(&mut data);
            octahedral(&mut data, 8);
            colors(&mut data, 8);
        }
    }
}
