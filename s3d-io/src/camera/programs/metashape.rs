//! The cameras of a Metashape chunk, as "Export Cameras" writes them in XML. Source: Agisoft Metashape's
//! manual, "Camera models"; nerfstudio-project/nerfstudio, nerfstudio/process_data/metashape_utils.py.
//!
//! A camera's `transform` is camera → chunk in OpenCV's axes, 4 × 4. The transform of its component, or
//! else of the chunk, leads to the world: a rotation, a shift and a scale. Places in a picture are counted
//! from its middle. Metashape's p₁ is OpenCV's p₂, and the other way round.

use crate::camera::located::pose_from_opencv;
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::quote::quote;
use roxmltree::{Document, Node};
use s3d_geom::glam::{DMat3, DVec3, dvec2};
use std::collections::HashMap;
use std::path::Path;

/// The largest difference of a rotation from a rotation. Files have 16 digits.
const ROTATION_ERROR: f64 = 1e-3;

/// A skew that moves no pixel by more than this is left out, pixels.
const SKEW_PX: f64 = 0.1;

/// Places that are farther from the origin than this are in the axes of the Earth, metres.
const GEOCENTRIC_M: f64 = 6e6;

/// A transform from a chunk or a component to the world.
#[derive(Clone, Copy)]
struct Placing {
    turn: DMat3,
    shift: DVec3,
    scale: f64,
}

/// The elements of sensors by their ids.
type Sensors<'a, 'i> = HashMap<&'a str, Node<'a, 'i>>;

/// Returns whether a text is XML.
pub(crate) fn is_xml(text: &[u8]) -> bool {
    let text = text.trim_ascii_start();
    [&b"<?xml"[..], b"<document", b"<!--"]
        .iter()
        .any(|start| text.starts_with(start))
}

/// Reads the cameras of a document. Also returns the number of cameras without a pose.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<(Vec<PosedCamera>, usize)> {
    let text = text_of(bytes, path)?;
    let text = std::str::from_utf8(&text).map_err(|_| Error::format(path, "is no text in UTF-8"))?;
    let document = Document::parse(text)
        .map_err(|e| Error::line(path, u64::from(e.pos().row), format!("is no valid XML: {e}")))?;
    let root = document.root_element();
    let chunk = child(root, "chunk").filter(|_| root.has_tag_name("document"));
    let Some(chunk) = chunk else {
        let is_project = root.has_tag_name("document") && root.has_attribute("path");
        return Err(Error::unsupported(path, if is_project { PROJECT } else { OTHER_XML }));
    };

    let list = List { path, document: &document };
    let sensors: Sensors<'_, '_> = child(chunk, "sensors")
        .into_iter()
        .flat_map(|node| node.children())
        .filter_map(|node| Some((node.attribute("id")?, node)))
        .collect();
    let placings = list.placings(chunk)?;
    let of_chunk = list.placing(chunk)?;
    let cameras = child(chunk, "cameras").into_iter().flat_map(|node| node.descendants());
    let mut posed = Vec::new();
    let mut untracked = 0;
    // The line of the camera that begins at the byte `at`.
    let mut line = 1;
    let mut at = 0;

    for node in cameras.filter(|node| node.has_tag_name("camera")) {
        let Some(transform) = child(node, "transform") else {
            untracked += 1;
            continue;
        };
        let placing = node
            .attribute("component_id")
            .and_then(|id| placings.get(id))
            .or(of_chunk.as_ref());
        let start = node.range().start;
        let between = text.as_bytes().get(at..start).unwrap_or_default();
        line += between.iter().filter(|b| **b == b'\n').count() as u64;
        at = start;
        let camera = list.camera(node, transform, placing, &sensors)?;
        posed.push(PosedCamera { line, ..camera });
    }
    Ok((posed, untracked))
}

/// The explanation of a project file.
pub(crate) const PROJECT: &str = "is a project of Metashape, not its cameras: export them as XML (File, \
                                  Export, Export Cameras)";

/// The explanation of any other XML.
const OTHER_XML: &str = "is XML, but not the cameras of a Metashape chunk: it has no document with a chunk";

/// Returns the first child element of this name.
fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// A document that is read.
struct List<'a, 'i> {
    path: &'a Path,
    document: &'a Document<'i>,
}

