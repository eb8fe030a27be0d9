//! A scene of OpenUSD as text: a mesh for each object with its labels, textures, and cameras.
//!
//! Source: OpenUSD 26.11, the schemas UsdGeom, UsdShade and UsdSemantics (`SemanticsLabelsAPI`), and GfCamera
//! for apertures.

#![expect(clippy::indexing_slicing, reason = "a writer: the indices are those that TriMesh::new checked")]

use crate::error::Result;
use crate::fs::{create_dir, write_bytes, write_whole};
use crate::image::compression::Compression;
use crate::image::png::{Content, encode_rgb8};
use crate::mesh::gltf::linear_from_srgb;
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{FaceColor, NO_INDEX, TriMesh, Wrap};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

/// An object of a scene. Names are identifiers of USD: letters, digits and `_`, no digit first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsdObject {
    /// Its name, unique in its room.
    pub name: String,
    /// Its class and its name as labels. `None` for faces without a label.
    pub class: Option<String>,
    /// The room that it is in; `None` for the scene itself.
    pub room: Option<String>,
    /// Its faces.
    pub faces: Vec<u32>,
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq)]
pub struct UsdCamera {
    /// Its name, unique in the scene.
    pub name: String,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The camera matrix in pixels. The centre of the first pixel is (0.5, 0.5).
    pub intrinsics: [[f64; 3]; 3],
    /// Camera (x right, y down, z forward) → world, metres.
    pub world_from_camera: [[f64; 4]; 4],
}

/// The width of the aperture of all cameras. Only its ratio to the focal length counts.
const APERTURE: f64 = 20.955;

/// Writes a scene into a folder that exists: `NAME.usda`, and its textures as PNG images in `NAME_textures`.
/// Z is up, and lengths are metres. Objects must be sorted by their rooms.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If an object names a face that is not there.
pub fn write_usd(
    folder: &Path,
    name: &str,
    mesh: &TriMesh,
    objects: &[UsdObject],
    cameras: &[UsdCamera],
) -> Result<()> {
    if !mesh.textures().is_empty() {
        let textures = folder.join(format!("{name}_textures"));
        create_dir(&textures)?;
        for (i, texture) in mesh.textures().iter().enumerate() {
            let png = encode_rgb8(&texture.image, Content::Photo, Compression::default());
            write_bytes(&textures.join(format!("texture_{i}.png")), &png)?;
        }
    }

    write_whole(&folder.join(format!("{name}.usda")), |w| {
        writeln!(
            w,
            "#usda 1.0\n(\n    defaultPrim = \"{name}\"\n    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n"
        )?;
        writeln!(w, "def Xform \"{name}\" (\n    kind = \"assembly\"\n)\n{{")?;
        for of_room in objects.chunk_by(|a, b| a.room == b.room) {
            let room = of_room.first().and_then(|object| object.room.as_deref());
            if let Some(room) = room {
                writeln!(w, "def Xform \"{room}\" (\n    kind = \"group\"\n)\n{{")?;
            }
            for object in of_room {
                write_object(w, name, mesh, object)?;
            }
            if room.is_some() {
                writeln!(w, "}}")?;
            }
        }
        write_materials(w, name, mesh)?;
        writeln!(w, "def Scope \"cameras\"\n{{")?;
        for camera in cameras {
            write_camera(w, camera)?;
        }
        writeln!(w, "}}\n}}")
    })?;
    Ok(())
}

