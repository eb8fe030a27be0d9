//! Object headers: the messages that make an object a group or an array.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::file::{Cursor, Dataset, Filter, Hdf5File, Kind, Layout};
use super::message::{self, AttributeValue};
use crate::error::Result;

/// Blocks that a header may be continued in.
const MAX_BLOCKS: usize = 256;
/// Bytes that the messages of a header may have: attributes and compact data end at 64 KiB each.
const MAX_BYTES: u64 = 1 << 24;

/// What the header of an object says.
#[derive(Debug, Default)]
pub(crate) struct Header {
    /// B-tree and heap of a group in the old form.
    pub(crate) symbol_table: Option<(u64, u64)>,
    /// Members of a group in the new form: names and addresses.
    pub(crate) links: Vec<(String, u64)>,
    /// Whether it is a group in the new form.
    pub(crate) is_new_group: bool,
    /// Whether its members are where they are not read.
    pub(crate) is_dense: bool,
    /// The attributes whose values are text or integers.
    pub(crate) attributes: Vec<(String, AttributeValue)>,
    dims: Option<Vec<u64>>,
    kind: Option<Kind>,
    layout: Option<Layout>,
    filters: Vec<Filter>,
}

impl Header {
    /// Reads the header at `address`.
    pub(crate) fn read(file: &Hdf5File, address: u64) -> Result<Self> {
        let damaged = || file.fault(format!("the object at {address} is damaged"));
        let mut this = Self::default();
        // Blocks of messages that are still to be read.
        let mut blocks: Vec<(u64, u64)> = Vec::new();
        let head = file.some_bytes(address, 64)?;
        let mut cursor = Cursor::new(&head);
        let new = head.starts_with(b"OHDR");
        let mut has_order = false;
        if new {
            let flags = *head.get(5).ok_or_else(damaged)?;
            has_order = flags & 4 != 0;
            let times = if flags & 0x20 != 0 { 16 } else { 0 };
            let phases = if flags & 0x10 != 0 { 4 } else { 0 };
            let width = 1usize << (flags & 3);
            for bytes in [6, times, phases] {
                cursor.take(bytes).ok_or_else(damaged)?;
            }
            let size = cursor.number(width).ok_or_else(damaged)?;
            let before = head.len().checked_sub(cursor.rest().len()).ok_or_else(damaged)?;
            blocks.push((address.checked_add(before as u64).ok_or_else(damaged)?, size));
        } else {
            if cursor.byte() != Some(1) {
                return Err(damaged());
            }
            let size = cursor.take(7).and_then(|_| cursor.number(4)).ok_or_else(damaged)?;
            blocks.push((address.checked_add(16).ok_or_else(damaged)?, size));
        }
        let (mut blocks_left, mut bytes_left) = (MAX_BLOCKS, MAX_BYTES);
        while let Some((at, size)) = blocks.pop() {
            let is_first = blocks_left == MAX_BLOCKS;
            blocks_left = blocks_left.checked_sub(1).ok_or_else(damaged)?;
            bytes_left = bytes_left.checked_sub(size).ok_or_else(damaged)?;
            let mut bytes = &file.bytes(at, size)?[..];
            if new && !is_first {
                // A signature before the messages and a checksum behind them.
                bytes = bytes
                    .strip_prefix(b"OCHK")
                    .and_then(|b| b.get(..b.len().checked_sub(4)?))
                    .ok_or_else(damaged)?;
            }
            let mut cursor = Cursor::new(bytes);
            let prefix = if !new {
                8
            } else if has_order {
                6
            } else {
                4
            };
            while cursor.rest().len() >= prefix {
                let (kind, size, flags) = if new {
                    let (kind, size, flags) = (cursor.number(1), cursor.size(2), cursor.byte());
                    cursor.take(if has_order { 2 } else { 0 });
                    (kind, size, flags)
                } else {
                    let (kind, size, flags) = (cursor.number(2), cursor.size(2), cursor.byte());
                    cursor.take(3);
                    (kind, size, flags)
                };
                let (Some(kind), Some(size), Some(flags)) = (kind, size, flags) else {
                    return Err(damaged());
                };
                let body = cursor.take(size).ok_or_else(damaged)?;
                if kind == 0x10 {
                    let mut body = Cursor::new(body);
                    let (Some(at), Some(size)) = (body.number(8), body.number(8)) else {
                        return Err(damaged());
                    };
                    blocks.push((at, size));
                } else {
                    this.take(kind, body, flags & 2 != 0).ok_or_else(damaged)?;
                }
            }
        }
        Ok(this)
    }

    /// Takes a message; `None` if it is damaged.
    fn take(&mut self, kind: u64, body: &[u8], is_shared: bool) -> Option<()> {
        if is_shared {
            // The message is elsewhere. Of an attribute that is no loss; a datatype that has a name of its
            // own…
            if kind == 0x03 {
                self.layout = Some(Layout::Unsupported("an array's type is stored as an object of its own"));
                self.kind = Some(Kind::Other { size: 1 });
            }
            return Some(());
        }
        match kind {
            0x01 => self.dims = Some(message::dataspace(&mut Cursor::new(body))?),
            0x02 => {
                self.is_new_group = true;
                self.is_dense = message::link_info_is_dense(body)?;
            }
            0x03 => self.kind = self.kind.or(Some(message::datatype(&mut Cursor::new(body))?)),
            0x06 => self.links.extend(message::link(body)?),
            0x08 if self.layout.is_none() => self.layout = Some(message::layout(body)?),
            0x0b => self.filters = message::filters(body)?,
            0x0c => self.attributes.extend(message::attribute(body)),
            0x11 => {
                let mut body = Cursor::new(body);
                self.symbol_table = Some((body.number(8)?, body.number(8)?));
            }
            _ => {}
        }
        Some(())
    }

    /// The array that it describes, `None` if it is none.
    pub(crate) fn dataset(&self) -> Option<Dataset> {
        Some(Dataset {
            kind: self.kind?,
            dims: self.dims.clone()?,
            layout: self.layout.clone()?,
            filters: self.filters.clone(),
        })
    }

    /// The text of an attribute.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find_map(|(n, value)| match value {
            AttributeValue::Text(text) if n == name => Some(text.as_str()),
            _ => None,
        })
    }

    /// Whether it has an attribute that is a number other than 0.
    pub(crate) fn is_set(&self, name: &str) -> bool {
        self.attributes
            .iter()
            .any(|(n, value)| n == name && matches!(value, AttributeValue::Number(v) if *v != 0))
    }
}
