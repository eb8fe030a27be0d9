//! Bits into bytes, lowest first.

/// Appends bits to a vector of bytes.
pub(super) struct BitWriter<'a> {
    out: &'a mut Vec<u8>,
    /// Where the next whole bytes go; what follows in `out` is room.
    end: usize,
    bits: u64,
    count: u32,
}

impl<'a> BitWriter<'a> {
    pub(super) fn new(out: &'a mut Vec<u8>) -> Self {
        let end = out.len();
        Self { out, end, bits: 0, count: 0 }
    }

    /// Has `write` add bits to a writer that nothing else refers to, so that it is kept in registers.
    #[inline(always)]
    pub(super) fn quickly(&mut self, write: impl FnOnce(&mut BitWriter<'_>)) {
        let mut own = BitWriter { out: &mut *self.out, ..*self };
        write(&mut own);
        let BitWriter { end, bits, count, .. } = own;
        (self.end, self.bits, self.count) = (end, bits, count);
    }

    /// Makes room for `bits` more bits.
    pub(super) fn reserve(&mut self, bits: u64) {
        let len = self.end + (bits / 8) as usize + 24;
        if self.out.len() < len {
            self.out.resize(len, 0);
        }
    }

    /// Adds the lowest `count` bits; the others are 0. At most 56 bits may be added between two flushes.
    #[inline(always)]
    pub(super) fn add(&mut self, bits: u64, count: u32) {
        self.bits |= bits << self.count;
        self.count += count;
    }

    /// Stores the whole bytes.
    #[inline(always)]
    pub(super) fn flush(&mut self) {
        self.out[self.end..self.end + 8].copy_from_slice(&self.bits.to_le_bytes());
        self.end += (self.count / 8) as usize;
        // At most 63 bits are there, so the shift is by 56 at most.
        self.bits >>= self.count & !7;
        self.count &= 7;
    }

    /// Fills the last byte with zeros.
    pub(super) fn align(&mut self) {
        self.count = self.count.next_multiple_of(8);
        self.flush();
    }

    /// Whole bytes after an [`align`](Self::align).
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        debug_assert_eq!(self.count, 0);
        self.out[self.end..self.end + bytes.len()].copy_from_slice(bytes);
        self.end += bytes.len();
    }

    /// Ends after whole bytes.
    pub(super) fn finish(mut self) {
        self.align();
        self.out.truncate(self.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
