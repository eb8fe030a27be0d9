//! Where the points of a scan are.

use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::rows::{BlockSink, Reading};
use crate::cloud::table::wanted::Wanted;
use crate::cloud::{OnFault, kind};
use crate::error::{Error, Result};
use crate::fs::source::Source;
use crate::raw::laser::ScanInfo;
use std::path::PathBuf;
use std::sync::OnceLock;

/// A scan of a file.
#[derive(Debug)]
pub(super) struct ScanSource {
    pub(super) path: PathBuf,
    pub(super) part: Part,
    /// The range of the colours, once it is known.
    colors: OnceLock<ColorRange>,
}

/// Which points of the file are the scan's.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// All points of a table.
    All,
    /// The scan with this number, from 0, of an E57 file.
    #[cfg(feature = "e57")]
    E57(usize),
    /// The scan of a PTX file after this many bytes and lines.
    #[cfg(feature = "text")]
    Ptx(u64, u64),
}

/// Scans that were listed, and what is doubtful about them, a sentence each.
pub(super) type Listed = (Vec<(ScanInfo, ScanSource)>, Vec<String>);

/// What stops a pass over the points before its end. It is no fault.
const ENOUGH: &str = "enough points were seen";

/// What a pass over the points tells.
#[derive(Default)]
pub(super) struct Passed {
    pub(super) told: crate::cloud::table::measured::Told,
    pub(super) notes: Vec<String>,
    pub(super) skipped: u64,
}

impl ScanSource {
    pub(super) fn new(path: PathBuf, part: Part) -> Self {
        Self { path, part, colors: OnceLock::new() }
    }

    fn cloud<'a>(&self, columns: &'a [String]) -> Result<Box<dyn Cloud + 'a>> {
        let source = Source::file(&self.path);
        let wanted = Wanted::Measurements(columns);
        match self.part {
            Part::All => kind::table(source, wanted),
            #[cfg(feature = "e57")]
            Part::E57(number) => Ok(Box::new(crate::cloud::e57::E57Cloud::scan(source, wanted, number))),
            #[cfg(feature = "text")]
            Part::Ptx(bytes, lines) => {
                let text = crate::cloud::text::read::TextCloud::ptx_scan(source, wanted, (bytes, lines));
                Ok(Box::new(text))
            }
        }
    }

    /// Hands all points to `sink`, in the frame of the file.
    pub(super) fn read(
        &self,
        columns: &[String],
        on_fault: OnFault,
        sink: &mut BlockSink<'_>,
    ) -> Result<Passed> {
        let colors = match self.colors.get() {
            Some(colors) => *colors,
            None => {
                let found = self.range_of_colors(columns, on_fault)?;
                *self.colors.get_or_init(|| found)
            }
        };

        let cloud = self.cloud(columns)?;
        let mut reading = Reading::of_measurements(&self.path, on_fault, sink);
        if !cloud.read(colors, &mut reading)? {
            return Err(Error::format(
                &self.path,
                "has colours of several ranges, or changed while it was read",
            ));
        }
        reading.flush()?;
        let Reading { told, notes, skipped, .. } = reading;
        Ok(Passed { told, notes, skipped: skipped.count })
    }

    /// Reads the first block of points, and hands it to `sink`.
    pub(super) fn read_first(
        &self,
        columns: &[String],
        on_fault: OnFault,
        sink: &mut BlockSink<'_>,
    ) -> Result<Passed> {
        let cloud = self.cloud(columns)?;
        let mut colors = ColorRange::Narrow;
        loop {
            let mut is_enough = false;
            let mut once = |block: &mut _| {
                is_enough = true;
                sink(block)?;
                Err(Error::format(&self.path, ENOUGH))
            };
            let mut reading = Reading::of_measurements(&self.path, on_fault, &mut once);
            let read = cloud.read(colors, &mut reading).and_then(|fits| match fits {
                true => reading.flush().map(|()| true),
                false => Ok(false),
            });
            let Reading { told, notes, skipped, .. } = reading;
            match read {
                Ok(false) if colors != ColorRange::Widest => colors = colors.wider(),
                Ok(_) => return Ok(Passed { told, notes, skipped: skipped.count }),
                Err(e) if is_enough && e.message() == ENOUGH => {
                    return Ok(Passed { told, notes: Vec::new(), skipped: skipped.count });
                }
                Err(e) => return Err(e),
            }
        }
    }

    /// Finds the range of the colours: the narrowest that holds all of them. A wide colour often comes early,
    /// and ends the pass.
    fn range_of_colors(&self, columns: &[String], on_fault: OnFault) -> Result<ColorRange> {
        let told = self.read_first(columns, on_fault, &mut |_| Ok(()))?.told;
        if !told.has_colors || told.are_bytes {
            return Ok(ColorRange::Narrow);
        }

        let cloud = self.cloud(columns)?;
        let mut colors = ColorRange::Narrow;
        loop {
            let mut none = |_: &mut _| Ok(());
            let mut reading = Reading::of_measurements(&self.path, on_fault, &mut none);
            if cloud.read(colors, &mut reading)? || colors == ColorRange::Widest {
                return Ok(colors);
            }
            colors = colors.wider();
        }
    }
}
