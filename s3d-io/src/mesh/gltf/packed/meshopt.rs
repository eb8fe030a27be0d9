//! Unpacks the streams of EXT_meshopt_compression and KHR_meshopt_compression. Source: the specifications of
//! these extensions, which define every bit.
//!
//! It is written here because no crate fits. meshopt binds the C++ library, and asks for a compiler of it.
//! meshopt-rs was ported in 2022 and has seen no change since: it lacks the streams of version 1 and the
//! filter of colours.
//!
//! A stream may hold any bytes. Nothing here panics on them, and memory grows with what was unpacked: at most
//! 1,024 times the stream. A fault is `None`, because a stream has no place that would say more.

/// The most bytes of an element.
pub(crate) const MAX_STRIDE: usize = 256;

/// Elements of a column that are packed together.
const GROUP: usize = 16;
/// The most elements of a block.
const MAX_BLOCK: usize = 256;
/// The most bytes of a block.
const MAX_BLOCK_BYTES: usize = 8192;
/// Bytes behind the codes of triangles.
const TABLE: usize = 16;

/// Unpacks `count` elements of `stride` bytes, a multiple of 4 up to [`MAX_STRIDE`]. Returns their bytes.
///
/// Each byte of an element is a column. A block has the columns of up to 256 elements, and a column has the
/// differences from one element to the next.
pub(crate) fn attributes(mut data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let version = match data.split_off_first()? {
        0xa0 => 0,
        0xa1 => 1,
        _ => return None,
    };

    if stride == 0 || stride > MAX_STRIDE || !stride.is_multiple_of(4) {
        return None;
    }

    // The tail has the element before the first, and the kind of each lane.
    let tail = if version == 0 { stride } else { stride + stride / 4 };
    let padded = tail.max(if version == 0 { 32 } else { 24 });
    let mut body = data.split_off(..data.len().checked_sub(padded)?)?;
    let (first, kinds) = data.get(padded - tail..)?.split_at_checked(stride)?;
    let mut last = first.as_chunks().0.to_vec();

    let block = (MAX_BLOCK_BYTES / stride / GROUP * GROUP).min(MAX_BLOCK);
    let mut out = Vec::new();
    let mut left = count;
    while left > 0 {
        let elements = left.min(block);
        unpack_block(&mut body, elements, &mut last, kinds, version, &mut out)?;
        left -= elements;
    }
    body.is_empty().then_some(out)
}

/// Unpacks the next block to the end of `out`. `last` has the element before it, in lanes of four bytes, and
/// gets the last of the block. `kinds` says how the lanes were made differences, from version 1 on.
fn unpack_block(
    body: &mut &[u8],
    elements: usize,
    last: &mut [[u8; 4]],
    kinds: &[u8],
    version: u8,
    out: &mut Vec<u8>,
) -> Option<()> {
    let controls = if version == 0 {
        &[][..]
    } else {
        body.split_off(..last.len())?
    };
    let stride = last.len() * 4;
    let start = out.len();
    out.resize(start + elements * stride, 0);
    let block = out.get_mut(start..)?;

    let mut deltas = [[0; 4]; MAX_BLOCK];
    for (lane, value) in last.iter_mut().enumerate() {
        let control = controls.get(lane).copied().unwrap_or(0);
        for byte in 0..4 {
            let mut column = [0; MAX_BLOCK];
            let column = column.get_mut(..elements.next_multiple_of(GROUP))?;
            match (version, control >> (2 * byte) & 3) {
                (0, _) => unpack_groups(body, [0, 2, 4, 8], column)?,
                (_, 0) => unpack_groups(body, [0, 1, 2, 4], column)?,
                (_, 1) => unpack_groups(body, [1, 2, 4, 8], column)?,
                // All zeros.
                (_, 2) => {}
                _ => column.get_mut(..elements)?.copy_from_slice(body.split_off(..elements)?),
            }
            for (delta, byte_of_column) in deltas.iter_mut().zip(column) {
                *delta.get_mut(byte)? = *byte_of_column;
            }
        }

        let kind = kinds.get(lane).copied().unwrap_or(0);
        for (delta, element) in deltas.iter().zip(block.chunks_exact_mut(stride)) {
            *value = add(*value, *delta, kind)?;
            *element.as_chunks_mut().0.get_mut(lane)? = *value;
        }
    }
    Some(())
}

