//! Writes the mesh of an area for the 3D view, simplified if it is large: [`crate::files`], "Meshes".

use crate::faults::Faults;
use crate::index::{MaterialEntry, MeshEntry, Surface, VoteSpread, rounded};
use crate::raster::reduce::{mean, reduced_size};
use crate::script::Scripts;
use crate::script::packed::{jpeg_url, packed};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, DataSet, Result};
use s3d_geom::glam::{DVec3, Vec2, Vec3, vec2};
use s3d_geom::{DEFAULT_COLOR, FaceColor, Raster, TriMesh, Wrap, simplify};
use s3d_io::Error as FileError;
use s3d_io::dataset::FaceVoteColumns;
use s3d_label::{LabelId, LabelTable};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The number of faces in a file.
const FACES_PER_FILE: usize = 1 << 16;

/// The most materials. Faces of further materials look like the last one.
const MATERIALS: usize = 1 << 16;

/// The number of textures in a file.
const TEXTURES_PER_FILE: usize = 16;

/// The most pixels of all textures of an area together. Larger textures are reduced.
const TEXTURE_PIXELS: f64 = (1u32 << 24) as f64;

/// The greatest width of a texture.
const TEXTURE_WIDTH: u32 = 4096;

/// A part of a mesh.
#[derive(Serialize)]
struct Part {
    vertices: usize,
    faces: usize,
    origin: [f64; 3],
    step: [f64; 3],
    uv_origin: Option<[f64; 2]>,
    uv_step: Option<[f64; 2]>,
    position: String,
    color: Option<String>,
    index: String,
    uv: Option<String>,
    face: String,
    material: String,
}

/// The votes of faces.
#[derive(Serialize)]
struct FaceVotes {
    faces: usize,
    label: String,
    runner_up: String,
    margin: String,
}

/// An instance and its box.
#[derive(Serialize)]
struct BoxEntry {
    label: u32,
    r#box: [f32; 6],
}

/// The shown mesh: the whole mesh, or a simplified one.
struct Shown<'m> {
    mesh: &'m TriMesh,
    positions: &'m [Vec3],
    faces: &'m [[u32; 3]],
    /// The colours of vertices; empty if the mesh has none.
    colors: Vec<[u8; 3]>,
    /// For each shown face, its number in the mesh.
    face_of: &'m [u32],
}

/// The entry of a mesh in the index, the surface of each class, and the bytes that were written.
type Written = (MeshEntry, Vec<(usize, Surface)>, u64);

