//! The summary of an export, as [`Export::run`](crate::Export::run) returns it: files, bytes, images,
//! missing pixels, dropped views, and the time of each stage.

use crate::stage::Stage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::iter::Sum;
use std::ops::AddAssign;

/// The number of images of one kind, and of their pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageTally {
    /// The number of panoramas or views, however many modalities each has.
    pub images: u64,
    /// The number of pixels that were cast. 0 if only poses are asked for.
    pub pixels: u64,
    /// The number of cast pixels whose ray meets no face. They are missing in every modality.
    pub pixels_missing: u64,
    /// The number of cast pixels whose face has no label. 0 if no semantic image is asked for.
    pub pixels_unlabelled: u64,
    /// The number of cast pixels whose face has a label only by filling.
    pub pixels_filled: u64,
}

/// A part of a mesh's surface, and of what images show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// The number of faces.
    pub faces: u64,
    /// The area, in m².
    pub m2: f64,
    /// The number of pixels in panoramas and views together. `None` without images of labels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixels: Option<u64>,
}

/// The surface without votes, and the part of it without a label. The rest was filled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unlabelled {
    /// Before filling.
    pub without_votes: Surface,
    /// After filling.
    pub without_label: Surface,
}

/// What a unit of work wrote. The journal keeps it, so that a later run can report the whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitTally {
    /// The number of files.
    pub files: u64,
    /// The bytes of all files.
    pub bytes: u64,
    /// The panoramas among them.
    pub panoramas: ImageTally,
    /// The perspective views among them.
    pub views: ImageTally,
}

impl AddAssign for ImageTally {
    fn add_assign(&mut self, other: Self) {
        self.images += other.images;
        self.pixels += other.pixels;
        self.pixels_missing += other.pixels_missing;
        self.pixels_unlabelled += other.pixels_unlabelled;
        self.pixels_filled += other.pixels_filled;
    }
}

impl AddAssign for Surface {
    fn add_assign(&mut self, other: Self) {
        self.faces += other.faces;
        self.m2 += other.m2;
        self.pixels = self
            .pixels
            .map_or(other.pixels, |sum| Some(sum + other.pixels.unwrap_or(0)));
    }
}

impl AddAssign for Unlabelled {
    fn add_assign(&mut self, other: Self) {
        self.without_votes += other.without_votes;
        self.without_label += other.without_label;
    }
}

impl AddAssign for UnitTally {
    fn add_assign(&mut self, other: Self) {
        self.files += other.files;
        self.bytes += other.bytes;
        self.panoramas += other.panoramas;
        self.views += other.views;
    }
}

impl Sum for UnitTally {
    fn sum<I: Iterator<Item = Self>>(tallies: I) -> Self {
        tallies.fold(Self::default(), |mut sum, tally| {
            sum += tally;
            sum
        })
    }
}

/// What happened to the candidate views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ViewTally {
    /// The number of drawn candidates.
    pub candidates: u64,
    /// The number of kept ones.
    pub kept: u64,
    /// Dropped because their entropies are the lowest of their pool.
    pub dropped_lowest: u64,
    /// Dropped because they were not drawn from the middle of their pool.
    pub dropped_not_drawn: u64,
    /// Kept but not written, since `--only` leaves out their scan locations.
    pub not_asked: u64,
}

/// What an export has made over all areas, in this run and in earlier ones.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The data set's folder.
    pub output: String,
    /// The number of areas.
    pub areas: u64,
    /// The number of scan locations.
    pub locations: u64,
    /// All files of the data set, and its images.
    #[serde(flatten)]
    pub tally: UnitTally,
    /// What happened to the candidate views.
    pub candidate_views: ViewTally,
    /// The surface without votes and without a label. `None` for a shard, and for a data set without labels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unlabelled: Option<Unlabelled>,
    /// The warnings of this run.
    pub warnings: u64,
    /// The time of each stage in this run, seconds.
    pub stage_seconds: BTreeMap<Stage, f64>,
    /// The time of this run, seconds.
    pub seconds: f64,
}