/// Writes the mesh of an object. Its vertices are its own.
fn write_object(w: &mut dyn Write, scene: &str, mesh: &TriMesh, object: &UsdObject) -> io::Result<()> {
    let parts = mesh.parts();
    let faces = || object.faces.iter().map(|face| mesh.faces()[*face as usize]);
    let mut vertices: Vec<u32> = faces().flatten().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let positions = || vertices.iter().map(|v| parts.positions[*v as usize]);

    let mut schemas = vec!["\"MaterialBindingAPI\""];
    if object.class.is_some() {
        schemas.extend(["\"SemanticsLabelsAPI:class\"", "\"SemanticsLabelsAPI:instance\""]);
    }
    writeln!(w, "def Mesh \"{}\" (", object.name)?;
    writeln!(w, "    kind = \"component\"\n    prepend apiSchemas = [{}]\n)\n{{", schemas.join(", "))?;
    if let Some(class) = &object.class {
        writeln!(w, "token[] semantics:labels:class = [\"{class}\"]")?;
        writeln!(w, "token[] semantics:labels:instance = [\"{}\"]", object.name)?;
    }
    writeln!(w, "uniform bool doubleSided = 1\nuniform token subdivisionScheme = \"none\"")?;
    let bounds =
        [positions().fold(Vec3::INFINITY, Vec3::min), positions().fold(Vec3::NEG_INFINITY, Vec3::max)];
    list(w, "float3[] extent", bounds.map(triple))?;
    list(w, "int[] faceVertexCounts", faces().map(|_| 3))?;
    let number = |v: u32| vertices.partition_point(|of| *of < v);
    list(w, "int[] faceVertexIndices", faces().flatten().map(number))?;
    list(w, "point3f[] points", positions().map(triple))?;

    let mut by_texture: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let mut flat = Vec::with_capacity(object.faces.len());
    for (i, face) in object.faces.iter().enumerate() {
        flat.push(match mesh.color_of(*face) {
            FaceColor::Texture(texture, ..) => {
                by_texture.entry(texture).or_default().push(i);
                [255; 3]
            }
            FaceColor::Corners(_) => [255; 3],
            FaceColor::Flat(color) => color,
        });
    }
    if !parts.colors.is_empty() {
        let colors = vertices.iter().map(|v| light(parts.colors[*v as usize]));
        list_by(w, "color3f[] primvars:displayColor", colors, "vertex")?;
    } else if by_texture.values().map(Vec::len).sum::<usize>() < object.faces.len() {
        list_by(w, "color3f[] primvars:displayColor", flat.into_iter().map(light), "uniform")?;
    }
    if by_texture.is_empty() {
        return writeln!(w, "}}");
    }

    let uvs = object.faces.iter().flat_map(|face| parts.face_uvs[*face as usize]);
    let uvs = uvs.map(|uv| {
        if uv == NO_INDEX {
            Vec2::ZERO
        } else {
            parts.uvs[uv as usize]
        }
    });
    let uvs = uvs.map(|uv| format!("({}, {})", uv.x, uv.y));
    list_by(w, "texCoord2f[] primvars:st", uvs, "faceVarying")?;
    writeln!(w, "uniform token subsetFamily:materialBind:familyType = \"nonOverlapping\"")?;
    for (texture, of_texture) in by_texture {
        writeln!(w, "def GeomSubset \"texture_{texture}\" (")?;
        writeln!(w, "    prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{{")?;
        writeln!(w, "uniform token elementType = \"face\"\nuniform token familyName = \"materialBind\"")?;
        list(w, "int[] indices", of_texture)?;
        writeln!(w, "rel material:binding = </{scene}/materials/texture_{texture}>\n}}")?;
    }
    writeln!(w, "}}")
}

