//! The text of a comparison.

use super::comparison::{
    AreaChanges, ClassPair, ComparedSet, Comparison, FileKindChanges, Geometry, ImageChange, InstanceChange,
    InstanceChangeKind, LabelChanges, LabelCounts, ModalityChanges, PoseChange, RenamedInstance, Side,
};
use super::lines::{Lines, grouped, percent, significant};
use serde_json::Value;
use std::fmt;

/// The most rows of a long table.
const MAX_ROWS: usize = 10;

/// The most files that are listed as not comparable.
const MAX_UNREAD: usize = 20;

/// The most digits of a checksum.
const MAX_DIGITS: usize = 12;

impl fmt::Display for Comparison {
    /// Writes lines for a person: tables with the first rows, the largest differences first. Equal things
    /// have no lines. Characters in names that would control a terminal are replaced.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = &mut Lines::default();
        about(text, "A", &self.a);
        about(text, "B", &self.b);
        self.made(text);
        self.files(text);
        if let Some(labels) = &self.labels {
            self.labels(text, labels);
        }
        self.views(text);

        self.images(text);
        self.poses(text);
        self.notes.iter().for_each(|note| text.add(format!("note: {note}")));
        self.end(text);
        f.write_str(text.text())
    }
}

impl FileKindChanges {
    fn is_changed(&self) -> bool {
        self.changed + self.only_a + self.only_b > 0
    }
}

impl ModalityChanges {
    fn is_changed(&self) -> bool {
        let pixels = self.same_pixels + self.renumbered + self.changed + self.other_pose + self.other_form;
        pixels + self.unread + self.only_a + self.only_b > 0
    }
}

impl Comparison {
    /// The settings and the input files that differ.
    fn made(&self, text: &mut Lines) {
        let settings = self
            .settings
            .iter()
            .map(|of| [of.name.clone(), words(&of.a), words(&of.b)]);
        let mut rows: Vec<[String; 3]> = settings.collect();
        for of in self.inputs.iter().take(MAX_ROWS) {
            rows.push([
                format!("area {}: {}", of.area, of.path),
                short_checksum(of.a.as_ref()),
                short_checksum(of.b.as_ref()),
            ]);
        }

        text.table(["made with", "A", "B"], &rows, 3);
        text.more(self.inputs.len().saturating_sub(MAX_ROWS));
    }

    /// The files that differ, by kind.
    fn files(&self, text: &mut Lines) {
        let changed = self.files.iter().filter(|of| of.is_changed());
        let rows: Vec<_> = changed.map(file_row).collect();
        text.table(["files", "same", "changed", "only A", "only B"], &rows, 1);
    }

    /// The labels, classes and instances that differ.
    fn labels(&self, text: &mut Lines, labels: &LabelChanges) {
        let LabelChanges { a, b, added, gone, changed, class_changed, matrix, instances, .. } = labels;
        let renamed = [("renumbered", &labels.renumbered), ("in a room of another name", &labels.other_room)];
        let is_same = added.is_empty() && gone.is_empty() && matrix.is_empty() && instances.is_empty();
        if is_same && renamed.iter().all(|(_, of)| of.is_empty()) {
            return;
        }

        text.add(format!("labels: {} in A, {} in B", grouped(*a), grouped(*b)));
        names(text, "without a partner in B", gone);
        names(text, "without a partner in A", added);
        for (what, of) in renamed.into_iter().filter(|(_, of)| !of.is_empty()) {
            let mut counts = LabelCounts::default();
            of.iter().for_each(|RenamedInstance { counts: of, .. }| counts += *of);
            let instances = grouped(of.len() as u64);
            text.add(format!("  {what}, and not changed: {instances} instances, {}", self.surface(&counts)));
        }

        if !matrix.is_empty() {
            text.add(format!("  changed: {}", self.surface(changed)));
            text.add(format!("  of these, to another class: {}", self.surface(class_changed)));
        }
        let rows: Vec<_> = matrix.iter().take(MAX_ROWS).map(class_row).collect();
        text.table(["class in A", "class in B", "faces", "m²", "pixels"], &rows, 2);
        text.more(matrix.len().saturating_sub(MAX_ROWS));

        let rows: Vec<_> = instances.iter().take(MAX_ROWS).map(instance_row).collect();
        let titles = ["instance in A", "is in B", "lost m²", "gained m²", "relabelled m²", "pixels"];
        text.table(titles, &rows, 2);
        text.more(instances.len().saturating_sub(MAX_ROWS));
    }

