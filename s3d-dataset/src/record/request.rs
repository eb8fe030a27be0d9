//! What decides the bytes of a data set: the version of s3d, the options, the input. Two exports of equal
//! requests write the same files, so that one can go on where the other was killed.

use crate::error::{Difference, Result};
use crate::options::ExportOptions;
use crate::record::if_there;
use s3d_io::dataset::{Layout, WorldOffsets};
use s3d_io::fs::{Checksum, read_json};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// What is asked for. It names neither threads nor folders of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Request {
    /// Of s3d.
    pub(crate) version: String,
    pub(crate) seed: u64,
    /// Without the seed and the distance of placed locations, which stand above and below.
    pub(crate) options: ExportOptions,
    /// The areas, by number.
    pub(crate) areas: Vec<RequestedArea>,
}

/// An area that is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RequestedArea {
    pub(crate) area: u32,
    /// How far apart scan locations are placed, metres; null if the scene has its own, or `see` is there.
    pub(crate) place_cameras: Option<f64>,
    /// Which share of the surface they are placed to see, if they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) see: Option<f64>,
    /// What is subtracted from the scan's coordinates, metres; not there if nothing is. It follows from what
    /// is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offset_m: Option<[f64; 3]>,
    /// What is read.
    pub(crate) inputs: Vec<InputRecord>,
}

/// A file or folder of the input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputRecord {
    /// From the folder of the scene file; of what is named by a whole path its last part alone. That of a
    /// folder ends with `/`.
    pub(crate) path: String,
    /// Its size; of a folder that of all files in it.
    pub(crate) bytes: u64,
    /// The checksum of its content; of a folder that of a list of its files, a line `path,bytes,xxh3_128`
    /// each, paths from the folder and sorted.
    pub(crate) xxh3_128: Checksum,
}

impl InputRecord {
    /// Of a text that stands for a file which nobody wrote.
    pub(crate) fn of_text(name: &str, text: &str) -> Self {
        let (bytes, xxh3_128) = (text.len() as u64, Checksum::of(text.as_bytes()));
        Self { path: format!("memory:{name}"), bytes, xxh3_128 }
    }
}

/// What differs between options.
fn option_differences(there: &ExportOptions, now: &ExportOptions) -> Vec<Difference> {
    let there = stored_fields(there);
    let now = stored_fields(now);
    // An option that has its default may not be stored.
    let names: BTreeSet<&String> = there.keys().chain(now.keys()).collect();
    let value = |of: &serde_json::Map<String, Value>, name: &str| of.get(name).cloned().unwrap_or_default();
    names
        .into_iter()
        .map(|name| (name, value(&there, name), value(&now, name)))
        .filter(|(_, there, now)| there != now)
        .map(|(name, there, now)| difference(name, &there, &now))
        .collect()
}

