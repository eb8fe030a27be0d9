//! What faces are told apart by: their size, the way they face, their colour.

use super::borders::Border;
use libm::{cbrtf, expf, powf};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Mat3, Vec2, Vec3, vec3};
use s3d_geom::{FaceColor, TriMesh};

/// How often normals are smoothed. Once reaches one face further.
const ROUNDS: usize = 3;

/// The turn between two faces, as 1 − cosine, from which they hardly smooth each other: 20°.
const EDGE: f32 = 0.06;

/// One column an attribute, one entry a face.
pub(super) struct Looks {
    pub(super) area_m2: Vec<f64>,
    /// Unit normals in which the noise of a scan is smoothed and edges are kept.
    pub(super) normal: Vec<Vec3>,
    /// The mean colour in Oklab.
    pub(super) color: Vec<Vec3>,
}

impl Looks {
    pub(super) fn new(mesh: &TriMesh, borders: &[Border]) -> Self {
        let area_m2 = areas(mesh);
        let normal = smooth_normals(mesh, &area_m2, borders);
        Self { area_m2, normal, color: mean_colors(mesh) }
    }

    /// Returns how much two faces differ across the edge between them, from 0.
    ///
    /// It is 1 − cosine of the turn between the normals, and its square where the surface bends away from
    /// the viewer: things are round and have corners, and stand on others in hollow edges. Added is the
    /// distance of the colours in Oklab, times `color`.
    pub(super) fn difference(&self, mesh: &TriMesh, border: &Border, color: f32) -> f32 {
        let [a, b] = border.faces.map(|face| face as usize);
        let sign = if border.is_flipped { -1.0 } else { 1.0 };
        let turn = (1.0 - sign * self.normal[a].dot(self.normal[b])).max(0.0);

        let [from, to] = border.faces.map(|face| middle(mesh, face));
        let is_hollow = self.normal[a].dot(to - from) > 0.0;
        let bend = if is_hollow { turn } else { turn * turn };
        bend + color * self.color[a].distance(self.color[b])
    }
}

/// Returns the area of each face, m².
pub(super) fn areas(mesh: &TriMesh) -> Vec<f64> {
    let faces = (0..mesh.faces().len() as u32).into_par_iter();
    faces.map(|face| mesh.area(face)).collect()
}

/// Returns the unit normal of each face, with noise smoothed and edges kept.
pub(super) fn smooth_normals(mesh: &TriMesh, area_m2: &[f64], borders: &[Border]) -> Vec<Vec3> {
    let faces = (0..mesh.faces().len() as u32).into_par_iter();
    let mut normal: Vec<Vec3> = faces.map(|face| mesh.normal(face)).collect();
    for _ in 0..ROUNDS {
        normal = smoothed(&normal, area_m2, borders);
    }
    normal
}

/// Returns the mean colour of each face in Oklab.
pub(super) fn mean_colors(mesh: &TriMesh) -> Vec<Vec3> {
    let faces = (0..mesh.faces().len() as u32).into_par_iter();
    faces.map(|face| oklab(mean_color(mesh, face))).collect()
}

fn middle(mesh: &TriMesh, face: u32) -> Vec3 {
    mesh.triangle(face).iter().sum::<Vec3>() / 3.0
}

/// Adds to the normal of each face the normals of its neighbours, weighted by their area. The more a
/// neighbour is turned, the less it counts, so that edges stay.
fn smoothed(normal: &[Vec3], area_m2: &[f64], borders: &[Border]) -> Vec<Vec3> {
    let mut sums: Vec<DVec3> = normal
        .iter()
        .zip(area_m2)
        .map(|(n, area)| n.as_dvec3() * *area)
        .collect();
    for border in borders {
        let [a, b] = border.faces.map(|face| face as usize);
        let sign = if border.is_flipped { -1.0 } else { 1.0 };
        let turn = 1.0 - sign * normal[a].dot(normal[b]);
        let weight = f64::from(sign * expf(-turn / EDGE));
        sums[a] += normal[b].as_dvec3() * (weight * area_m2[b]);
        sums[b] += normal[a].as_dvec3() * (weight * area_m2[a]);
    }
    sums.iter()
        .zip(normal)
        .map(|(sum, before)| sum.as_vec3().try_normalize().unwrap_or(*before))
        .collect()
}

