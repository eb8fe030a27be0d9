//! Labels of others, such as the output of a network, as proposals that a person accepts or not. They never
//! become labels by themselves.
//!
//! [`read_proposals`] takes what people have:
//!
//! | file | content |
//! |---|---|
//! | `.npy` | integers, shape (faces) or (vertices): a class each |
//! | `.txt` | a number a line, for each face or each vertex: a class each |
//! | `.npz` | such an array `class` (or `label`, `semantic`, …), and perhaps a second one, `instance` |
//! | points with labels | PLY, LAS, E57, PCD, NPY tables …: all that [`Annotations::open`] reads |
//! | a labelled mesh, a scan of ScanNet, a folder of labels | likewise; other meshes label by place |
//! | a model of `s3d_detect::Model::save` | the elements that it finds on the mesh |
//! | a folder of PNG images | numbers, 8 or 16 bits or a palette: [masks of photographs](self#masks) |
//!
//! The length of a list says whether it is about the faces or the vertices of the mesh. A face takes what
//! most of its corners have. Whole numbers may be written as floats.
//!
//! # Classes
//!
//! A number is the place of a class in the taxonomy, from 0: for S3DIS 0 is ceiling and 12 is clutter.
//! Negative numbers and 255 are no class. The numbers of a data set (NYU40's from 1) and words that the
//! taxonomy does not know need names: `NAME.classes.json` or `classes.json` beside the file, or in the
//! folder. It is a list, `["wall", "chair", null]`, or an object, `{"4": "wall", "shelves": "bookcase",
//! "9": ""}`; `null` and `""` are no class. Instead, there may be `classes.csv` with lines `4,wall`, or an
//! archive may have an array `classes` of names, the first for number 0.
//!
//! # Instances
//!
//! Faces of one class and one instance number are one proposal. Negative numbers are no instance. Without
//! instances, connected faces of one class are one proposal; pieces below 0.01 m² are dropped, with a
//! warning. In a file of points, where each class has one instance at most in a room, there are no instances
//! either.
//!
//! # Points
//!
//! Each point votes for its nearest face, if it is within 10 cm. A face takes the proposal with most votes. A
//! face without a vote takes that of the labelled surface around it, if it is within 5 cm. Points may have
//! the coordinates of a scan from which an offset was subtracted, or those without it.
//!
//! # Masks
//!
//! An image of the folder has the name of a photograph of the scene's `[frames]`, with `.png` instead of the
//! ending or behind it; or it is named as a view of a data set, whose pose file is in the folder `pose`
//! beside: `dataset/area_1/data/prediction/camera_…_domain_prediction.png`. It may be smaller than the
//! photograph or view, and has the same shape. The mesh is cast from the camera, exactly, with its lens. Each
//! pixel votes for the face that it sees, and a face takes what has most pixels in all images. 65,535 is no
//! class, like 255; 0 is none either if there are names and none is for 0.
//!
//! Numbers are classes. They are instances if the image has a list of names of its own beside it,
//! `NAME.json` or `NAME.csv`, or if `classes.json` gives a range of numbers one name: `"500-599": "chair"`.
//! Each image numbers its own instances. A mask is joined to an instance of earlier images if more than half
//! of what the image sees of this instance lies in the mask, by area. What an image shows as two things stays
//! two.
//!
//! [`Annotations::open`]: s3d_io::cloud::Annotations::open

mod detected;
mod list;
mod masks;
mod names;
mod points;

use crate::labelling::FaceRuns;
use list::List;
use names::ClassNames;
use s3d_dataset::{BarePhotograph, BareScene, Context, Result};
use s3d_geom::glam::DVec3;
use s3d_geom::{TriMesh, face_patches};
use s3d_io::Error as FileError;
use s3d_label::{Class, Taxonomy};
use std::collections::BTreeMap;
use std::path::Path;

/// Pieces of a class without instances are dropped below this, m².
const SMALLEST_M2: f64 = 0.01;

/// Something that may be an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Its class: a word of the taxonomy.
    pub class: String,
    /// Its faces, at least one. No face is in two proposals of one file.
    pub faces: FaceRuns,
    /// Where it is from, for people: the name of the file, and the instance if the file numbers them.
    pub source: String,
}

/// What proposals are for.
#[derive(Clone, Debug)]
pub struct Target<'a> {
    /// The mesh whose faces they are.
    pub mesh: &'a TriMesh,
    /// The classes that they may have.
    pub taxonomy: &'a Taxonomy,
    /// The offset that was subtracted from the scan's own coordinates, metres.
    pub offset_m: DVec3,
    /// The photographs that masks may be of.
    pub photographs: Vec<BarePhotograph<'a>>,
}

impl<'a> Target<'a> {
    /// A mesh in its own coordinates, without photographs.
    pub fn new(mesh: &'a TriMesh, taxonomy: &'a Taxonomy) -> Self {
        Self { mesh, taxonomy, offset_m: DVec3::ZERO, photographs: Vec::new() }
    }
}