impl Summary {
    /// Returns the summary in a few lines for a person.
    pub fn lines(&self) -> Vec<String> {
        let Self { output, locations, tally, candidate_views: views, .. } = self;
        let mut lines = vec![
            format!(
                "{output}: {} panoramas and {} views of {locations} locations in {:.1} s",
                tally.panoramas.images, tally.views.images, self.seconds
            ),
            format!("{} files, {}", tally.files, size(tally.bytes)),
        ];

        let stages: Vec<String> = self
            .stage_seconds
            .iter()
            .map(|(stage, s)| format!("{} {s:.1} s", stage.name()))
            .collect();
        if !stages.is_empty() {
            let has_meshes = self.stage_seconds.contains_key(&Stage::Meshes);
            let beside = if has_meshes {
                " (meshes and points are written beside the images)"
            } else {
                ""
            };
            lines.push(format!("{}{beside}", stages.join(", ")));
        }

        let missing: Vec<String> = [("panoramas", tally.panoramas), ("views", tally.views)]
            .iter()
            .filter_map(|(kind, t)| Some(format!("{} of the pixels of {kind}", percent(t.share_missing()?))))
            .collect();
        if !missing.is_empty() {
            lines.push(format!("missing, for no face is there: {}", missing.join(", ")));
        }

        let unlabelled: Vec<String> = [("panoramas", tally.panoramas), ("views", tally.views)]
            .iter()
            .filter_map(|(kind, t)| Some((kind, t.share_unlabelled().filter(|share| *share > 0.0)?)))
            .map(|(kind, share)| format!("{} of the pixels of {kind}", percent(share)))
            .collect();
        if !unlabelled.is_empty() {
            lines.push(format!(
                "without a label, for no point voted for their face: {}",
                unlabelled.join(", ")
            ));
        }

        if let Some(Unlabelled { without_votes, without_label }) = self.unlabelled
            && without_label.faces < without_votes.faces
        {
            let pixels = without_votes.pixels.zip(without_label.pixels);
            let pixels = pixels.map_or(String::new(), |(a, b)| format!(", {} of {a} such pixels", a - b));
            lines.push(format!(
                "filled: {} of {} faces without votes, {:.1} of {:.1} m²{pixels}",
                without_votes.faces - without_label.faces,
                without_votes.faces,
                without_votes.m2 - without_label.m2,
                without_votes.m2
            ));
        }

        if views.candidates > views.kept {
            lines.push(format!(
                "{} of {} candidate views dropped: {} for the lowest entropies of their pool, {} not drawn \
                 from its middle",
                views.candidates - views.kept,
                views.candidates,
                views.dropped_lowest,
                views.dropped_not_drawn
            ));
        }

        if views.not_asked > 0 {
            lines.push(format!(
                "{} kept views are of locations whose images were not asked for",
                views.not_asked
            ));
        }

        if self.warnings > 0 {
            lines.push(format!("{} warnings above", self.warnings));
        }

        lines
    }
}

impl ImageTally {
    /// Returns the share of missing pixels, if any was cast.
    fn share_missing(&self) -> Option<f64> {
        (self.pixels > 0).then(|| self.pixels_missing as f64 / self.pixels as f64)
    }

    /// Returns the share of pixels whose face has no label, if any was cast.
    pub(crate) fn share_unlabelled(&self) -> Option<f64> {
        (self.pixels > 0).then(|| self.pixels_unlabelled as f64 / self.pixels as f64)
    }
}

/// Writes a share as a percentage. "0 %" means none at all, and "100 %" all.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if share > 0.0 && percent < 0.01 {
        "less than 0.01 %".to_owned()
    } else if share < 1.0 && percent > 99.99 {
        "more than 99.99 %".to_owned()
    } else if share == 0.0 || share == 1.0 {
        format!("{percent:.0} %")
    } else {
        format!("{percent:.2} %")
    }
}

