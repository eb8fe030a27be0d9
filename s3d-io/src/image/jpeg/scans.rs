//! Follows the scans of a JPEG, symbol by symbol, without making a picture of them.
//!
//! The decoder draws something for any data. Here every fault is found that libjpeg warns of: a code that is
//! in no table, data that end too early or too late, restart marks that are missing or out of order. Beyond
//! that, more than 64 coefficients of a block are one, and values that no picture has. Source: ITU-T T.81,
//! annexes B, F and G.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::image::jpeg::bits::{Bits, HuffmanTable};

/// The most zeros behind the last row that some cameras fill up with.
const MAX_PADDING: usize = 16;

/// Why a scan cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// Its data are damaged.
    Damaged,
    /// It is of a kind that is not followed here.
    Unknown,
}

/// What is damaged in a JPEG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Damage {
    /// The data end, or make no sense, in this row of pixels.
    Row(usize),
    /// The data of a progressive picture end, or make no sense, when all of its rows are there coarsely.
    Coarse,
    /// Data are left behind the last row.
    TooLong,
    /// Whole components are missing, such as a colour.
    MissingComponents,
}

/// Returns what is damaged in the scans of a JPEG. `None` if nothing is, or if it is of a kind that is not
/// followed here.
pub(super) fn damage(bytes: &[u8]) -> Option<Damage> {
    let mut picture = Picture::default();
    let mut at: usize = 2;
    loop {
        let (mark, after) = match bytes.get(at..) {
            // A byte of ones fills up, and zeros or other bytes between segments are passed over.
            Some([0xff, 0xff, ..]) => (0, 1),
            Some([0xff, mark, ..]) => (*mark, 2),
            Some([_, ..]) => (0, 1),
            Some([]) | None => return picture.is_incomplete(false),
        };
        at = at.saturating_add(after);
        match mark {
            0x00 | 0x01 | 0xd0..=0xd8 => continue,
            0xd9 => return picture.is_incomplete(true),
            _ => {}
        }

        let rest = bytes.get(at..).unwrap_or_default();
        let length = rest
            .first_chunk()
            .map_or(2, |length| usize::from(u16::from_be_bytes(*length)));
        let Some(segment) = rest.get(2..length) else { return picture.is_incomplete(false) };
        at = at.saturating_add(length);
        match mark {
            0xc0..=0xc2 => picture.read_frame(segment, mark == 0xc2)?,
            0xc4 => picture.read_tables(segment)?,
            0xdb => picture.read_steps(segment)?,
            0xdd => picture.restart_every = usize::from(u16::from_be_bytes(*segment.first_chunk()?)),
            0xda => {
                let scan = picture.read_scan(segment)?;
                match picture.follow(&scan, bytes, at) {
                    Ok(next) => at = next,
                    Err((Fault::Unknown, _)) => return None,
                    Err((Fault::Damaged, Damage::Row(_))) if picture.is_coarse() => {
                        return Some(Damage::Coarse);
                    }
                    Err((Fault::Damaged, damage)) => return Some(damage),
                }
            }
            // Other frames are arithmetic, lossless or hierarchical. 0xdc tells the height late.
            0xc3 | 0xc5..=0xcf | 0xdc => return None,
            _ => {}
        }
    }
}

/// A component of the picture, such as its brightness.
#[derive(Default)]
struct Component {
    id: u8,
    /// The number of its blocks in a unit of all components, across and down.
    across: usize,
    down: usize,
    /// The table that its values are multiplied by.
    steps: u8,
    /// For each block of a progressive picture, a bit for each coefficient that is not 0.
    set: Vec<u64>,
    /// For each coefficient, how many of its last bits are not told yet; 255 for all.
    untold: Vec<u8>,
}

/// What the segments up to a scan say.
#[derive(Default)]
struct Picture {
    width: usize,
    height: usize,
    /// The largest number of blocks of a component in a unit, across and down.
    largest: [usize; 2],
    /// The number of units of all components, across and down.
    units: [usize; 2],
    is_progressive: bool,
    components: Vec<Component>,
    /// The tables of the first coefficients, and those of the others.
    tables: [[Option<HuffmanTable>; 4]; 2],
    /// What the first coefficients are multiplied by.
    steps: [i32; 4],
    /// How many units there are between restart marks; 0 without.
    restart_every: usize,
}

/// The head of a scan.
struct Scan {
    /// The components, each with its two tables.
    parts: Vec<(usize, [usize; 2])>,
    /// The first and the last coefficient of the scan.
    first: u32,
    last: u32,
    /// The number of last bits that earlier scans left out, 0 for none, and that this one leaves out.
    high: u32,
    low: u32,
}