    /// An amount of surface and pixels. If no faces could be compared, their number is left out: it is
    /// unknown, not 0.
    fn surface(&self, of: &LabelCounts) -> String {
        let [faces, m2, pixels] = cells(of);
        let is_compared = |of: &AreaChanges| matches!(of.geometry, Geometry::Same | Geometry::Other);
        if self.areas.iter().any(is_compared) {
            format!("{faces} faces of {m2} m², {pixels} pixels")
        } else {
            format!("{pixels} pixels")
        }
    }

    /// The views, scan locations and photographs that differ.
    fn views(&self, text: &mut Lines) {
        let of = &self.views;
        let rows = [
            ("views", of.lost.len(), of.gained.len()),
            ("scan locations", of.locations_lost.len(), of.locations_gained.len()),
            ("photographs", of.photographs_lost.len(), of.photographs_gained.len()),
        ];

        let changed = rows.into_iter().filter(|(_, lost, gained)| lost + gained > 0);
        let rows: Vec<_> = changed
            .map(|(what, lost, gained)| [what.to_owned(), grouped(lost as u64), grouped(gained as u64)])
            .collect();
        text.table(["there", "only A", "only B"], &rows, 1);

        if !of.redrawn.is_empty() {
            let count = grouped(of.redrawn.len() as u64);
            text.add(format!("views in both that look elsewhere: {count}"));
        }
    }

    /// The images that differ, by modality.
    fn images(&self, text: &mut Lines) {
        let changed = self.modalities.iter().filter(|of| of.is_changed());
        let rows: Vec<_> = changed.map(modality_row).collect();
        let titles = [
            "images",
            "same",
            "same pixels",
            "renumbered",
            "changed",
            "other pose",
            "other form",
            "unread",
            "only A",
            "only B",
        ];
        text.table(titles, &rows, 1);

        let changed = self.modalities.iter().filter(|of| of.changed > 0);
        let rows: Vec<_> = changed.map(pixels_row).collect();
        text.table(["images that changed", "pixels", "PSNR", "mean", "largest"], &rows, 1);

        let first: Vec<_> = self
            .images
            .chunk_by(|a, b| a.modality == b.modality)
            .filter_map(|of| of.first())
            .map(image_row)
            .collect();
        text.table(["most changed", "pixels", "image"], &first, 3);
    }

    /// The poses that moved.
    fn poses(&self, text: &mut Lines) {
        let of = &self.poses;
        if of.moved.is_empty() {
            return;
        }
        let mut rows: Vec<_> = of.moved.iter().take(3).map(pose_row).collect();
        let largest = [of.largest_m, of.largest_degrees, of.largest_k_px].map(significant);
        let [m, degrees, k] = largest;
        rows.push(["largest".to_owned(), m, degrees, k]);
        let title = format!("poses that moved: {}", grouped(of.moved.len() as u64));
        text.table([title.as_str(), "m", "degrees", "K, pixels"], &rows, 1);
    }

    /// The files that could not be compared, and the result.
    fn end(&self, text: &mut Lines) {
        if !self.unread.is_empty() {
            text.add("could not be compared");
            for of in self.unread.iter().take(MAX_UNREAD) {
                let side = if of.side == Side::A { "A" } else { "B" };
                text.add(format!("  {side}: {}: {}", of.path, of.message));
            }
            text.more(self.unread.len().saturating_sub(MAX_UNREAD));
        }

        let files = grouped(self.a.files);
        let is_changed = self.files.iter().any(FileKindChanges::is_changed);
        text.add(match (self.equal, is_changed) {
            (true, _) if self.full => format!("equal: {files} files, all read"),
            (true, _) => {
                format!("equal: {files} files, by their sizes and by the checksums that both lists tell")
            }
            (_, true) => "different".to_owned(),
            (_, false) => {
                "not comparable: what both lists tell is equal, and not all of it is there".to_owned()
            }
        });
    }
}

/// The line on one of the data sets.
fn about(text: &mut Lines, name: &str, of: &ComparedSet) {
    let taxonomy = of
        .taxonomy
        .as_ref()
        .map_or("no labels".to_owned(), |name| format!("classes of {name}"));
    let files = grouped(of.files);
    let megabytes = significant(of.bytes as f64 / 1e6);
    let ComparedSet { folder, version, .. } = of;
    text.add(format!("{name}: {folder} (s3d {version}, {taxonomy}, {files} files, {megabytes} MB)"));
}