impl List<'_, '_> {
    fn fault(&self, node: Node<'_, '_>, message: String) -> Error {
        let row = self.document.text_pos_at(node.range().start).row;
        Error::line(self.path, u64::from(row), message)
    }

    /// Returns the numbers in an element.
    fn numbers<const N: usize>(&self, node: Node<'_, '_>) -> Result<[f64; N]> {
        let text = node.text().unwrap_or_default();
        let numbers: Option<Vec<f64>> = text
            .split_ascii_whitespace()
            .map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
            .collect();
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        numbers.ok_or_else(|| {
            let name = node.tag_name().name();
            let what = if N == 1 {
                "one number".to_owned()
            } else {
                format!("{N} numbers")
            };
            self.fault(node, format!("{name}: {} is not {what}", quote(text.trim().as_bytes())))
        })
    }

    /// Returns the number in a child element, 0 if there is none.
    fn number(&self, node: Node<'_, '_>, name: &str) -> Result<f64> {
        match child(node, name) {
            None => Ok(0.0),
            Some(node) => self.numbers::<1>(node).map(|[number]| number),
        }
    }

    /// Returns the transforms of the chunk's components by their ids.
    fn placings<'a>(&self, chunk: Node<'a, '_>) -> Result<HashMap<&'a str, Placing>> {
        let components = child(chunk, "components").into_iter().flat_map(|node| node.children());
        let mut placings = HashMap::new();
        for node in components.filter(|node| node.has_tag_name("component")) {
            if let (Some(id), Some(placing)) = (node.attribute("id"), self.placing(node)?) {
                placings.insert(id, placing);
            }
        }
        Ok(placings)
    }

    /// Returns the transform of a chunk or a component, if it has one.
    fn placing(&self, of: Node<'_, '_>) -> Result<Option<Placing>> {
        let Some(node) = child(of, "transform") else { return Ok(None) };
        let turn = match child(node, "rotation") {
            None => DMat3::IDENTITY,
            Some(rotation) => {
                let turn = DMat3::from_cols_array(&self.numbers(rotation)?).transpose();
                self.must_turn(rotation, &turn)?;
                turn
            }
        };
        let shift = match child(node, "translation") {
            None => DVec3::ZERO,
            Some(translation) => DVec3::from_array(self.numbers(translation)?),
        };
        let scale = match child(node, "scale") {
            None => 1.0,
            Some(scale) => self.numbers::<1>(scale).map(|[scale]| scale)?,
        };

        if scale <= 0.0 {
            return Err(self.fault(node, format!("{scale} is no scale")));
        }
        if shift.length() > GEOCENTRIC_M {
            let message = "its world has the axes of the Earth (geocentric coordinates), in which no mesh is \
                           exported: set the chunk's reference to Local Coordinates, update, and export \
                           cameras and mesh again";
            return Err(self.fault(node, message.into()));
        }
        Ok(Some(Placing { turn, shift, scale }))
    }

    /// Refuses a matrix that is no rotation.
    fn must_turn(&self, node: Node<'_, '_>, turn: &DMat3) -> Result<()> {
        if !(turn.transpose() * *turn).abs_diff_eq(DMat3::IDENTITY, ROTATION_ERROR) {
            let message = "its axes are not of length 1 and at right angles: it is no rotation";
            return Err(self.fault(node, message.into()));
        }
        if turn.determinant() < 0.0 {
            return Err(self.fault(node, "it mirrors: its determinant is −1, a rotation's is 1".into()));
        }
        Ok(())
    }