/// What is known while a scan is followed.
struct State<'a> {
    bits: Bits<'a>,
    /// The last value of the first coefficient, for each component.
    before: [i32; 4],
    /// How many blocks follow that have nothing in this scan.
    empty: u32,
}

impl Picture {
    fn read_frame(&mut self, segment: &[u8], is_progressive: bool) -> Option<()> {
        let (&[precision, h0, h1, w0, w1, count], parts) = segment.split_first_chunk()?;
        if precision != 8 || !self.components.is_empty() || count > 4 {
            return None;
        }
        self.is_progressive = is_progressive;
        self.height = usize::from(u16::from_be_bytes([h0, h1]));
        self.width = usize::from(u16::from_be_bytes([w0, w1]));
        for [id, factors, steps] in parts.as_chunks().0.iter().take(usize::from(count)) {
            let [across, down] = [factors >> 4, factors & 15].map(usize::from);
            if !(1..=4).contains(&across) || !(1..=4).contains(&down) {
                return None;
            }
            let untold = vec![u8::MAX; 64];
            let component = Component { id: *id, across, down, steps: *steps, set: Vec::new(), untold };
            self.components.push(component);
        }

        let across = self.components.iter().map(|component| component.across).max();
        let down = self.components.iter().map(|component| component.down).max();
        self.largest = [across?, down?];
        let [across, down] = self.largest.map(|blocks| blocks.saturating_mul(8));
        self.units = [self.width.div_ceil(across), self.height.div_ceil(down)];

        if is_progressive {
            let [columns, rows] = self.units;
            for component in &mut self.components {
                let blocks = columns
                    .checked_mul(component.across)?
                    .checked_mul(rows)?
                    .checked_mul(component.down)?;
                component.set = vec![0; blocks];
            }
        }
        (self.width > 0 && self.height > 0).then_some(())
    }

    fn read_tables(&mut self, mut segment: &[u8]) -> Option<()> {
        while let Some((&[kind], rest)) = segment.split_first_chunk() {
            let (counts, rest) = rest.split_first_chunk::<16>()?;
            let count: usize = counts.iter().copied().map(usize::from).sum();
            let (symbols, rest) = rest.split_at_checked(count)?;
            let slot = self.tables.get_mut(usize::from(kind >> 4))?;
            *slot.get_mut(usize::from(kind & 15))? = Some(HuffmanTable::new(counts, symbols));
            segment = rest;
        }
        Some(())
    }

    fn read_steps(&mut self, mut segment: &[u8]) -> Option<()> {
        while let Some((&[kind], rest)) = segment.split_first_chunk() {
            let is_wide = kind >> 4 != 0;
            let first = match rest {
                [high, low, ..] if is_wide => i32::from(u16::from_be_bytes([*high, *low])),
                [step, ..] => i32::from(*step),
                [] => return None,
            };
            *self.steps.get_mut(usize::from(kind & 15))? = first;
            segment = rest.get(if is_wide { 128 } else { 64 }..)?;
        }
        Some(())
    }

    fn read_scan(&self, segment: &[u8]) -> Option<Scan> {
        let (&count, rest) = segment.split_first()?;
        let (pairs, rest) = rest.split_at_checked(usize::from(count).checked_mul(2)?)?;
        let mut parts = Vec::new();
        for [id, tables] in pairs.as_chunks().0 {
            let component = self.components.iter().position(|component| component.id == *id)?;
            parts.push((component, [tables >> 4, tables & 15].map(usize::from)));
        }

        let [first, last, bits, ..] = rest else { return None };
        let mut scan = Scan {
            parts,
            first: u32::from(*first),
            last: u32::from(*last),
            high: u32::from(bits >> 4),
            low: u32::from(bits & 15),
        };
        if !self.is_progressive {
            // There is one way only, whatever the head says.
            (scan.first, scan.last, scan.high, scan.low) = (0, 63, 0, 0);
        }
        let is_possible = scan.first <= scan.last
            && scan.last < 64
            && scan.low < 14
            && (!self.is_progressive || scan.first > 0 || scan.last == 0)
            && (scan.first == 0 || scan.parts.len() == 1);
        (is_possible && !scan.parts.is_empty()).then_some(scan)
    }

