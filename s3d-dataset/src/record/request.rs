//! A request: everything that decides the bytes of a data set, which is the version of s3d, the options and
//! the input. Exports of equal requests write the same files, so one can continue where another was killed.

use crate::error::{Difference, Result};
use crate::options::ExportOptions;
use crate::record::if_there;
use s3d_io::dataset::{Layout, WorldOffsets};
use s3d_io::fs::{Checksum, read_json};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// The request of an export. It names no thread counts and no folders of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Request {
    /// The version of s3d.
    pub(crate) version: String,
    pub(crate) seed: u64,
    /// The options without the seed, which stands above, and the placing of scan locations, which stands
    /// below.
    pub(crate) options: ExportOptions,
    /// The areas, by number.
    pub(crate) areas: Vec<RequestedArea>,
}

/// A requested area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RequestedArea {
    pub(crate) area: u32,
    /// The distance at which scan locations are placed, metres. Null if the scene has its own, or `see` is
    /// set.
    pub(crate) place_cameras: Option<f64>,
    /// The share of the surface that placed locations are to see. Absent if they are not placed that way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) see: Option<f64>,
    /// What is subtracted from the scan's coordinates, metres. Absent if nothing is. It follows from the
    /// input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offset_m: Option<[f64; 3]>,
    /// The input files and folders.
    pub(crate) inputs: Vec<InputRecord>,
}

/// A file or folder of the input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputRecord {
    /// The path from the folder of the scene file. Only the last part of an input that is named by a whole
    /// path. The path of a folder ends with `/`.
    pub(crate) path: String,
    /// The size of the file, or of all files in the folder, bytes.
    pub(crate) bytes: u64,
    /// The checksum of the file's content. For a folder, the checksum of a sorted list of its files, with a
    /// line `path,bytes,xxh3_128` for each and paths from the folder.
    pub(crate) xxh3_128: Checksum,
}

impl InputRecord {
    /// Records a text that stands for a file on no disk.
    pub(crate) fn of_text(name: &str, text: &str) -> Self {
        Self {
            path: format!("memory:{name}"),
            bytes: text.len() as u64,
            xxh3_128: Checksum::of(text.as_bytes()),
        }
    }
}

/// Returns how the options differ.
fn option_differences(there: &ExportOptions, now: &ExportOptions) -> Vec<Difference> {
    let there = stored_fields(there);
    let now = stored_fields(now);
    // An option that has its default may not be stored.
    let names: BTreeSet<&String> = there.keys().chain(now.keys()).collect();
    names
        .into_iter()
        .map(|name| (name, stored_value(&there, name), stored_value(&now, name)))
        .filter(|(_, there, now)| there != now)
        .map(|(name, there, now)| difference(name, &there, &now))
        .collect()
}

/// Returns the options as they are stored.
fn stored_fields(options: &ExportOptions) -> serde_json::Map<String, Value> {
    match serde_json::to_value(options) {
        Ok(Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    }
}

fn stored_value(fields: &serde_json::Map<String, Value>, name: &str) -> Value {
    fields.get(name).cloned().unwrap_or_default()
}

/// Returns how an option differs. A switch is set or not; any other option has a value.
fn difference(name: &str, there: &Value, now: &Value) -> Difference {
    let name = name.to_owned();
    match (there, now) {
        (Value::Bool(there), _) => Difference::Switch { name, value: None, now: !there },
        (a, b) if name == "normals" && is_smooth(a) != is_smooth(b) => {
            Difference::Switch { name, value: Some("smooth".to_owned()), now: is_smooth(b) }
        }
        _ => Difference::Option { name, there: words(there), now: words(now) },
    }
}

fn is_smooth(value: &Value) -> bool {
    value == "smooth"
}

/// Returns a difference outside the options.
fn other(text: String) -> Difference {
    Difference::Other(text)
}

fn words(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) if items.is_empty() => "none".to_owned(),
        Value::Array(items) => items.iter().map(words).collect::<Vec<_>>().join(","),
        Value::Null => "none".to_owned(),
        other => other.to_string(),
    }
}