    /// Returns a camera in the world. Its line is not set.
    fn camera(
        &self,
        node: Node<'_, '_>,
        transform: Node<'_, '_>,
        placing: Option<&Placing>,
        sensors: &Sensors<'_, '_>,
    ) -> Result<PosedCamera> {
        let [a, b, c, x, d, e, f, y, g, h, i, z, last @ ..] = self.numbers::<16>(transform)?;
        if last != [0.0, 0.0, 0.0, 1.0] {
            return Err(self.fault(transform, "the last row of its matrix is not 0 0 0 1".into()));
        }
        let mut turn = DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, i]);
        self.must_turn(transform, &turn)?;

        let mut location = DVec3::new(x, y, z);
        if let Some(Placing { turn: world_from_chunk, shift, scale }) = placing {
            location = *world_from_chunk * location * *scale + *shift;
            turn = *world_from_chunk * turn;
        }

        let id = node.attribute("sensor_id").unwrap_or_default();
        let name = node.attribute("label").unwrap_or_default().to_owned();
        let sensor = sensors.get(id).ok_or_else(|| {
            let of = quote(name.as_bytes());
            self.fault(node, format!("{of}: there is no sensor {}", quote(id.as_bytes())))
        })?;
        let size = self.size(*sensor)?;
        let optics = Some(self.optics(*sensor, size)?);
        let pose = pose_from_opencv(location, turn.x_axis, turn.y_axis, turn.z_axis);
        Ok(PosedCamera { size: Some(size), optics, ..PosedCamera::new(name, pose) })
    }

    /// Returns the width and height of a sensor's pictures.
    fn size(&self, sensor: Node<'_, '_>) -> Result<[u32; 2]> {
        let resolution = child(sensor, "resolution");
        let side = |name: &str| {
            let text = resolution.and_then(|node| node.attribute(name))?;
            text.parse::<u32>().ok().filter(|side| *side > 0)
        };
        let (Some(width), Some(height)) = (side("width"), side("height")) else {
            return Err(self.fault(sensor, "the sensor has no resolution with a width and a height".into()));
        };
        Ok([width, height])
    }

    /// Returns the optics of a sensor: the calibration that was adjusted, or else the last.
    fn optics(&self, sensor: Node<'_, '_>, [width, height]: [u32; 2]) -> Result<Optics> {
        let calibrations = || sensor.children().filter(|node| node.has_tag_name("calibration"));
        let adjusted = calibrations().find(|node| node.attribute("class") == Some("adjusted"));
        let calibration = adjusted.or_else(|| calibrations().next_back());
        let kind = calibration
            .and_then(|node| node.attribute("type"))
            .or_else(|| sensor.attribute("type"))
            .unwrap_or("frame");
        if kind == "spherical" || sensor.attribute("type") == Some("spherical") {
            return Ok(Optics::Equirectangular);
        }
        let Some(node) = calibration else {
            return Err(self.fault(sensor, "the sensor has no calibration".into()));
        };
        if kind != "frame" && kind != "fisheye" {
            let message = format!(
                "a sensor of the type {} is not supported: frame, fisheye and spherical are; export \
                 undistorted photographs with their cameras",
                quote(kind.as_bytes())
            );
            return Err(self.fault(node, message));
        }

        let f = self.number(node, "f")?;
        let fx = f + self.number(node, "b1")?;
        if f <= 0.0 || fx <= 0.0 {
            return Err(self.fault(node, format!("focal lengths of {fx} and {f} px: both must be above 0")));
        }
        let skew_px = self.number(node, "b2")?;
        if skew_px.abs() * 0.5 * f64::from(height) > SKEW_PX * f {
            let message = format!("b2 is {skew_px}: pixels that are no rectangles are not supported");
            return Err(self.fault(node, message));
        }

        let middle = dvec2(f64::from(width), f64::from(height)) * 0.5;
        let center = middle + dvec2(self.number(node, "cx")?, self.number(node, "cy")?);
        let distortion = self.distortion(node, kind == "fisheye")?;
        Ok(Optics::Pinhole { focal_px: dvec2(fx, f), center_px: Some(center), distortion })
    }

    fn distortion(&self, node: Node<'_, '_>, is_fisheye: bool) -> Result<Distortion> {
        let mut k = [0.0; 4];
        for (k, name) in k.iter_mut().zip(["k1", "k2", "k3", "k4"]) {
            *k = self.number(node, name)?;
        }
        let [k1, k2, k3, _] = k;
        let p1 = self.number(node, "p1")?;
        let p2 = self.number(node, "p2")?;

        // What OpenCV's models lack.
        let lacking: &[&str] = if is_fisheye {
            &["p1", "p2", "p3", "p4"]
        } else {
            &["k4", "p3", "p4"]
        };
        for name in lacking {
            let number = self.number(node, name)?;
            if number != 0.0 {
                let message = format!(
                    "{name} is {number}: only lenses without it are supported; optimize the cameras without \
                     {name}, or export undistorted photographs with their cameras"
                );
                return Err(self.fault(node, message));
            }
        }

        if is_fisheye {
            Ok(Distortion::Fisheye(k))
        } else {
            Ok(Distortion::opencv([k1, k2, p2, p1, k3]))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;

    /// A chunk with sensors of three types. Its world is twice as large, turned by 90° around +Z, and
    /// shifted.
    const CHUNK: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0">
  <chunk label="Chunk 1" enabled="true">
    <sensors next_id="3">
      <sensor id="0" label="phone" type="frame">
        <resolution width="4000" height="3000"/>
        <calibration type="frame" class="initial"><f>1</f></calibration>
        <calibration type="frame" class="adjusted">
          <resolution width="4000" height="3000"/>
          <f>3000.5</f><cx>12.5</cx><cy>-7.25</cy><b1>1.5</b1><b2>0.0001</b2>
          <k1>0.1</k1><k2>-0.2</k2><k3>0.03</k3><p1>0.001</p1><p2>-0.002</p2>
        </calibration>
      </sensor>
      <sensor id="1" label="unknown" type="spherical"><resolution width="5888" height="2944"/></sensor>
      <sensor id="2" label="fish" type="fisheye">
        <resolution width="400" height="300"/>
        <calibration type="fisheye" class="adjusted"><f>100</f><k1>0.1</k1><k4>0.4</k4></calibration>
      </sensor>
    </sensors>
    <cameras next_id="4" next_group_id="1">
      <camera sensor_id="0" label="IMG_1"><transform>1 0 0 1 0 0 1 2 0 -1 0 3 0 0 0 1</transform></camera>
      <camera id="1" sensor_id="0" label="IMG_2"/>
      <group id="0" label="Group 1">
        <camera id="2" sensor_id="1" label="pano.jpg">
          <transform>1 0 0 1 0 0 1 2 0 -1 0 3 0 0 0 1</transform>
        </camera>
        <camera sensor_id="2" label="f"><transform>1 0 0 1 0 0 1 2 0 -1 0 3 0 0 0 1</transform></camera>
      </group>
    </cameras>
    <transform>
      <rotation locked="true">0 -1 0 1 0 0 0 0 1</rotation>
      <translation locked="true">10 20 30</translation>
      <scale locked="true">2</scale>
    </transform>
  </chunk>
</document>
"#;

    fn read_text(text: &str) -> Result<(Vec<PosedCamera>, usize)> {
        read(Path::new("cameras.xml"), text.as_bytes())
    }

    #[test]
    fn cameras_are_in_the_world_of_the_chunk() {
        assert!(
            is_xml(CHUNK.as_bytes())
                && is_xml(
                    b"
<document>"
                )
                && !is_xml(b"1 2 3")
        );
        let (cameras, untracked) = read_text(CHUNK).unwrap();
        assert_eq!((cameras.len(), untracked), (3, 1));
        let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        assert_eq!(names, ["IMG_1", "pano.jpg", "f"]);
        assert_eq!([cameras[0].line, cameras[1].line], [21, 24]);
        for camera in &cameras {
            // (1, 2, 3) → (−2, 1, 3) · 2 + (10, 20, 30), and the direction +Y → −X.
            assert_eq!(camera.pose.location, dvec3(6.0, 22.0, 36.0));
            assert_eq!((camera.pose.forward(), camera.pose.up()), (-DVec3::X, DVec3::Z));
        }

        let Some(Optics::Pinhole { focal_px, center_px, distortion }) = cameras[0].optics else { panic!() };
        assert_eq!((focal_px, center_px), (dvec2(3002.0, 3000.5), Some(dvec2(2012.5, 1492.75))));
        assert_eq!(distortion, Distortion::OpenCv([0.1, -0.2, -0.002, 0.001, 0.03]));
        assert_eq!((cameras[0].size, cameras[1].size), (Some([4000, 3000]), Some([5888, 2944])));
        assert_eq!(cameras[1].optics, Some(Optics::Equirectangular));
        let Some(Optics::Pinhole { distortion, .. }) = cameras[2].optics else { panic!() };
        assert_eq!(distortion, Distortion::Fisheye([0.1, 0.0, 0.0, 0.4]));
    }

    /// Metashape's own formulas for a place in a picture, written out again.
    #[test]
    fn pixels_are_where_metashape_puts_them() {
        let (cameras, _) = read_text(CHUNK).unwrap();
        let lens = cameras[0].photo_lens([4000, 3000]).unwrap();
        let [f, cx, cy, b1] = [3000.5, 12.5, -7.25, 1.5];
        let [k1, k2, k3, p1, p2] = [0.1, -0.2, 0.03, 0.001, -0.002];
        for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.5, 0.4)] {
            let r2: f64 = x * x + y * y;
            let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
            let bent_x = x * radial + (p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y);
            let bent_y = y * radial + (p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y);
            let expected = dvec2(2000.0 + cx + bent_x * f + bent_x * b1, 1500.0 + cy + bent_y * f);
            let pixel = lens.project(dvec3(x, y, 1.0)).unwrap();
            assert!(pixel.abs_diff_eq(expected, 1e-9), "{pixel} {expected}");
        }
    }

    #[test]
    fn components_have_transforms_of_their_own() {
        let component = r#"<component id="7"><transform><scale>3</scale></transform></component>"#;
        let text = CHUNK
            .replace("<cameras", &format!("<components>{component}</components><cameras"))
            .replace(r#"label="IMG_1""#, r#"component_id="7" label="IMG_1""#);
        let (cameras, _) = read_text(&text).unwrap();
        assert_eq!(cameras[0].pose.location, dvec3(3.0, 6.0, 9.0));
        assert_eq!(cameras[1].pose.location, dvec3(6.0, 22.0, 36.0));
    }

    #[test]
    fn faults_have_their_place() {
        let of = |from: &str, to: &str| {
            assert!(CHUNK.contains(from), "{from}");
            read_text(&CHUNK.replacen(from, to, 1)).unwrap_err().to_string()
        };
        for (from, to, words) in [
            ("<transform>1 0 0 1", "<transform>1 0 0", "line 21: transform: `1 0 0 0 0 1 2"),
            ("<transform>1 0 0 1", "<transform>2 0 0 1", "line 21: its axes are not of length 1"),
            ("<transform>1 0 0 1", "<transform>-1 0 0 1", "line 21: it mirrors"),
            ("3 0 0 0 1</transform>", "3 0 0 0 2</transform>", "line 21: the last row"),
            (r#"sensor_id="0""#, r#"sensor_id="9""#, "`IMG_1`: there is no sensor `9`"),
            ("<f>3000.5</f>", "<f>x</f>", "line 10: f: `x` is not one number"),
            ("<f>3000.5</f>", "", "line 8: focal lengths of 1.5 and 0"),
            ("<b2>0.0001</b2>", "<b2>4</b2>", "line 8: b2 is 4: pixels that are no rectangles"),
            ("<k1>0.1</k1>", "<k4>0.1</k4>", "line 8: k4 is 0.1: only lenses without it"),
            (r#"width="4000""#, r#"width="0""#, "line 5: the sensor has no resolution"),
            (r#"<scale locked="true">2"#, r#"<scale locked="true">0"#, "0 is no scale"),
            (">10 20 30<", ">4e6 1e6 5e6<", "has the axes of the Earth"),
            ("<f>100</f>", "<p1>1</p1><f>100</f>", "p1 is 1"),
            (
                r#"type="fisheye" class"#,
                r#"type="cylindrical" class"#,
                "the type `cylindrical` is not supported",
            ),
            ("</document>", "", "is no valid XML"),
        ] {
            let message = of(from, to);
            assert!(message.starts_with("cameras.xml") && message.contains(words), "{message}");
        }

        let project = read_text(r#"<document version="1.2.0" path="{projectname}.files/project.zip"/>"#);
        assert!(project.unwrap_err().to_string().contains("is a project of Metashape"));
        let other = read_text("<kml><document/></kml>").unwrap_err().to_string();
        assert!(other.contains("is XML, but not the cameras of a Metashape chunk"), "{other}");
    }
}