    /// Follows a scan whose data begin at `at`. Returns the position of the mark behind it.
    fn follow(&mut self, scan: &Scan, bytes: &[u8], at: usize) -> Result<usize, (Fault, Damage)> {
        // The blocks of a lone component are not in units: those beyond the edge of the picture are left out.
        let largest = self.largest;
        let lone = match scan.parts[..] {
            [(component, _)] => self.components.get(component),
            _ => None,
        };
        let [columns, rows] = match lone {
            Some(component) => {
                let blocks = |side: usize, own: usize, most: usize| {
                    side.saturating_mul(own).div_ceil(most).div_ceil(8)
                };
                let [across, down] = largest;
                [blocks(self.width, component.across, across), blocks(self.height, component.down, down)]
            }
            None => self.units,
        };
        let row_height = lone.map_or(largest[1], |component| largest[1].div_euclid(component.down.max(1)));
        let row_height = row_height.saturating_mul(8);
        let is_lone = lone.is_some();

        let mut state = State { bits: Bits::new(bytes, at), before: [0; 4], empty: 0 };
        let mut until_restart = self.restart_every;
        let mut restarts: u8 = 0;
        for row in 0..rows {
            let pixels = row.saturating_mul(row_height);
            let failed = |fault| (fault, Damage::Row(pixels));
            for column in 0..columns {
                if self.restart_every > 0 && until_restart == 0 {
                    state = restarted(state, bytes, restarts).map_err(failed)?;
                    restarts = restarts.wrapping_add(1) & 7;
                    until_restart = self.restart_every;
                }
                until_restart = until_restart.saturating_sub(1);
                self.unit(scan, &mut state, [column, row], is_lone).map_err(failed)?;
            }
        }

        self.tell(scan);
        let (mark, left, are_zeros) = state.bits.skip_to_mark();
        if left > 0 && !(are_zeros && left <= MAX_PADDING) {
            return Err((Fault::Damaged, Damage::TooLong));
        }
        Ok(mark)
    }