/// Adds a difference to four bytes: as bytes, as 16-bit numbers, or as flipped bits of a 32-bit number.
fn add(value: [u8; 4], delta: [u8; 4], kind: u8) -> Option<[u8; 4]> {
    match kind & 3 {
        0 => {
            let [a, b, c, d] = value;
            let [e, f, g, h] = delta;
            Some([(a, e), (b, f), (c, g), (d, h)].map(|(value, delta)| {
                let delta = delta >> 1 ^ (delta & 1).wrapping_neg();
                value.wrapping_add(delta)
            }))
        }
        1 => {
            let [a, b, c, d] = value;
            let [e, f, g, h] = delta;
            let [[a, b], [c, d]] = [([a, b], [e, f]), ([c, d], [g, h])].map(|(value, delta)| {
                let delta = u16::from_le_bytes(delta);
                let delta = delta >> 1 ^ (delta & 1).wrapping_neg();
                u16::from_le_bytes(value).wrapping_add(delta).to_le_bytes()
            });
            Some([a, b, c, d])
        }
        2 => {
            let delta = u32::from_le_bytes(delta).rotate_right(u32::from(kind >> 4));
            Some((u32::from_le_bytes(value) ^ delta).to_le_bytes())
        }
        _ => None,
    }
}

/// Unpacks a column. The head has two bits for each group, which choose among `widths`.
fn unpack_groups(body: &mut &[u8], widths: [usize; 4], column: &mut [u8]) -> Option<()> {
    let groups = column.as_chunks_mut::<GROUP>().0;
    let head = body.split_off(..groups.len().div_ceil(4))?;
    for (four, head) in groups.chunks_mut(4).zip(head) {
        for (n, group) in four.iter_mut().enumerate() {
            let choice = head >> (2 * n) & 3;
            unpack_group(body, *widths.get(usize::from(choice))?, group)?;
        }
    }
    Some(())
}

/// Unpacks a group of numbers of `width` bits. The largest stands for a byte that follows the group.
fn unpack_group(body: &mut &[u8], width: usize, group: &mut [u8; GROUP]) -> Option<()> {
    match width {
        0 => group.fill(0),
        8 => group.copy_from_slice(body.split_off(..GROUP)?),
        // The lowest bit of a byte is the first.
        1 => {
            let packed = body.split_off(..2)?;
            for (byte, packed) in group.chunks_mut(8).zip(packed) {
                for (n, byte) in byte.iter_mut().enumerate() {
                    *byte = number(body, packed >> n & 1, 1)?;
                }
            }
        }
        // The highest bits are the first.
        _ => {
            let packed = body.split_off(..GROUP * width / 8)?;
            let largest = (1 << width) - 1;
            for (bytes, packed) in group.chunks_mut(8 / width).zip(packed) {
                for (n, byte) in bytes.iter_mut().enumerate() {
                    let shift = 8 - width * (n + 1);
                    *byte = number(body, packed >> shift & largest, largest)?;
                }
            }
        }
    }
    Some(())
}

/// Returns a number of a group. The largest one is followed by what it stands for.
fn number(body: &mut &[u8], packed: u8, largest: u8) -> Option<u8> {
    if packed == largest {
        body.split_off_first().copied()
    } else {
        Some(packed)
    }
}

/// The last 16 things that a stream of triangles may point back to.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(nothing: T) -> Self {
        Self { items: [nothing; 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        if let Some(slot) = self.items.get_mut(self.next & 15) {
            *slot = item;
        }
        self.next = self.next.wrapping_add(1);
    }

    /// Returns the item that was pushed `back` items before the last one.
    #[expect(clippy::indexing_slicing, reason = "16 items, and a number below 16")]
    fn back(&self, back: u8) -> T {
        self.items[self.next.wrapping_sub(1 + usize::from(back)) & 15]
    }
}