/// Writes a material for each texture.
fn write_materials(w: &mut dyn Write, scene: &str, mesh: &TriMesh) -> io::Result<()> {
    let word = |wrap: Wrap| match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    };
    writeln!(w, "def Scope \"materials\"\n{{")?;
    for (i, texture) in mesh.textures().iter().enumerate() {
        let path = format!("/{scene}/materials/texture_{i}");
        let [s, t] = texture.wrap.map(word);
        writeln!(
            w,
            "def Material \"texture_{i}\"\n{{\n\
             token outputs:surface.connect = <{path}/surface.outputs:surface>\n\
             def Shader \"surface\"\n{{\nuniform token info:id = \"UsdPreviewSurface\"\n\
             color3f inputs:diffuseColor.connect = <{path}/image.outputs:rgb>\n\
             float inputs:roughness = 1\ntoken outputs:surface\n}}\n\
             def Shader \"image\"\n{{\nuniform token info:id = \"UsdUVTexture\"\n\
             asset inputs:file = @./{scene}_textures/texture_{i}.png@\n\
             token inputs:sourceColorSpace = \"sRGB\"\n\
             float2 inputs:st.connect = <{path}/coordinates.outputs:result>\n\
             token inputs:wrapS = \"{s}\"\ntoken inputs:wrapT = \"{t}\"\nfloat3 outputs:rgb\n}}\n\
             def Shader \"coordinates\"\n{{\nuniform token info:id = \"UsdPrimvarReader_float2\"\n\
             string inputs:varname = \"st\"\nfloat2 outputs:result\n}}\n}}"
        )?;
    }
    writeln!(w, "}}")
}

/// Writes a camera. USD's looks along −Z, and its Y is up.
fn write_camera(w: &mut dyn Write, camera: &UsdCamera) -> io::Result<()> {
    let [[fx, _, cx], [_, fy, cy], _] = camera.intrinsics;
    let [width, height] = [camera.size.0, camera.size.1].map(f64::from);
    let a_pixel = APERTURE / width;
    // Both directions share the focal length, so other pixels are other heights.
    let a_row = a_pixel * fx / fy;
    writeln!(w, "def Camera \"{}\"\n{{", camera.name)?;
    writeln!(w, "token projection = \"perspective\"\nfloat2 clippingRange = (0.01, 1000)")?;
    let numbers = [
        ("focalLength", fx * a_pixel),
        ("horizontalAperture", APERTURE),
        ("verticalAperture", height * a_row),
        ("horizontalApertureOffset", (width / 2.0 - cx) * a_pixel),
        ("verticalApertureOffset", (cy - height / 2.0) * a_row),
    ];
    for (name, value) in numbers {
        writeln!(w, "float {name} = {}", value as f32)?;
    }
    // Vectors are rows: the matrix is transposed. The signs turn y and z.
    let rows: Vec<String> = [0, 1, 2, 3]
        .into_iter()
        .zip([1.0, -1.0, -1.0, 1.0])
        .map(|(column, sign)| {
            let [x, y, z, last] = [0, 1, 2, 3].map(|row| sign * camera.world_from_camera[row][column]);
            format!("({x:?}, {y:?}, {z:?}, {last:?})")
        })
        .collect();
    writeln!(w, "matrix4d xformOp:transform = ( {} )", rows.join(", "))?;
    writeln!(w, "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}}")
}

/// Writes an attribute that is a list.
fn list<T: Display>(w: &mut dyn Write, name: &str, values: impl IntoIterator<Item = T>) -> io::Result<()> {
    list_with(w, name, values, "")
}

/// Writes an attribute that is a list, with a value for each vertex, face, or corner.
fn list_by<T: Display>(
    w: &mut dyn Write,
    name: &str,
    values: impl IntoIterator<Item = T>,
    interpolation: &str,
) -> io::Result<()> {
    list_with(w, name, values, &format!(" (\n    interpolation = \"{interpolation}\"\n)"))
}

fn list_with<T: Display>(
    w: &mut dyn Write,
    name: &str,
    values: impl IntoIterator<Item = T>,
    rest: &str,
) -> io::Result<()> {
    write!(w, "{name} = [")?;
    for (i, value) in values.into_iter().enumerate() {
        let before = match i {
            0 => "",
            i if i % 16 == 0 => ",\n",
            _ => ", ",
        };
        write!(w, "{before}{value}")?;
    }
    writeln!(w, "]{rest}")
}

fn triple(p: Vec3) -> String {
    format!("({}, {}, {})", p.x, p.y, p.z)
}

/// Returns an sRGB colour as light, which displayColor holds.
fn light(color: [u8; 3]) -> String {
    triple(Vec3::from_array(color.map(linear_from_srgb)))
}