impl Request {
    /// Builds the request for these options and areas.
    pub(crate) fn new(options: &ExportOptions, areas: Vec<RequestedArea>) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let stored =
            ExportOptions { seed: 0, place_cameras: None, see: None, allow: Vec::new(), ..options.clone() };
        Self { version, seed: options.seed, options: stored, areas }
    }

    /// The numbers of the areas.
    pub(crate) fn numbers(&self) -> Vec<u32> {
        self.areas.iter().map(|a| a.area).collect()
    }

    /// Returns what is subtracted from the coordinates of the areas' scans.
    pub(crate) fn world_offsets(&self) -> WorldOffsets {
        self.areas.iter().filter_map(|a| Some((a.area, a.offset_m?))).collect()
    }

    /// Returns the record of a file or folder of an area's input, by its name.
    pub(crate) fn input(&self, area: u32, name: &str) -> Option<&InputRecord> {
        let area = self.areas.iter().find(|a| a.area == area)?;
        area.inputs
            .iter()
            .find(|i| i.path.strip_suffix('/').unwrap_or(&i.path) == name)
    }

    /// Returns the same request with labels and scores alone, for a plan.
    pub(crate) fn of_plan(&self) -> Self {
        // Every option is named, so that a new one is weighed here too.
        let ExportOptions {
            views,
            size,
            lenient,
            fill,
            trim_strays,
            entropy_stride,
            // The request has these elsewhere.
            seed: _,
            place_cameras: _,
            see: _,
            // Labels and scores do not depend on these.
            pano_width: _,
            pool: _,
            points_per_m2: _,
            modalities: _,
            keep_all: _,
            only: _,
            normals: _,
            rgb_samples: _,
            semantic_glb: _,
            compression: _,
            xyz: _,
            normal_axes: _,
            depth_units: _,
            pad_labels: _,
            profiles: _,
            allow: _,
        } = self.options;
        let options = ExportOptions {
            views,
            size,
            lenient,
            fill,
            trim_strays,
            entropy_stride,
            modalities: Vec::new(),
            ..ExportOptions::default()
        };
        Self { options, ..self.clone() }
    }

    /// Returns how the request `now` differs from this one. Requests without differences make the same bytes.
    pub(crate) fn differences(&self, now: &Self) -> Vec<Difference> {
        let mut differences = Vec::new();
        if self.version != now.version {
            differences.push(other(format!("version {} of s3d there, {} now", self.version, now.version)));
        }
        if self.seed != now.seed {
            differences.push(Difference::Option {
                name: "seed".to_owned(),
                there: self.seed.to_string(),
                now: now.seed.to_string(),
            });
        }
        differences.extend(option_differences(&self.options, &now.options));

        let there = by_number(&self.areas);
        let now = by_number(&now.areas);
        for (number, before) in &there {
            match now.get(number) {
                Some(after) => differences.extend(before.differences(after)),
                None => differences.push(other(format!("area {number} there, not now"))),
            }
        }

        let more = now.keys().filter(|number| !there.contains_key(number));
        differences.extend(more.map(|number| other(format!("area {number} now, not there"))));
        differences
    }
}

fn by_number(areas: &[RequestedArea]) -> BTreeMap<u32, RequestedArea> {
    areas.iter().map(|area| (area.area, area.clone())).collect()
}

