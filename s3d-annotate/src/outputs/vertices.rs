//! From faces to vertices: what a vertex belongs to, and its colour.

use s3d_geom::{FaceColor, TriMesh};

/// Returns what each vertex belongs to, of what the faces around it belong to: the number with the largest
/// area, or the smallest number if several have it. `None` for a vertex without a face.
pub(super) fn of_vertices(mesh: &TriMesh, of_face: &[u32]) -> Vec<Option<u32>> {
    let mut around: Vec<(u32, u32, f64)> = Vec::with_capacity(3 * mesh.faces().len());
    for ((face, corners), number) in (0u32..).zip(mesh.faces()).zip(of_face) {
        let area_m2 = mesh.area(face);
        around.extend(corners.map(|vertex| (vertex, *number, area_m2)));
    }
    // A stable sort: areas are summed in the order of faces.
    around.sort_by_key(|(vertex, number, _)| (*vertex, *number));

    let mut best: Vec<Option<(f64, u32)>> = vec![None; mesh.positions().len()];
    for same in around.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let Some(&(vertex, number, _)) = same.first() else { continue };
        let area_m2: f64 = same.iter().map(|(.., area_m2)| area_m2).sum();
        if let Some(best) = best.get_mut(vertex as usize)
            && best.is_none_or(|(largest_m2, _)| area_m2 > largest_m2)
        {
            *best = Some((area_m2, number));
        }
    }
    best.into_iter().map(|best| best.map(|(_, number)| number)).collect()
}

/// Returns the colour of each vertex: its own, or else the mean of what the faces around it have there, in
/// their textures or materials. `None` if the mesh has no colours. A vertex without a face is black.
pub(super) fn vertex_colors(mesh: &TriMesh) -> Option<Vec<[u8; 3]>> {
    let parts = mesh.parts();
    if parts.textures.is_empty() && !parts.colors.is_empty() {
        return Some(parts.colors.clone());
    }
    if parts.materials.is_empty() && parts.colors.is_empty() {
        return None;
    }

    let mut sums = vec![([0f64; 3], 0u32); mesh.positions().len()];
    for (face, corners) in (0u32..).zip(mesh.faces()) {
        let colors = match mesh.color_of(face) {
            FaceColor::Texture(_, texture, uvs) => uvs.map(|uv| texture.sample(uv).map(f64::from)),
            FaceColor::Corners(colors) => colors.map(|color| color.map(f64::from)),
            FaceColor::Flat(color) => [color.map(f64::from); 3],
        };
        for (vertex, color) in corners.iter().zip(colors) {
            if let Some((sum, count)) = sums.get_mut(*vertex as usize) {
                sum.iter_mut().zip(color).for_each(|(sum, channel)| *sum += channel);
                *count += 1;
            }
        }
    }
    // The conversion saturates.
    let means = sums
        .iter()
        .map(|(sum, count)| sum.map(|s| (s / f64::from(*count).max(1.0)).round() as u8));
    Some(means.collect())
}
