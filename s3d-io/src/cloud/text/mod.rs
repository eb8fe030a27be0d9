//! Clouds as text, a point a line: what CloudCompare, numpy, spreadsheets and scanners' programs write.
//! Sources: CloudCompare's "ASCII file" dialog and its `AsciiFilter.cpp`; Leica's PTS and PTX, as described
//! in "Leica Cyclone: PTX and PTS file formats".

mod layout;
#[cfg_attr(not(feature = "raw"), allow(dead_code))]
pub(crate) mod ptx;
pub(crate) mod read;

pub(crate) use layout::is_rows;