/// The state of a stream of triangles.
struct Triangles<'a> {
    data: &'a [u8],
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// The least vertex that no triangle had.
    next: u32,
    /// The vertex that was written last as a difference.
    last: u32,
}

/// Unpacks `count` corners of triangles. Returns the vertex of each.
pub(crate) fn triangles(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
    let version = match data.split_off_first()? {
        0xe0 => 0,
        0xe1 => 1,
        _ => return None,
    };
    if !count.is_multiple_of(3) {
        return None;
    }
    let codes = data.split_off(..count / 3)?;
    let body = data.split_off(..data.len().checked_sub(TABLE)?)?;
    let pairs = data;

    let mut state = Triangles {
        data: body,
        edges: Recent::new([u32::MAX; 2]),
        vertices: Recent::new(u32::MAX),
        next: 0,
        last: 0,
    };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        let triangle = match code {
            0..0xf0 => state.beside_an_edge(code, if version == 0 { 15 } else { 13 })?,
            0xf0..0xfe => {
                let pair = *pairs.get(usize::from(code & 15))?;
                // Only a pair beside the codes may have vertices that are written as differences.
                if pair >> 4 == 15 || pair & 15 == 15 {
                    return None;
                }
                state.alone(true, pair)?
            }
            _ => {
                let pair = *state.data.split_off_first()?;
                if pair == 0 {
                    state.next = 0;
                }
                state.alone(code == 0xfe, pair)?
            }
        };
        out.extend(triangle);
    }
    state.data.is_empty().then_some(out)
}

impl Triangles<'_> {
    /// Unpacks a triangle that has an edge of an earlier one. Codes from `first_written` on say that its
    /// third vertex is beside the one that was written last, or is written itself.
    fn beside_an_edge(&mut self, code: u8, first_written: u8) -> Option<[u32; 3]> {
        let [a, b] = self.edges.back(code >> 4);
        let third = code & 15;
        let c = if third == 0 {
            self.take_next()
        } else if third < first_written {
            self.vertices.back(third)
        } else {
            match third {
                13 => self.last = self.last.wrapping_sub(1),
                14 => self.last = self.last.wrapping_add(1),
                _ => self.read_written()?,
            }
            self.last
        };

        if third == 0 || third >= first_written {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Some([a, b, c])
    }

    /// Unpacks a triangle that shares no edge. `pair` says where its second and third vertices are.
    fn alone(&mut self, first_is_next: bool, pair: u8) -> Option<[u32; 3]> {
        let second = pair >> 4;
        let third = pair & 15;
        let a = self.vertex(if first_is_next { 0 } else { 15 })?;
        let b = self.vertex(second)?;
        let c = self.vertex(third)?;

        self.vertices.push(a);
        for (code, vertex) in [(second, b), (third, c)] {
            if code == 0 || code == 15 {
                self.vertices.push(vertex);
            }
        }
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Some([a, b, c])
    }

    fn vertex(&mut self, code: u8) -> Option<u32> {
        match code {
            0 => Some(self.take_next()),
            15 => {
                self.read_written()?;
                Some(self.last)
            }
            _ => Some(self.vertices.back(code - 1)),
        }
    }

    fn take_next(&mut self) -> u32 {
        let next = self.next;
        self.next = next.wrapping_add(1);
        next
    }

    /// Reads a vertex that is written as its difference from the last of these.
    fn read_written(&mut self) -> Option<()> {
        self.last = self.last.wrapping_add(signed(varint(&mut self.data)?));
        Some(())
    }
}