    /// Follows a unit: a block if the scan has one component, otherwise some of each.
    fn unit(
        &mut self,
        scan: &Scan,
        state: &mut State<'_>,
        [column, row]: [usize; 2],
        is_lone: bool,
    ) -> Result<(), Fault> {
        let [columns, _] = self.units;
        for (part, (index, tables)) in scan.parts.iter().enumerate() {
            let component = self.components.get_mut(*index).ok_or(Fault::Unknown)?;
            let [across, down] = if is_lone {
                [1, 1]
            } else {
                [component.across, component.down]
            };
            let width = columns.saturating_mul(component.across);
            let step = self.steps.get(usize::from(component.steps)).copied().unwrap_or(1);
            let [of_first, of_others] = [0, 1].map(|kind: usize| {
                let number = tables.get(kind).copied().unwrap_or_default();
                self.tables.get(kind).and_then(|tables| tables.get(number)?.as_ref())
            });
            for y in 0..down {
                for x in 0..across {
                    let line = row.saturating_mul(down).saturating_add(y).saturating_mul(width);
                    let block = line.saturating_add(column.saturating_mul(across)).saturating_add(x);
                    let mut nothing = 0;
                    let set = component.set.get_mut(block).unwrap_or(&mut nothing);
                    let before = state.before.get_mut(part).ok_or(Fault::Unknown)?;
                    let bits = &mut state.bits;

                    if scan.first == 0 && scan.high == 0 {
                        let table = of_first.ok_or(Fault::Unknown)?;
                        follow_first(bits, table, before, step.saturating_mul(1 << scan.low))?;
                    } else if scan.first == 0 {
                        bits.take(1)?;
                    }
                    if scan.last == 0 {
                        continue;
                    }
                    let table = of_others.ok_or(Fault::Unknown)?;
                    if scan.high == 0 {
                        follow_others(bits, table, scan, &mut state.empty, self.is_progressive, set)?;
                    } else {
                        refine_others(bits, table, scan, &mut state.empty, set)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Notes which bits of its coefficients a scan has told.
    fn tell(&mut self, scan: &Scan) {
        for (index, _) in &scan.parts {
            let Some(component) = self.components.get_mut(*index) else { continue };
            let coefficients = component.untold.iter_mut().skip(scan.first as usize);
            let count = scan.last.saturating_sub(scan.first).saturating_add(1) as usize;
            let low = u8::try_from(scan.low).unwrap_or(u8::MAX);
            coefficients.take(count).for_each(|untold| *untold = low);
        }
    }

    /// Whether all rows of a progressive picture are there, finely or not.
    fn is_coarse(&self) -> bool {
        let is_there = |component: &Component| component.untold.first() != Some(&u8::MAX);
        self.is_progressive && self.components.iter().all(is_there)
    }

    /// Returns what is missing when the file is at its end. Only if there is no end mark, single bits of a
    /// progressive picture are missed: whoever writes an end mark may leave some out.
    fn is_incomplete(&self, has_end_mark: bool) -> Option<Damage> {
        let mut untold = self.components.iter().map(|component| &component.untold);
        let is_missing = untold.clone().any(|untold| untold.first() == Some(&u8::MAX));
        let is_coarse = !has_end_mark && untold.any(|untold| untold.iter().any(|bits| *bits > 0));
        match (is_missing, is_coarse) {
            (true, _) => Some(Damage::MissingComponents),
            (false, true) => Some(Damage::Coarse),
            (false, false) => None,
        }
    }
}

/// Goes on behind the next restart mark, which must be the one of this number.
fn restarted<'a>(state: State<'a>, bytes: &'a [u8], number: u8) -> Result<State<'a>, Fault> {
    let (mark, left, are_zeros) = state.bits.skip_to_mark();
    let is_next = bytes
        .get(mark..)
        .is_some_and(|rest| rest.starts_with(&[0xff, 0xd0 | number]));
    if !is_next || left > 0 && !(are_zeros && left <= MAX_PADDING) {
        return Err(Fault::Damaged);
    }
    Ok(State { bits: Bits::new(bytes, mark.saturating_add(2)), before: [0; 4], empty: 0 })
}

/// Follows the first coefficient of a block: its difference to the one `before`, in steps.
fn follow_first(bits: &mut Bits<'_>, table: &HuffmanTable, before: &mut i32, step: i32) -> Result<(), Fault> {
    let size = u32::from(bits.symbol(table)?);
    if size > 11 {
        return Err(Fault::Damaged);
    }
    *before = before.wrapping_add(bits.signed(size)?);
    // It is 8 times the mean of the block, which lies within 128. Rounding adds up to a step.
    let most = 2048_i32.saturating_add(step.saturating_mul(2));
    if before.saturating_mul(step).saturating_abs() > most {
        return Err(Fault::Damaged);
    }
    Ok(())
}

/// Follows the other coefficients of a block, when they are told for the first time.
fn follow_others(
    bits: &mut Bits<'_>,
    table: &HuffmanTable,
    scan: &Scan,
    empty: &mut u32,
    is_progressive: bool,
    set: &mut u64,
) -> Result<(), Fault> {
    if *empty > 0 {
        *empty = empty.saturating_sub(1);
        return Ok(());
    }

    let mut next = scan.first.max(1);
    while next <= scan.last {
        let symbol = bits.symbol(table)?;
        let [zeros, size] = [symbol >> 4, symbol & 15].map(u32::from);
        if size == 0 && zeros < 15 {
            if is_progressive {
                *empty = run(bits, zeros)?.saturating_sub(1);
            } else if zeros > 0 {
                return Err(Fault::Damaged);
            }
            return Ok(());
        }

        let at = next.saturating_add(zeros);
        if at > scan.last || size > 10 {
            return Err(Fault::Damaged);
        }
        if size > 0 {
            bits.take(size)?;
            *set |= 1_u64.wrapping_shl(at);
        }
        next = at.saturating_add(1);
    }
    Ok(())
}

/// Reads how many blocks from this one on have nothing more.
fn run(bits: &mut Bits<'_>, size: u32) -> Result<u32, Fault> {
    Ok(1_u32.wrapping_shl(size).saturating_add(bits.take(size)?))
}

/// Follows the next bit of the other coefficients of a block.
fn refine_others(
    bits: &mut Bits<'_>,
    table: &HuffmanTable,
    scan: &Scan,
    empty: &mut u32,
    set: &mut u64,
) -> Result<(), Fault> {
    let mut next = scan.first;
    while *empty == 0 && next <= scan.last {
        let symbol = bits.symbol(table)?;
        let [mut zeros, size] = [symbol >> 4, symbol & 15].map(u32::from);
        match size {
            0 if zeros < 15 => {
                *empty = run(bits, zeros)?;
                break;
            }
            0 => {}
            1 => {
                bits.take(1)?;
            }
            _ => return Err(Fault::Damaged),
        }

        // The coefficients that are set have a bit each; `zeros` counts the others.
        loop {
            if next > scan.last {
                return Err(Fault::Damaged);
            }
            if *set >> next & 1 == 1 {
                bits.take(1)?;
            } else if zeros == 0 {
                break;
            } else {
                zeros = zeros.saturating_sub(1);
            }
            next = next.saturating_add(1);
        }
        if size == 1 {
            *set |= 1_u64.wrapping_shl(next);
        }
        next = next.saturating_add(1);
    }

    if *empty > 0 {
        for at in next..=scan.last {
            if *set >> at & 1 == 1 {
                bits.take(1)?;
            }
        }
        *empty = empty.saturating_sub(1);
    }
    Ok(())
}