impl RequestedArea {
    fn differences(&self, now: &Self) -> Vec<Difference> {
        let mut differences = Vec::new();
        if (self.place_cameras, self.see) != (now.place_cameras, now.see) {
            differences.push(other(format!(
                "placed scan locations of area {}: {} there, {} now",
                self.area,
                self.placing_in_words(),
                now.placing_in_words()
            )));
        }
        if self.offset_m != now.offset_m {
            differences.push(other(format!(
                "offset_m of area {}: {} there, {} now",
                self.area,
                offset_in_words(self.offset_m),
                offset_in_words(now.offset_m)
            )));
        }

        let there = by_path(&self.inputs);
        let after = by_path(&now.inputs);
        for (path, before) in &there {
            match after.get(path) {
                Some(now) if now == before => {}
                Some(_) => differences.push(other(format!("{path}: other bytes"))),
                None => differences.push(other(format!("{path}: input there, not now"))),
            }
        }

        let more = after.keys().filter(|path| !there.contains_key(*path));
        differences.extend(more.map(|path| other(format!("{path}: input now, not there"))));

        // The same files in another order are another input, since meshes are joined in the order of the
        // scene file.
        if differences.is_empty() && self.inputs != now.inputs {
            differences.push(other(format!("area {}: its input in another order", self.area)));
        }
        differences
    }

    fn placing_in_words(&self) -> String {
        match (self.place_cameras, self.see) {
            (Some(m), _) => format!("{m} m apart"),
            (None, Some(share)) => format!("to see {share} of the surface"),
            (None, None) => "none".to_owned(),
        }
    }
}

fn offset_in_words(offset_m: Option<[f64; 3]>) -> String {
    offset_m.map_or("none".to_owned(), |offset| format!("{offset:?}"))
}

/// Groups the sizes and checksums of inputs by their path.
fn by_path(inputs: &[InputRecord]) -> BTreeMap<String, Vec<(u64, Checksum)>> {
    let mut map: BTreeMap<String, Vec<(u64, Checksum)>> = BTreeMap::new();
    for input in inputs {
        map.entry(input.path.clone())
            .or_default()
            .push((input.bytes, input.xxh3_128));
    }
    map
}

/// Reads the request of an unfinished export, if there is one.
///
/// # Errors
/// Fails as [`if_there`] does if the file cannot be read now.
pub(crate) fn read_request(layout: &Layout) -> Result<Option<Request>> {
    if_there(read_json(&layout.request()))
}