/// The options as they are stored.
fn stored_fields(options: &ExportOptions) -> serde_json::Map<String, Value> {
    match serde_json::to_value(options) {
        Ok(Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    }
}

/// How an option differs: a switch is set or not, anything else has a value.
fn difference(name: &str, there: &Value, now: &Value) -> Difference {
    let is_smooth = |value: &Value| value == "smooth";
    let switch = |value: Option<String>, now: bool| Difference::Switch { name: name.to_owned(), value, now };
    match (there, now) {
        (Value::Bool(there), _) => switch(None, !there),
        (a, b) if name == "normals" && is_smooth(a) != is_smooth(b) => {
            switch(Some("smooth".to_owned()), is_smooth(b))
        }
        _ => Difference::Option { name: name.to_owned(), there: words(there), now: words(now) },
    }
}

/// A difference that is no option's.
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
    /// What is asked for by these options of areas with this input.
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

    /// What is subtracted from the coordinates of the areas' scans.
    pub(crate) fn world_offsets(&self) -> WorldOffsets {
        self.areas.iter().filter_map(|a| Some((a.area, a.offset_m?))).collect()
    }

    /// What is known of a file or folder of an area's input, by its name.
    pub(crate) fn input(&self, area: u32, name: &str) -> Option<&InputRecord> {
        let area = self.areas.iter().find(|a| a.area == area)?;
        area.inputs
            .iter()
            .find(|i| i.path.strip_suffix('/').unwrap_or(&i.path) == name)
    }

    /// The same request with nothing asked for but labels and scores: what a plan is made for.
    pub(crate) fn of_plan(&self) -> Self {
        let ExportOptions { views, size, lenient, fill, entropy_stride, .. } = self.options;
        let options = ExportOptions {
            views,
            size,
            lenient,
            fill,
            entropy_stride,
            modalities: Vec::new(),
            ..ExportOptions::default()
        };
        Self { options, ..self.clone() }
    }

    /// How the request `now` differs from this one. There is no difference if the two make the same bytes.
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
        let by_number = |areas: &[RequestedArea]| -> BTreeMap<u32, RequestedArea> {
            areas.iter().map(|a| (a.area, a.clone())).collect()
        };
        let (there, now) = (by_number(&self.areas), by_number(&now.areas));
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

impl RequestedArea {
    fn differences(&self, now: &Self) -> Vec<Difference> {
        let mut differences = Vec::new();
        if (self.place_cameras, self.see) != (now.place_cameras, now.see) {
            let words = |area: &Self| match (area.place_cameras, area.see) {
                (Some(m), _) => format!("{m} m apart"),
                (None, Some(share)) => format!("to see {share} of the surface"),
                (None, None) => "none".to_owned(),
            };
            differences.push(other(format!(
                "placed scan locations of area {}: {} there, {} now",
                self.area,
                words(self),
                words(now)
            )));
        }
        if self.offset_m != now.offset_m {
            let words = |offset: Option<[f64; 3]>| offset.map_or("none".to_owned(), |o| format!("{o:?}"));
            differences.push(other(format!(
                "offset_m of area {}: {} there, {} now",
                self.area,
                words(self.offset_m),
                words(now.offset_m)
            )));
        }
        let by_path = |inputs: &[InputRecord]| -> BTreeMap<String, Vec<(u64, Checksum)>> {
            let mut map: BTreeMap<String, Vec<(u64, Checksum)>> = BTreeMap::new();
            for input in inputs {
                map.entry(input.path.clone())
                    .or_default()
                    .push((input.bytes, input.xxh3_128));
            }
            map
        };
        let (there, after) = (by_path(&self.inputs), by_path(&now.inputs));
        for (path, before) in &there {
            match after.get(path) {
                Some(now) if now == before => {}
                Some(_) => differences.push(other(format!("{path}: other bytes"))),
                None => differences.push(other(format!("{path}: input there, not now"))),
            }
        }
        let more = after.keys().filter(|path| !there.contains_key(*path));
        differences.extend(more.map(|path| other(format!("{path}: input now, not there"))));
        // The same files in another order are another input: meshes are joined in the order of the scene
        // file.
        if differences.is_empty() && self.inputs != now.inputs {
            differences.push(other(format!("area {}: its input in another order", self.area)));
        }
        differences
    }
}

/// The request of an unfinished export, if there is one.
///
/// # Errors
/// It cannot be read now: as [`if_there`].
pub(crate) fn read_request(layout: &Layout) -> Result<Option<Request>> {
    if_there(read_json(&layout.request()))
}

/// The version of s3d that began an unfinished export whose request this one cannot read, for it has other
/// options.
pub(crate) fn begun_by_other_version(layout: &Layout) -> Result<Option<String>> {
    #[derive(Deserialize)]
    struct Of {
        version: String,
    }
    let of: Option<Of> = if_there(read_json(&layout.request()))?;
    Ok(of
        .map(|of| of.version)
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

    fn area(area: u32) -> RequestedArea {
        let input = |path: &str| InputRecord { path: path.into(), bytes: 7, xxh3_128: Checksum(7) };
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

    #[test]
    fn each_difference_is_told_in_words() {
        let changed = |change: &dyn Fn(&mut Request)| {
            let mut now = request();
            change(&mut now);
            assert_ne!(now, request());
            texts(&request().differences(&now))
        };
        assert_eq!(changed(&|r| r.seed = 7), ["`seed` 0 there, 7 now"]);
        assert_eq!(changed(&|r| r.version = "2.0.0".into()), ["version 1.2.3 of s3d there, 2.0.0 now"]);
        assert_eq!(changed(&|r| r.options.pano_width = 64), ["`pano_width` 4096 there, 64 now"]);
        assert_eq!(changed(&|r| r.options.fill = Some(0.5)), ["`fill` none there, 0.5 now"]);
        assert_eq!(changed(&|r| r.options.keep_all = true), ["`keep_all` now, not there"]);
        assert_eq!(changed(&|r| r.options.normals = Normals::Smooth), ["`normals = smooth` now, not there"]);
        assert_eq!(
            changed(&|r| r.options.only = vec!["a".into(), "b".into()]),
            ["`only` none there, a,b now"]
        );
        assert_eq!(
            changed(&|r| r.options.profiles = vec![Profile::PointNet]),
            ["`profiles` none there, pointnet now"]
        );
        assert_eq!(changed(&|r| r.areas[1].inputs[1].xxh3_128 = Checksum(8)), ["rgb.obj: other bytes"]);
        assert_eq!(changed(&|r| drop(r.areas[0].inputs.remove(2))), ["Area_1/: input there, not now"]);
        assert_eq!(changed(&|r| r.areas[0].inputs.swap(0, 1)), ["area 1: its input in another order"]);
        assert_eq!(
            changed(&|r| r.areas[0].place_cameras = Some(2.5)),
            ["placed scan locations of area 1: none there, 2.5 m apart now"]
        );
        assert_eq!(
            changed(&|r| r.areas[0].see = Some(0.9)),
            ["placed scan locations of area 1: none there, to see 0.9 of the surface now"]
        );
        assert_eq!(
            changed(&|r| r.areas[0].offset_m = Some([5e5, 0.0, 1.5])),
            ["offset_m of area 1: none there, [500000.0, 0.0, 1.5] now"]
        );
        assert_eq!(changed(&|r| drop(r.areas.remove(1))), ["area 3 there, not now"]);
        assert_eq!(changed(&|r| r.areas[1].area = 4), ["area 3 there, not now", "area 4 now, not there"]);
    }

    #[test]
    fn a_plan_is_for_any_images_of_the_same_scores() {
        let changed = |change: &dyn Fn(&mut Request)| {
            let mut now = request();
            change(&mut now);
            texts(&request().of_plan().differences(&now.of_plan()))
        };
        let other_images = |r: &mut Request| {
            r.options.pano_width = 64;
            r.options.pool = Pool::Area;
            r.options.only = vec!["a".into()];
            r.options.xyz = XyzType::None;
        };
        assert!(changed(&other_images).is_empty());
        assert_eq!(changed(&|r| r.options.size = 64), ["`size` 1080 there, 64 now"]);
        assert_eq!(changed(&|r| r.options.fill = Some(0.5)), ["`fill` none there, 0.5 now"]);
        assert_eq!(changed(&|r| r.options.lenient = true), ["`lenient` now, not there"]);
        assert_eq!(changed(&|r| r.seed = 7), ["`seed` 0 there, 7 now"]);
        let known = request();
        assert_eq!(known.input(3, "Area_1").map(|i| i.path.as_str()), Some("Area_1/"));
        assert!(known.input(1, "rgb.obj").is_some() && known.input(2, "rgb.obj").is_none());
    }
}
