//! Writes bits into bytes, lowest first.

/// Up to 48 bits and their number in one word. The number is in the lowest byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits(u64);

impl Bits {
    /// Makes `count` bits from `value`, whose other bits are 0.
    #[inline(always)]
    pub(crate) const fn new(value: u64, count: u32) -> Self {
        Self(value << 8 | count as u64)
    }

    /// Returns these bits followed by `next`.
    #[inline(always)]
    pub(crate) fn then(self, next: Self) -> Self {
        let count = (self.0 & 0xff) + (next.0 & 0xff);
        Self((self.value() | next.value() << self.shift()) << 8 | count)
    }

    #[inline(always)]
    fn value(self) -> u64 {
        self.0 >> 8
    }

    /// Returns the number of bits, for a shift.
    #[inline(always)]
    fn shift(self) -> u64 {
        self.0 & 0x3f
    }
}

/// The largest number of bits that may be added between two flushes.
const MOST: u64 = 56;

/// Appends bits to a vector of bytes.
pub(crate) struct BitWriter<'a> {
    out: &'a mut Vec<u8>,
    /// The place of the next whole byte. The bytes of `out` from there on are room to write.
    end: usize,
    bits: u64,
    count: u32,
}

impl<'a> BitWriter<'a> {
    pub(crate) fn new(out: &'a mut Vec<u8>) -> Self {
        let end = out.len();
        Self { out, end, bits: 0, count: 0 }
    }

    /// Makes room for `bits` more bits.
    pub(crate) fn reserve(&mut self, bits: u64) {
        let len = self.end + (bits / 8) as usize + 24;
        if self.out.len() < len {
            self.out.resize(len, 0);
        }
    }

    /// Adds `count` bits; the other bits of `bits` are 0. At most [`MOST`] bits may be added between two
    /// flushes.
    #[inline(always)]
    pub(crate) fn add(&mut self, bits: u64, count: u32) {
        self.bits |= bits << self.count;
        self.count += count;
    }

    /// Adds bits like [`add`](Self::add).
    pub(crate) fn append(&mut self, bits: Bits) {
        self.add(bits.value(), bits.shift() as u32);
    }

    /// Stores the whole bytes, and keeps the other bits.
    #[inline(always)]
    pub(crate) fn flush(&mut self) {
        self.out[self.end..self.end + 8].copy_from_slice(&self.bits.to_le_bytes());
        self.end += (self.count / 8) as usize;
        // There are at most 63 bits, so the shift is at most 56.
        self.bits >>= self.count & !7;
        self.count &= 7;
    }

    /// Adds the bits in `table` for each of `indices`, modulo its length. The caller has made room. `FIT`
    /// says that any four entries have at most [`MOST`] bits together.
    #[inline(always)]
    pub(crate) fn add_all<I: Copy + Into<usize>, const N: usize, const FIT: bool>(
        &mut self,
        indices: &[[I; 4]],
        table: &[Bits; N],
    ) {
        // Local copies stay in registers. As far as the compiler knows, a write to `out` could change the
        // fields.
        let out = self.out.as_mut_slice();
        let mut end = self.end;
        let mut bits = self.bits;
        let mut count = u64::from(self.count);

        for four in indices {
            // Four entries are joined in pairs first, since each addition to `bits` waits for the one before.
            let [a, b, c, d] = four.map(|i| table[i.into() % N]);
            let first = a.value() | b.value() << a.shift();
            let second = c.value() | d.value() << c.shift();
            let n = a.0 + b.0;
            let more = c.0 + d.0;
            let mut value = first | second << (n & 0x3f);
            let mut sum = (n + more) & 0xff;

            if !FIT && sum > MOST {
                bits |= first << count;
                count += n & 0xff;
                out[end..end + 8].copy_from_slice(&bits.to_le_bytes());
                end += (count / 8) as usize;
                bits >>= count & 0x38;
                count &= 7;
                value = second;
                sum = more & 0xff;
            }

            bits |= value << count;
            count += sum;
            out[end..end + 8].copy_from_slice(&bits.to_le_bytes());
            end += (count / 8) as usize;
            // There are at most 63 bits, so the shift is at most 56.
            bits >>= count & 0x38;
            count &= 7;
        }

        self.end = end;
        self.bits = bits;
        self.count = count as u32;
    }

    /// Fills up the last byte with zeros.
    pub(crate) fn align(&mut self) {
        self.count = self.count.next_multiple_of(8);
        self.flush();
    }

    /// Adds whole bytes. The writer must be [aligned](Self::align).
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        debug_assert_eq!(self.count, 0);
        self.out[self.end..self.end + bytes.len()].copy_from_slice(bytes);
        self.end += bytes.len();
    }

    /// Fills up the last byte, and cuts off the unused room.
    pub(crate) fn finish(mut self) {
        self.align();
        self.out.truncate(self.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::array::from_fn;

    #[test]
    fn bits_come_lowest_first_and_bytes_after_whole_bytes() {
        let mut bytes = vec![7];
        let mut out = BitWriter::new(&mut bytes);
        out.reserve(100);
        out.add(0b1, 1);
        out.add(0b10, 2);
        out.add(0xffff_ffff_ffff, 48);
        out.flush();
        out.add(0, 3);
        out.align();
        out.bytes(&[1, 2]);
        out.add(0b11, 2);
        out.finish();
        assert_eq!(bytes, [7, 0b1111_1101, 255, 255, 255, 255, 255, 0b111, 1, 2, 0b11]);
    }

    #[test]
    fn bits_of_a_table_are_those_that_are_added_one_by_one() {
        // Entries of 0 to 28 bits: four of the longest are too many for one step.
        let table: [Bits; 32] = from_fn(|i| {
            let count = (3 * i as u32).min(28);
            Bits::new(0x5_a5a5_a5a5_u64.rotate_left(i as u32) & ((1 << count) - 1), count)
        });
        let indices: Vec<[u16; 4]> = (0..1000u32)
            .map(|i| from_fn(|k| (i.wrapping_mul(2_654_435_761) >> (6 * k)) as u16))
            .collect();

        let mut bytes = vec![];
        let mut out = BitWriter::new(&mut bytes);
        out.reserve(4000 * 28);
        out.add(1, 3);
        out.add_all::<_, _, false>(&indices, &table);
        out.finish();

        let mut expected = vec![];
        let mut plain = BitWriter::new(&mut expected);
        plain.reserve(4000 * 28);
        plain.add(1, 3);
        for &i in indices.as_flattened() {
            plain.append(table[usize::from(i) % 32]);
            plain.flush();
        }
        plain.finish();
        assert_eq!(bytes, expected);
        let joined = Bits::new(0b101, 3).then(Bits::new(0b01, 2));
        assert_eq!((joined, joined.value(), joined.shift()), (Bits::new(0b01101, 5), 0b01101, 5));
    }
}