/// Returns the version of s3d that began an unfinished export, if it is another one. Its request may have
/// options that this version cannot read.
pub(crate) fn begun_by_other_version(layout: &Layout) -> Result<Option<String>> {
    #[derive(Deserialize)]
    struct Begun {
        version: String,
    }
    let begun: Option<Begun> = if_there(read_json(&layout.request()))?;
    Ok(begun
        .map(|begun| begun.version)
        .filter(|version| version != env!("CARGO_PKG_VERSION")))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::options::PadLabels;
    use crate::options::profile::Profile;
    use s3d_io::dataset::{Domain, XyzType};
    use s3d_render::Normals;
    use s3d_sample::Pool;

    fn texts(differences: &[Difference]) -> Vec<String> {
        differences.iter().map(Difference::to_string).collect()
    }

    pub(crate) fn request() -> Request {
        Request {
            version: "1.2.3".into(),
            seed: 0,
            options: ExportOptions {
                modalities: vec![Domain::Rgb, Domain::Depth],
                pad_labels: PadLabels(0),
                ..ExportOptions::default()
            },
            areas: vec![area(1), area(3)],
        }
    }

    fn input(path: &str) -> InputRecord {
        InputRecord { path: path.into(), bytes: 7, xxh3_128: Checksum(7) }
    }

    fn area(area: u32) -> RequestedArea {
        RequestedArea {
            area,
            place_cameras: None,
            see: None,
            offset_m: None,
            inputs: vec![input("scene.toml"), input("rgb.obj"), input("Area_1/")],
        }
    }

    #[test]
    fn equal_requests_have_no_differences_and_come_back_from_json() {
        let text = serde_json::to_string(&request()).unwrap();
        let back: Request = serde_json::from_str(&text).unwrap();
        assert_eq!(back, request());
        assert!(request().differences(&back).is_empty());
    }

    /// Returns the differences after a change of the request.
    fn changed(change: impl Fn(&mut Request)) -> Vec<String> {
        let mut now = request();
        change(&mut now);
        assert_ne!(now, request());
        texts(&request().differences(&now))
    }

    /// Returns the differences for a plan after a change of the request.
    fn changed_plan(change: impl Fn(&mut Request)) -> Vec<String> {
        let mut now = request();
        change(&mut now);
        texts(&request().of_plan().differences(&now.of_plan()))
    }

    #[test]
    fn each_difference_is_told_in_words() {
        assert_eq!(changed(|r| r.seed = 7), ["`seed` 0 there, 7 now"]);
        assert_eq!(changed(|r| r.version = "2.0.0".into()), ["version 1.2.3 of s3d there, 2.0.0 now"]);
        assert_eq!(changed(|r| r.options.pano_width = 64), ["`pano_width` 4096 there, 64 now"]);
        assert_eq!(changed(|r| r.options.fill = Some(0.5)), ["`fill` none there, 0.5 now"]);
        assert_eq!(changed(|r| r.options.keep_all = true), ["`keep_all` now, not there"]);
        assert_eq!(changed(|r| r.options.normals = Normals::Smooth), ["`normals = smooth` now, not there"]);

        assert_eq!(
            changed(|r| r.options.only = vec!["a".into(), "b".into()]),
            ["`only` none there, a,b now"]
        );
        assert_eq!(
            changed(|r| r.options.profiles = vec![Profile::PointNet]),
            ["`profiles` none there, pointnet now"]
        );

        assert_eq!(changed(|r| r.areas[1].inputs[1].xxh3_128 = Checksum(8)), ["rgb.obj: other bytes"]);
        assert_eq!(changed(|r| drop(r.areas[0].inputs.remove(2))), ["Area_1/: input there, not now"]);
        assert_eq!(changed(|r| r.areas[0].inputs.swap(0, 1)), ["area 1: its input in another order"]);
        assert_eq!(
            changed(|r| r.areas[0].place_cameras = Some(2.5)),
            ["placed scan locations of area 1: none there, 2.5 m apart now"]
        );
        assert_eq!(
            changed(|r| r.areas[0].see = Some(0.9)),
            ["placed scan locations of area 1: none there, to see 0.9 of the surface now"]
        );
        assert_eq!(
            changed(|r| r.areas[0].offset_m = Some([5e5, 0.0, 1.5])),
            ["offset_m of area 1: none there, [500000.0, 0.0, 1.5] now"]
        );

        assert_eq!(changed(|r| drop(r.areas.remove(1))), ["area 3 there, not now"]);
        assert_eq!(changed(|r| r.areas[1].area = 4), ["area 3 there, not now", "area 4 now, not there"]);
    }

    #[test]
    fn a_plan_is_for_any_images_of_the_same_scores() {
        let other_images = changed_plan(|r| {
            r.options.pano_width = 64;
            r.options.pool = Pool::Area;
            r.options.only = vec!["a".into()];
            r.options.xyz = XyzType::None;
        });
        assert!(other_images.is_empty());
        assert_eq!(changed_plan(|r| r.options.size = 64), ["`size` 1080 there, 64 now"]);
        assert_eq!(changed_plan(|r| r.options.fill = Some(0.5)), ["`fill` none there, 0.5 now"]);
        let trimmed = changed_plan(|r| r.options.trim_strays = Some(1.0));
        assert_eq!(trimmed, ["`trim_strays` none there, 1.0 now"]);
        assert_eq!(changed_plan(|r| r.options.lenient = true), ["`lenient` now, not there"]);
        assert_eq!(changed_plan(|r| r.seed = 7), ["`seed` 0 there, 7 now"]);

        let known = request();
        assert_eq!(known.input(3, "Area_1").map(|i| i.path.as_str()), Some("Area_1/"));
        assert!(known.input(1, "rgb.obj").is_some() && known.input(2, "rgb.obj").is_none());
    }
}
