//! Object headers: the messages that make an object a group or an array.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::file::{Cursor, Dataset, Filter, Hdf5File, Kind, Layout};
use super::message::{self, AttributeValue};
use crate::error::Result;

/// The most blocks that a header may be continued in.
const MAX_BLOCKS: usize = 256;
/// The most bytes of a header's messages. Attributes and compact data have up to 64 KiB each.
const MAX_BYTES: u64 = 1 << 24;

/// The contents of an object's header.
#[derive(Debug, Default)]
pub(crate) struct Header {
    /// Addresses of the B-tree and the heap of a group in the old form.
    pub(crate) symbol_table: Option<(u64, u64)>,
    /// Members of a group in the new form: names and addresses.
    pub(crate) links: Vec<(String, u64)>,
    /// Whether it is a group in the new form.
    pub(crate) is_new_group: bool,
    /// Whether its members are in a heap, which is not read.
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
        let head = file.some_bytes(address, 64)?;
        let start = Start::parse(&head, address).ok_or_else(damaged)?;

        let mut this = Self::default();
        // Blocks of messages that are still to be read.
        let mut blocks = vec![start.block];
        let mut blocks_left = MAX_BLOCKS;
        let mut bytes_left = MAX_BYTES;
        while let Some((at, size)) = blocks.pop() {
            let is_first = blocks_left == MAX_BLOCKS;
            blocks_left = blocks_left.checked_sub(1).ok_or_else(damaged)?;
            bytes_left = bytes_left.checked_sub(size).ok_or_else(damaged)?;
            let mut bytes = &file.bytes(at, size)?[..];
            if start.is_new && !is_first {
                // The block has a signature before its messages and a checksum behind them.
                bytes = bytes
                    .strip_prefix(b"OCHK")
                    .and_then(|b| b.get(..b.len().checked_sub(4)?))
                    .ok_or_else(damaged)?;
            }
            let mut cursor = Cursor::new(bytes);
            while cursor.rest().len() >= start.message_head_bytes() {
                let kind = cursor.number(if start.is_new { 1 } else { 2 });
                let size = cursor.size(2);
                let flags = cursor.byte();
                let reserved = match (start.is_new, start.has_order) {
                    (false, _) => 3,
                    (true, true) => 2,
                    (true, false) => 0,
                };
                cursor.take(reserved);
                let (Some(kind), Some(size), Some(flags)) = (kind, size, flags) else {
                    return Err(damaged());
                };

                let body = cursor.take(size).ok_or_else(damaged)?;
                if kind == 0x10 {
                    // The header continues in another block.
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

    /// Takes a message. Returns `None` if it is damaged.
    fn take(&mut self, kind: u64, body: &[u8], is_shared: bool) -> Option<()> {
        if is_shared {
            // The message itself is elsewhere. A shared attribute is not needed, but an array without its
            // type cannot be read.
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

    /// The array that the header describes. Returns `None` if it describes none.
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

    /// Whether the object has an attribute with this name that is a number other than 0.
    pub(crate) fn is_set(&self, name: &str) -> bool {
        self.attributes
            .iter()
            .any(|(n, value)| n == name && matches!(value, AttributeValue::Number(v) if *v != 0))
    }
}

/// The start of a header.
struct Start {
    /// Whether it is a header of version 2.
    is_new: bool,
    /// Whether messages have a creation order (version 2).
    has_order: bool,
    /// Address and bytes of the first block of messages.
    block: (u64, u64),
}

impl Start {
    /// Parses the first bytes of the header at `address`. Returns `None` if they are damaged.
    fn parse(head: &[u8], address: u64) -> Option<Self> {
        let mut cursor = Cursor::new(head);
        if !head.starts_with(b"OHDR") {
            if cursor.byte() != Some(1) {
                return None;
            }
            let size = cursor.take(7).and_then(|_| cursor.number(4))?;
            let block = (address.checked_add(16)?, size);
            return Some(Self { is_new: false, has_order: false, block });
        }

        let flags = *head.get(5)?;
        let times = if flags & 0x20 != 0 { 16 } else { 0 };
        let phases = if flags & 0x10 != 0 { 4 } else { 0 };
        let width = 1usize << (flags & 3);
        for bytes in [6, times, phases] {
            cursor.take(bytes)?;
        }
        let size = cursor.number(width)?;
        let before = head.len().checked_sub(cursor.rest().len())?;
        let block = (address.checked_add(before as u64)?, size);
        Some(Self { is_new: true, has_order: flags & 4 != 0, block })
    }

    /// The bytes of a message before its body.
    fn message_head_bytes(&self) -> usize {
        match (self.is_new, self.has_order) {
            (false, _) => 8,
            (true, true) => 6,
            (true, false) => 4,
        }
    }
}