/// Adds a line with the first few of these names.
fn names(text: &mut Lines, what: &str, all: &[String]) {
    let first: Vec<&str> = all.iter().take(5).map(String::as_str).collect();
    if !first.is_empty() {
        let rest = if all.len() > first.len() { ", …" } else { "" };
        text.add(format!("  {what}: {}: {}{rest}", grouped(all.len() as u64), first.join(", ")));
    }
}

/// The cells for faces, m² and pixels.
fn cells(of: &LabelCounts) -> [String; 3] {
    [grouped(of.faces), significant(of.m2), grouped(of.pixels)]
}

/// The first digits of a checksum.
fn short_checksum(checksum: Option<&String>) -> String {
    checksum.map_or("none".to_owned(), |digits| digits.chars().take(MAX_DIGITS).collect())
}

fn file_row(of: &FileKindChanges) -> [String; 5] {
    let [same, changed, a, b] = [of.same, of.changed, of.only_a, of.only_b].map(grouped);
    [of.kind.clone(), same, changed, a, b]
}

fn class_row(pair: &ClassPair) -> [String; 5] {
    let [faces, m2, pixels] = cells(&pair.counts);
    let class_b = if pair.a == pair.b {
        format!("another {}", pair.b)
    } else {
        pair.b.to_owned()
    };
    [pair.a.to_owned(), class_b, faces, m2, pixels]
}

fn instance_row(of: &InstanceChange) -> [String; 6] {
    let words = match of.kind {
        InstanceChangeKind::Vanished => "nothing".to_owned(),
        InstanceChangeKind::Extent if of.a == of.b => "the same".to_owned(),
        _ => some_names(&of.b),
    };
    let name = match of.kind {
        InstanceChangeKind::Appeared => "nothing".to_owned(),
        _ => some_names(&of.a),
    };
    let m2 = [of.lost, of.gained, of.relabelled].map(|of| significant(of.m2));
    let [lost, gained, relabelled] = m2;
    let pixels = grouped(of.lost.pixels + of.gained.pixels + of.relabelled.pixels);
    [name, words, lost, gained, relabelled, pixels]
}

/// The first names of a group.
fn some_names(all: &[String]) -> String {
    let first = all.iter().take(3).map(String::as_str).collect::<Vec<_>>().join(" + ");
    match all.len().saturating_sub(3) {
        0 => first,
        more => format!("{first} + {more} more"),
    }
}

fn modality_row(of: &ModalityChanges) -> [String; 10] {
    let counts = [of.same, of.same_pixels, of.renumbered, of.changed, of.other_pose];
    let [same, same_pixels, renumbered, changed, other_pose] = counts.map(grouped);
    let [other_form, unread, a, b] = [of.other_form, of.unread, of.only_a, of.only_b].map(grouped);
    let name = of.modality.to_owned();
    [name, same, same_pixels, renumbered, changed, other_pose, other_form, unread, a, b]
}

fn pixels_row(of: &ModalityChanges) -> [String; 5] {
    let unit = if of.modality == "normal" { "°" } else { " m" };
    let pixels = &of.pixels;
    [
        of.modality.to_owned(),
        percent(pixels.pixels_changed, pixels.pixels),
        number(pixels.psnr_db, " dB"),
        number(pixels.mean, unit),
        number(pixels.largest, unit),
    ]
}

/// A value with its unit; empty if there is none.
fn number(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(String::new, |value| significant(value) + unit)
}

fn image_row(of: &ImageChange) -> [String; 3] {
    let share = percent(of.pixels.pixels_changed, of.pixels.pixels);
    [of.modality.to_owned(), share, of.a.clone()]
}

fn pose_row(moved: &PoseChange) -> [String; 4] {
    let k = moved.k_px.map_or_else(|| "other size".to_owned(), significant);
    [moved.a.clone(), significant(moved.m), significant(moved.degrees), k]
}

/// A value of a manifest as a person reads it.
fn words(value: &Value) -> String {
    match value {
        Value::Null => "not set".to_owned(),
        Value::String(text) => text.clone(),
        Value::Array(items) if items.is_empty() => "none".to_owned(),
        Value::Array(items) => items.iter().map(words).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}