/// Writes all files of the mesh of an area.
pub(crate) fn write(
    ctx: &Context,
    (data, table): (&DataSet, Option<&LabelTable>),
    (area, mesh): (u32, &TriMesh),
    most_faces: u32,
    scripts: &Scripts,
    faults: &mut Faults,
) -> Result<Written> {
    // The shown mesh, in parts of one file each.
    let simplified = simplify(mesh, most_faces as usize);
    let all: Vec<u32>;
    let shown = match &simplified {
        Some(small) => Shown {
            mesh,
            positions: &small.positions,
            faces: &small.faces,
            colors: mean_colors(mesh, &small.vertex_of, small.positions.len()),
            face_of: &small.face_of,
        },
        None => {
            all = (0..mesh.faces().len() as u32).collect();
            let colors = mesh.parts().colors.clone();
            Shown { mesh, positions: mesh.positions(), faces: mesh.faces(), colors, face_of: &all }
        }
    };

    let by_material = shown.by_material();
    let parts: Vec<(usize, &[usize])> = by_material.chunks(FACES_PER_FILE).enumerate().collect();
    let mut bytes = map_in_order(
        ctx,
        &parts,
        || (),
        |(), (k, faces)| scripts.write(&format!("mesh_{area}_{k}"), &shown.part(faces)),
    )?;

    let (textures, written) = write_textures(ctx, area, mesh, scripts)?;
    bytes.push(written);

    let root = data.layout().root();
    let votes = faults.keep(root, data.face_votes(area))?.flatten();
    if let Some(votes) = &votes {
        bytes.push(scripts.write(&format!("faces_{area}"), &face_votes(votes))?);
    }

    let labels = votes.as_ref().map_or(&[][..], |votes| &votes.label);
    let surfaces = table
        .map(|table| surface_by_class(mesh, labels, table))
        .unwrap_or_default();

    let instances = faults.keep(root, data.instances(area))?.unwrap_or_default();
    let boxes: Vec<BoxEntry> = instances
        .into_iter()
        .map(|i| BoxEntry { label: i.label_index, r#box: i.bbox })
        .collect();
    if !boxes.is_empty() {
        bytes.push(scripts.write(&format!("boxes_{area}"), &boxes)?);
    }

    let materials = mesh
        .materials()
        .iter()
        .map(|m| MaterialEntry { color: m.color, texture: m.texture });
    let bounds = mesh.aabb();
    let entry = MeshEntry {
        area,
        faces: mesh.faces().len(),
        shown: shown.faces.len(),
        cell_m: simplified.as_ref().map(|small| small.cell_m),
        min: bounds.min.to_array().map(|c| rounded(c.into(), 4)),
        max: bounds.max.to_array().map(|c| rounded(c.into(), 4)),
        files: parts.len(),
        texture_files: textures,
        has_votes: votes.is_some(),
        has_boxes: !boxes.is_empty(),
        spread: votes.as_ref().map(|votes| vote_spread(mesh, votes)),
        // The last one is for faces without a material.
        materials: materials
            .chain([MaterialEntry { color: DEFAULT_COLOR, texture: None }])
            .take(MATERIALS)
            .collect(),
    };
    Ok((entry, surfaces, bytes.into_iter().sum()))
}

/// Returns the number and the area of the faces of each class that has any.
fn surface_by_class(mesh: &TriMesh, labels: &[u32], table: &LabelTable) -> Vec<(usize, Surface)> {
    let mut by_label: BTreeMap<u32, Surface> = BTreeMap::new();
    for (face, label) in (0..).zip(labels) {
        let sum = by_label.entry(*label).or_default();
        sum.add(mesh.area(face));
    }
    by_label
        .into_iter()
        .filter_map(|(label, sum)| Some((table.class_of(LabelId(label))?.index(), sum)))
        .collect()
}

/// Counts faces by votes and by margin.
fn vote_spread(mesh: &TriMesh, votes: &FaceVoteColumns) -> VoteSpread {
    let mut spread = VoteSpread::default();
    let counts = votes.total.iter().zip(votes.votes.iter().zip(&votes.runner_up_votes));
    for (face, (all, (first, second))) in (0..).zip(counts) {
        let m2 = mesh.area(face);
        // Bin k + 2 holds 2^k + 1 to 2^(k + 1) votes.
        let bin = all
            .checked_sub(1)
            .map_or(0, |less| (u32::BITS - less.leading_zeros()) as usize + 1);
        if spread.votes.len() <= bin {
            spread.votes.resize(bin + 1, Surface::default());
        }
        if let Some(bin) = spread.votes.get_mut(bin) {
            bin.add(m2);
        }

        let lead = u64::from(first.saturating_sub(*second));
        let part = (10 * lead)
            .checked_div(u64::from(*all))
            .map(|part| part.min(9) as usize);
        if let Some(bin) = part.and_then(|part| spread.margin.get_mut(part)) {
            bin.add(m2);
        }
    }
    spread
}

/// Returns the mean colours of merged vertices.
fn mean_colors(mesh: &TriMesh, vertex_of: &[u32], vertices: usize) -> Vec<[u8; 3]> {
    let colors = &mesh.parts().colors;
    if colors.is_empty() {
        return Vec::new();
    }
    let mut sums = vec![([0u64; 3], 0u64); vertices];
    for (color, vertex) in colors.iter().zip(vertex_of) {
        if let Some((sum, count)) = sums.get_mut(*vertex as usize) {
            sum.iter_mut().zip(color).for_each(|(sum, c)| *sum += u64::from(*c));
            *count += 1;
        }
    }
    sums.into_iter()
        .map(|(sum, n)| sum.map(|sum| ((sum + n / 2) / n.max(1)) as u8))
        .collect()
}

/// Even steps of 16 bits between the least and the greatest number of each axis.
struct Steps<const N: usize> {
    origin: [f64; N],
    step: [f64; N],
}

impl<const N: usize> Steps<N> {
    fn of(values: &[[f64; N]]) -> Self {
        let mut least = [f64::INFINITY; N];
        let mut most = [f64::NEG_INFINITY; N];
        for value in values {
            least
                .iter_mut()
                .zip(value)
                .for_each(|(least, v)| *least = least.min(*v));
            most.iter_mut().zip(value).for_each(|(most, v)| *most = most.max(*v));
        }
        let origin = least.map(|v| rounded(v, 9));
        let mut step = most;
        step.iter_mut()
            .zip(origin)
            .for_each(|(step, v)| *step = (*step - v) / 65_535.0);
        Self { origin, step }
    }

    fn pack(&self, values: &[[f64; N]]) -> String {
        let steps = values.iter().flat_map(|v| {
            v.iter()
                .zip(&self.origin)
                .zip(&self.step)
                .map(|((value, origin), step)| {
                    if *step > 0.0 {
                        ((value - origin) / step).round() as u16
                    } else {
                        0
                    }
                })
        });
        packed(steps, u16::to_le_bytes)
    }
}

impl Shown<'_> {
    /// Returns the faces, ordered by material.
    fn by_material(&self) -> Vec<usize> {
        let mut faces: Vec<usize> = (0..self.faces.len()).collect();
        faces.sort_by_key(|i| self.material_of(*i));
        faces
    }

    /// Returns the number of a shown face in the mesh.
    fn original(&self, i: usize) -> u32 {
        self.face_of.get(i).copied().unwrap_or_default()
    }

    fn material_of(&self, i: usize) -> usize {
        let none = self.mesh.materials().len();
        self.mesh
            .material_of(self.original(i))
            .map_or(none, |material| material as usize)
            .min(MATERIALS - 1)
    }

    /// Returns a part of the mesh, whose vertices are numbered anew.
    fn part(&self, faces: &[usize]) -> Part {
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut vertices: Vec<u32> = Vec::new();
        let mut index: Vec<u32> = Vec::with_capacity(3 * faces.len());
        let mut uvs: Vec<[f64; 2]> = Vec::with_capacity(3 * faces.len());
        let mut is_textured = false;
        for i in faces {
            for v in self.faces.get(*i).into_iter().flatten() {
                let next = vertices.len() as u32;
                index.push(*numbers.entry(*v).or_insert(next));
                if index.last() == Some(&next) {
                    vertices.push(*v);
                }
            }
            uvs.extend(match self.mesh.color_of(self.original(*i)) {
                FaceColor::Texture(_, texture, uvs) => {
                    is_textured = true;
                    near_zero(uvs, texture.wrap).map(|uv| uv.as_dvec2().to_array())
                }
                _ => [[0.0; 2]; 3],
            });
        }

        let position = |v: &u32| self.positions.get(*v as usize).map_or(DVec3::ZERO, |p| p.as_dvec3());
        let positions: Vec<[f64; 3]> = vertices.iter().map(|v| position(v).to_array()).collect();
        let place = Steps::of(&positions);
        let of_uv = Steps::of(&uvs);

        let color = |v: &u32| self.colors.get(*v as usize).copied().unwrap_or(DEFAULT_COLOR);
        Part {
            vertices: vertices.len(),
            faces: faces.len(),
            origin: place.origin,
            step: place.step,
            uv_origin: is_textured.then_some(of_uv.origin),
            uv_step: is_textured.then_some(of_uv.step),
            position: place.pack(&positions),
            color: (!self.colors.is_empty())
                .then(|| packed(vertices.iter().flat_map(color), u8::to_le_bytes)),
            index: packed(index, u32::to_le_bytes),
            uv: is_textured.then(|| of_uv.pack(&uvs)),
            face: packed(faces.iter().map(|i| self.original(*i)), u32::to_le_bytes),
            material: packed(faces.iter().map(|i| self.material_of(*i) as u16), u16::to_le_bytes),
        }
    }
}

/// Moves texture coordinates nearer to zero where the texture repeats, since steps depend on the farthest
/// ones.
fn near_zero(uvs: [Vec2; 3], [along_u, along_v]: [Wrap; 2]) -> [Vec2; 3] {
    let least = uvs.into_iter().fold(Vec2::INFINITY, Vec2::min).floor();
    uvs.map(|uv| vec2(near_zero_along(uv.x, least.x, along_u), near_zero_along(uv.y, least.y, along_v)))
}

fn near_zero_along(uv: f32, least: f32, wrap: Wrap) -> f32 {
    match wrap {
        Wrap::Repeat => uv - least,
        Wrap::Clamp => uv.clamp(0.0, 1.0),
        Wrap::Mirror => uv,
    }
}

/// Writes the textures, reduced if they are many or large. Returns the number and the bytes of their files.
fn write_textures(ctx: &Context, area: u32, mesh: &TriMesh, scripts: &Scripts) -> Result<(usize, u64)> {
    let all: f64 = mesh.textures().iter().map(|texture| pixel_count(&texture.image)).sum();
    let scale = (TEXTURE_PIXELS / all).sqrt().min(1.0);
    let files: Vec<_> = mesh.textures().chunks(TEXTURES_PER_FILE).enumerate().collect();
    let bytes = map_in_order(
        ctx,
        &files,
        || (),
        |(), (k, textures)| {
            let mut urls = Vec::with_capacity(textures.len());
            for texture in *textures {
                let size = [texture.image.width(), texture.image.height()];
                let width = ((f64::from(size[0]) * scale).ceil() as u32).clamp(1, TEXTURE_WIDTH);
                let small = mean(&texture.image, reduced_size(size, width), None);
                urls.push(
                    jpeg_url(&small)
                        .map_err(|e| FileError::format(Path::new(&texture.name), e.to_string()))?,
                );
            }
            scripts.write(&format!("textures_{area}_{k}"), &urls)
        },
    )?;
    Ok((files.len(), bytes.into_iter().sum()))
}

fn pixel_count(image: &Raster<[u8; 3]>) -> f64 {
    f64::from(image.width()) * f64::from(image.height())
}

fn face_votes(votes: &FaceVoteColumns) -> FaceVotes {
    let counts = votes.votes.iter().zip(&votes.runner_up_votes).zip(&votes.total);
    let margin = counts.map(|((first, second), all)| match all {
        0 => u8::MAX,
        all => (254.0 * f64::from(first.saturating_sub(*second)) / f64::from(*all)).round() as u8,
    });
    FaceVotes {
        faces: votes.label.len(),
        label: packed(votes.label.iter().copied(), u32::to_le_bytes),
        runner_up: packed(votes.runner_up.iter().copied(), u32::to_le_bytes),
        margin: packed(margin, u8::to_le_bytes),
    }
}