impl<'a> From<&'a BareScene> for Target<'a> {
    fn from(scene: &'a BareScene) -> Self {
        let photographs = scene.photographs().collect();
        Self { offset_m: scene.offset_m(), photographs, ..Self::new(scene.mesh(), scene.taxonomy()) }
    }
}

/// A class of the file, and its instance if it is known to be one.
type Key = (Class, Option<i64>);

/// Reads proposals for the faces of a mesh: see the [module](self). They are in the order of classes, then of
/// instances or first faces.
///
/// ```
/// use s3d_annotate::proposals::{Target, read_proposals};
/// use s3d_dataset::Context;
/// use s3d_geom::{TriMesh, glam::Vec3, primitives::grid};
/// use s3d_label::Taxonomy;
///
/// // A strip of four squares, of two faces each. The third has no class.
/// let mesh = TriMesh::new(grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y, [4, 1]))?;
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("prediction.txt");
/// std::fs::write(&path, "1\n1\n1\n1\n-1\n-1\n1\n1\n")?;
///
/// let taxonomy = Taxonomy::s3dis();
/// let found = read_proposals(&path, &Target::new(&mesh, &taxonomy), &Context::default())?;
/// let floors: Vec<_> = found.iter().map(|p| (&p.class[..], p.faces.runs()[0].clone())).collect();
/// assert_eq!(floors, [("floor", 0..4), ("floor", 6..8)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::File`](s3d_dataset::Error::File) with the place if the file cannot be read, has another number of
/// entries than the mesh has faces or vertices, has numbers or words without a meaning, or labels no face.
/// [`Error::Cancelled`](s3d_dataset::Error::Cancelled).
pub fn read_proposals(path: &Path, target: &Target<'_>, ctx: &Context) -> Result<Vec<Proposal>> {
    let mesh = target.mesh;
    let names = ClassNames::beside(path, target.taxonomy)?;
    let key_of_face = if detected::is_model(path)? {
        detected::keys(path, target, ctx)?
    } else if let Some(list) = List::read(path, mesh)? {
        list.keys(path, mesh, &names)?
    } else if let Some(keys) = masks::keys(path, target, &names, ctx)? {
        keys
    } else {
        points::keys(path, target, &names, ctx)?
    };
    ctx.check()?;
    let found = grouped(path, mesh, &key_of_face, ctx);
    if found.is_empty() {
        return Err(FileError::format(path, "proposes no class for any face of the mesh").into());
    }
    Ok(found)
}

/// Makes proposals of what the faces belong to.
fn grouped(path: &Path, mesh: &TriMesh, key_of_face: &[Option<Key>], ctx: &Context) -> Vec<Proposal> {
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut instances: BTreeMap<(usize, i64), (Class, Vec<u32>)> = BTreeMap::new();
    let mut loose: Vec<(u32, usize)> = Vec::new();
    let mut classes: BTreeMap<usize, Class> = BTreeMap::new();
    for (face, key) in (0u32..).zip(key_of_face) {
        match *key {
            Some((class, Some(number))) => {
                let entry = instances.entry((class.index(), number));
                entry.or_insert((class, Vec::new())).1.push(face);
            }
            Some((class, None)) => {
                classes.insert(class.index(), class);
                loose.push((face, class.index()));
            }
            None => {}
        }
    }

    let mut found: Vec<(usize, Proposal)> = Vec::new();
    for ((place, number), (class, faces)) in instances {
        let source = format!("{file}, instance {number}");
        let faces = faces.into_iter().collect();
        found.push((place, Proposal { class: class.name().to_owned(), faces, source }));
    }
    let (mut dropped, mut dropped_m2) = (0u32, 0.0);
    for piece in face_patches(mesh, &loose) {
        let members = || piece.iter().filter_map(|place| loose.get(*place));
        let area_m2: f64 = members().map(|(face, _)| mesh.area(*face)).sum();
        let Some(class) = members().next().and_then(|(_, class)| classes.get(class)) else { continue };
        if area_m2 < SMALLEST_M2 {
            dropped += 1;
            dropped_m2 += area_m2;
            continue;
        }
        let faces = members().map(|(face, _)| *face).collect();
        let class_name = class.name().to_owned();
        found.push((class.index(), Proposal { class: class_name, faces, source: file.to_string() }));
    }
    if dropped > 0 {
        ctx.warn(format_args!(
            "{}: {dropped} pieces below {SMALLEST_M2} m², together {dropped_m2:.3} m², are no proposals",
            path.display()
        ));
    }
    // A stable sort: instances come before pieces, each in their order.
    found.sort_by_key(|(place, _)| *place);
    found.into_iter().map(|(_, proposal)| proposal).collect()
}