/// Unpacks `count` vertex indices of any order.
pub(crate) fn indices(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
    if !matches!(data.split_off_first()?, 0xd0 | 0xd1) {
        return None;
    }
    let mut body = data.split_off(..data.len().checked_sub(4)?)?;
    // An index has at least a byte.
    if count > body.len() {
        return None;
    }

    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let code = varint(&mut body)?;
        let last = last.get_mut((code & 1) as usize)?;
        *last = last.wrapping_add(signed(code >> 1));
        out.push(*last);
    }
    body.is_empty().then_some(out)
}

/// Reads a number in groups of 7 bits, at most 5 of them.
fn varint(data: &mut &[u8]) -> Option<u32> {
    let mut number = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = *data.split_off_first()?;
        number |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    Some(number)
}

/// Returns a signed difference whose sign is its lowest bit.
fn signed(code: u32) -> u32 {
    code >> 1 ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn hex(text: &str) -> Vec<u8> {
        let digits = text.as_bytes().as_chunks::<2>().0;
        digits
            .iter()
            .map(|d| u8::from_str_radix(std::str::from_utf8(d).unwrap(), 16).unwrap())
            .collect()
    }

    // The streams below are by meshoptimizer 1.3.0 from npm and its Python module 0.2.30.

    const INDICES: &str = "d11404169103051cad88110400c1a90700000000";
    const TRIANGLES: &str = "e1f01010fffeff1fff88ff12010100ff7e020224ffa403cd04b6cf2400\
                             7687566778a9866589689801690000";
    const VERSION_0: &str = "a007001030507090b0d0f0efcfaf8f6f4f2fff0000000f10305007001434547494b4d4f4\
                             ebcbab8b6b4b2bff0000000b14345407001838587898b8d8f8e7c7a787674727ff000000\
                             0718385807001c3c5c7c9cbcdcfce3c3a383634323ff000000031c3c5c05088888888800\
                             000005088888888800000005088888888800000005088888888800000000000000000000\
                             00000000000000000000000000000000000000000100000000";
    /// With columns in groups of 0, 1, 2 and 4 bits and groups of 1, 2, 4 and 8.
    const LEVEL_0: &str = "a1555503001030507090b0d0f0efcfaf8f6f4f2f0f000f10305003001434547494b4d4f4e\
                           bcbab8b6b4b2b0f000b14345403001838587898b8d8f8e7c7a7876747270f000718385803\
                           001c3c5c7c9cbcdcfce3c3a3836343230f00031c3c5c05088888888800000005088888888\
                           8000000050888888888000000050888888888000000000000000000000000000000000000\
                           000001000000000000";
    /// With columns that are not packed.
    const LEVEL_3: &str = "a1ff55001030507090b0d0f0efcfaf8f6f4f2f0f103050001434547494b4d4f4ebcbab8b6\
                           b4b2b0b143454001838587898b8d8f8e7c7a78767472707183858001c3c5c7c9cbcdcfce3\
                           c3a383634323031c3c5c05088888888800000005088888888800000005088888888800000\
                           0050888888888000000000000000000000000000000000000000001000000000000";

    /// What the three streams of attributes hold.
    fn elements() -> Vec<u8> {
        (0u32..160)
            .map(|i| {
                if i % 8 < 4 {
                    ((i * i) >> 3) as u8
                } else {
                    (i >> 4) as u8
                }
            })
            .collect()
    }

    #[test]
    fn indices_of_any_order() {
        let expected = [5, 6, 0, 100, 101, 7, 70_000, 8, 8, 100_000];
        assert_eq!(indices(&hex(INDICES), 10).unwrap(), expected);
        assert_eq!(indices(&hex("d1040404d10f0400000000"), 5).unwrap(), [1, 2, 3, 500, 4]);
    }

    #[test]
    fn triangles_with_every_kind_of_corner() {
        let expected = [
            [0, 1, 2],
            [2, 1, 3],
            [3, 1, 4],
            [9, 8, 7],
            [0, 1, 2],
            [70, 71, 72],
            [72, 71, 90],
            [300, 5, 300_000],
            // The encoder turned it.
            [0, 2, 1],
        ];
        assert_eq!(triangles(&hex(TRIANGLES), 27).unwrap(), expected.concat());

        // Corners one before and one after the last that was written. Version 0 has no codes for them.
        let expected = [
            [100, 200, 300],
            [300, 200, 301],
            [301, 200, 302],
            [500, 600, 700],
            [700, 600, 699],
            [699, 600, 698],
            [0, 1, 2],
            [0, 2, 1],
        ];
        for stream in [
            "e1ff1e1eff1d1df001ffc801c801c801ff8c03c801c801007687566778a9866589689801690000",
            "e0ff1f1fff1f1ff001ffc801c801c8010202ff8c03c801c8010101007687566778a9866589689801690000",
        ] {
            assert_eq!(triangles(&hex(stream), 24).unwrap(), expected.concat());
        }
        assert_eq!(triangles(&hex(TRIANGLES), 24), None);
        assert_eq!(triangles(&hex(TRIANGLES), 26), None);
    }

    #[test]
    fn attributes_of_both_versions() {
        for stream in [VERSION_0, LEVEL_0, LEVEL_3] {
            assert_eq!(attributes(&hex(stream), 20, 8).unwrap(), elements(), "{stream}");
        }
        assert_eq!(attributes(&hex(VERSION_0), 20, 4), None);
        for stride in [0, 2, 6, 260, usize::MAX] {
            assert_eq!(attributes(&hex(VERSION_0), 20, stride), None, "{stride}");
        }
    }

    #[test]
    fn differences_of_16_and_32_bits() {
        let stream = "a1770058585858585858585858585858585858585858052aaaaaaaaa000000004fef8f2fcf6f0faf4f\
                      ef8f2fcf6f0faf4fef8f0200012234455677890f00090a0a0b0000000000000000000000000000000000\
                      00000000ffff01";
        let expected: Vec<u8> = (0u16..20)
            .flat_map(|i| [i * 300, 65535u16.wrapping_sub(i.wrapping_mul(i).wrapping_mul(40))])
            .flat_map(u16::to_le_bytes)
            .collect();
        assert_eq!(attributes(&hex(stream), 20, 4).unwrap(), expected);

        let stream = "a1b905155555555500000000081808380818087808180838081808f808180800000000000000000000\
                      0000000000000000000000803f12";
        let expected: Vec<u8> = (0u8..20)
            .map(|i| (1.0 + f32::from(i) / 32.0) * if i % 2 == 0 { 1.0 } else { -1.0 })
            .flat_map(f32::to_le_bytes)
            .collect();
        assert_eq!(attributes(&hex(stream), 20, 4).unwrap(), expected);
    }

    /// Any byte may be another, and any stream may end anywhere.
    #[test]
    fn damaged_streams_do_no_harm() {
        let read = |data: &[u8]| {
            for count in [0, 3, 10, 20, 27, usize::MAX / 3 * 3] {
                let _ = (triangles(data, count), indices(data, count));
                for stride in [4, 8, 256] {
                    let _ = attributes(data, count, stride);
                }
            }
        };
        for stream in [INDICES, TRIANGLES, VERSION_0, LEVEL_0, LEVEL_3] {
            let whole = hex(stream);
            for length in 0..whole.len() {
                read(&whole[..length]);
                for byte in [0, 0x55, 0xaa, 0xff] {
                    let mut damaged = whole.clone();
                    damaged[length] = byte;
                    read(&damaged);
                }
            }
            assert_eq!(attributes(&whole[..whole.len() - 1], 20, 8), None);
        }
    }

    /// A stream of zeros in version 1 has a byte for 256 elements of four bytes.
    #[test]
    fn zeros_are_small() {
        let blocks = 1000;
        let stream = [&[0xa1][..], &vec![0xaa; blocks], &[0; 24]].concat();
        let bytes = attributes(&stream, blocks * 256, 4).unwrap();
        assert_eq!(bytes, vec![0; blocks * 1024]);
    }
}