/// Writes bytes in powers of 1000, as disks are sold.
pub(crate) fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["bytes", "kB", "MB", "GB"] {
        // A value that would round up to 1000 belongs to the next unit.
        if value < 999.95 {
            return if unit == "bytes" {
                format!("{bytes} bytes")
            } else {
                format!("{value:.1} {unit}")
            };
        }
        value /= 1000.0;
    }
    format!("{value:.1} TB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_shares_as_a_person_reads_them() {
        let sizes = [0, 999, 1000, 999_949, 999_950, 1_500_000_000, 2_000_000_000_000].map(size);
        assert_eq!(sizes, ["0 bytes", "999 bytes", "1.0 kB", "999.9 kB", "1.0 MB", "1.5 GB", "2.0 TB"]);
        let shares = [0.0, 1e-9, 0.1234, 0.999_999_9, 1.0].map(percent);
        assert_eq!(shares, ["0 %", "less than 0.01 %", "12.34 %", "more than 99.99 %", "100 %"]);
    }

    #[test]
    fn tallies_add_up_and_come_back_from_json() {
        let views =
            ImageTally { images: 3, pixels: 300, pixels_missing: 30, pixels_unlabelled: 6, pixels_filled: 5 };
        let a = UnitTally { files: 9, bytes: 1000, views, ..UnitTally::default() };
        let b = UnitTally { files: 1, panoramas: views, ..UnitTally::default() };
        let sum: UnitTally = [a, b, a].into_iter().sum();
        assert_eq!((sum.files, sum.bytes, sum.views.images, sum.panoramas.pixels), (19, 2000, 6, 300));
        assert_eq!(sum.views.share_missing(), Some(0.1));
        let text = serde_json::to_string(&sum).unwrap();
        assert_eq!(serde_json::from_str::<UnitTally>(&text).unwrap(), sum);
    }

    #[test]
    fn a_summary_says_what_there_is_to_say() {
        let mut summary = Summary {
            output: "out".to_owned(),
            areas: 1,
            locations: 2,
            tally: UnitTally { files: 4, bytes: 2500, ..UnitTally::default() },
            candidate_views: ViewTally::default(),
            unlabelled: Some(Unlabelled::default()),
            warnings: 0,
            stage_seconds: BTreeMap::new(),
            seconds: 1.25,
        };
        let lines = summary.lines();
        assert_eq!(lines, ["out: 0 panoramas and 0 views of 2 locations in 1.2 s", "4 files, 2.5 kB"]);

        summary.tally.views = ImageTally {
            images: 7,
            pixels: 1000,
            pixels_missing: 1,
            pixels_unlabelled: 120,
            pixels_filled: 30,
        };
        summary.unlabelled = Some(Unlabelled {
            without_votes: Surface { faces: 9, m2: 2.5, pixels: Some(150) },
            without_label: Surface { faces: 4, m2: 0.5, pixels: Some(120) },
        });

        summary.candidate_views =
            ViewTally { candidates: 20, kept: 15, dropped_lowest: 3, dropped_not_drawn: 2, not_asked: 8 };

        summary.stage_seconds = [(Stage::Render, 0.5), (Stage::Load, 0.25)].into();
        let text = summary.lines().join("\n");
        for part in [
            "load 0.2 s, render 0.5 s",
            "0.10 % of the pixels of views",
            "without a label, for no point voted for their face: 12.00 % of the pixels of views",
            "filled: 5 of 9 faces without votes, 2.0 of 2.5 m², 30 of 150 such pixels",
            "5 of 20 candidate views dropped: 3 for the lowest entropies of their pool, 2 not drawn",
            "8 kept views are of locations",
        ] {
            assert!(text.contains(part), "{part:?} in {text}");
        }
    }
}