/// Returns the mean sRGB colour of a face, 0 to 255 a channel.
fn mean_color(mesh: &TriMesh, face: u32) -> Vec3 {
    match mesh.color_of(face) {
        FaceColor::Flat(color) => Vec3::from(color.map(f32::from)),
        FaceColor::Corners(colors) => colors.iter().map(|c| Vec3::from(c.map(f32::from))).sum::<Vec3>() / 3.0,
        FaceColor::Texture(_, texture, corners) => {
            // The middle of the face, and the middles between it and the corners.
            let middle = corners.iter().sum::<Vec2>() / 3.0;
            let at = |uv: Vec2| Vec3::from(texture.sample(uv));
            (at(middle) + corners.iter().map(|corner| at((*corner + middle) / 2.0)).sum::<Vec3>()) / 4.0
        }
    }
}

/// Converts an sRGB colour, 0 to 255 a channel, to Oklab. Source: B. Ottosson, "A perceptual color space for
/// image processing", 2020.
fn oklab(srgb: Vec3) -> Vec3 {
    let linear = Vec3::from((srgb / 255.0).to_array().map(|c| {
        if c <= 0.04045 {
            c / 12.92
        } else {
            powf((c + 0.055) / 1.055, 2.4)
        }
    }));
    let lms = Mat3::from_cols(
        vec3(0.412_221_46, 0.211_903_5, 0.088_302_46),
        vec3(0.536_332_55, 0.680_699_5, 0.281_718_85),
        vec3(0.051_445_995, 0.107_396_96, 0.629_978_7),
    ) * linear;
    Mat3::from_cols(
        vec3(0.210_454_26, 1.977_998_5, 0.025_904_037),
        vec3(0.793_617_8, -2.428_592_2, 0.782_771_77),
        vec3(-0.004_072_047, 0.450_593_7, -0.808_675_77),
    ) * Vec3::from(lms.to_array().map(cbrtf))
}

#[cfg(test)]
mod tests {
    use super::super::borders::borders;
    use super::*;
    use s3d_geom::primitives::grid;

    #[test]
    fn colors_are_in_oklab() {
        // White and sRGB red, as the source gives them.
        for (srgb, expected) in [([255.0; 3], [1.0, 0.0, 0.0]), ([255.0, 0.0, 0.0], [0.628, 0.225, 0.126])] {
            assert!(oklab(srgb.into()).distance(expected.into()) < 1e-3, "{:?}", oklab(srgb.into()));
        }
    }

    #[test]
    fn noise_is_smoothed_and_an_edge_stays() {
        // A floor and a wall of 5 cm faces whose corners are up to 2 mm off.
        let mut parts = grid(Vec3::ZERO, Vec3::X, Vec3::Y, [20, 20]);
        parts.append(grid(Vec3::ZERO, Vec3::Y, Vec3::Z, [20, 20]));
        let hash = |i: u32| i.wrapping_mul(2_654_435_761) >> 8;
        for position in &mut parts.positions {
            // Corners at one place stay at one place.
            let place = (*position * 100.0).round().as_uvec3();
            let noise =
                |axis: u32| hash(place.x * 7919 + place.y * 104_729 + place.z * 1_299_709 + axis) % 1000;
            *position += 0.002 * (vec3(noise(1) as f32, noise(2) as f32, noise(3) as f32) / 500.0 - 1.0);
        }
        let mesh = TriMesh::new(parts).unwrap();
        let looks = Looks::new(&mesh, &borders(&mesh));

        let off = |face: u32, normal: Vec3| {
            let axis = if face < 800 { Vec3::Z } else { Vec3::X };
            f64::from(normal.dot(axis).min(1.0)).acos().to_degrees()
        };
        let mean = |normals: &dyn Fn(u32) -> Vec3| {
            (0..1600).map(|face| off(face, normals(face))).sum::<f64>() / 1600.0
        };
        let before = mean(&|face| mesh.normal(face));
        let after = mean(&|face| looks.normal[face as usize]);
        assert!(after < 0.5 * before, "{before} to {after} degrees");
    }
}
