//! The visibility pass over a window of an image, whatever the projection.

use crate::raster::canvas::{Canvas, Cover, DrawnFace};
use crate::raster::clusters::{Cluster, Clusters, Content, Node};
use crate::ray::caster::Nearest;
use crate::ray::cone::Cone;
use crate::scene::Scene;
use crate::simd::registers::{self, LANES, Registers, Work};
use glam::DVec3;
use s3d_geom::{Camera, Rays, TriMesh};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Samples of an image that are cast together: column `column` + i is pixel stride / 2 + stride · (`column` + i).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) stride: u32,
    /// The window's first column and row among the samples, and its size.
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// Which pixels of the image the samples of a window are.
pub(crate) struct Pixels {
    pub(crate) rays: Rays,
    stride: u32,
    column: u32,
    row: u32,
}

impl Pixels {
    pub(crate) fn new(window: &Window<'_>) -> Self {
        let first = |sample: usize| window.stride / 2 + window.stride * sample as u32;
        let (column, row) = (first(window.column), first(window.row));
        Self { rays: window.camera.rays(), stride: window.stride, column, row }
    }

    /// The direction of a sample's ray, as single rays have it.
    pub(crate) fn direction(&self, column: usize, row: usize) -> DVec3 {
        self.rays.at(self.column + self.stride * column as u32, self.row + self.stride * row as u32)
    }
}

/// Values by column in groups of a register; the last is filled up with zeros.
pub(crate) fn groups(values: &[f64]) -> Vec<[f64; LANES]> {
    let group = |chunk: &[f64]| std::array::from_fn(|k| chunk.get(k).copied().unwrap_or(0.0));
    values.chunks(LANES).map(group).collect()
}

/// How a projection puts faces on a window.
pub(crate) trait ProjectionRaster {
    /// The pixels that a box may cover; `None` if the window does not show it.
    fn cover(&self, node: &Node) -> Option<Cover>;
    /// Draws the faces of a group.
    fn draw<L: Registers>(&mut self, l: L, canvas: &mut Canvas, cluster: &Cluster<'_>);
    /// [`Canvas::finish`] with this raster's functions.
    fn finish<L: Registers>(
        &self,
        l: L,
        canvas: &mut Canvas,
        out: (&mut [u32], &mut [f32]),
        out_pitch: usize,
        single: impl Fn(u32, usize, usize) -> f64,
    );
    /// 1/t of what was drawn, at a pixel.
    fn inverse_t(&self, drawn: &DrawnFace, column: usize, row: usize) -> f64;
    /// The direction of the ray through the centre of a pixel.
    fn direction(&self, column: usize, row: usize) -> DVec3;
}

/// What waits to be drawn, the nearest first.
struct QueuedNode {
    node: u32,
    cover: Cover,
}

impl Ord for QueuedNode {
    fn cmp(&self, other: &Self) -> Ordering {
        // For numbers from 0 on the bits have the order of the values.
        let key = |w: &Self| w.cover.inverse_t.to_bits();
        key(self).cmp(&key(other)).then_with(|| other.node.cmp(&self.node))
    }
}

impl PartialOrd for QueuedNode {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for QueuedNode {}

impl PartialEq for QueuedNode {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

/// The scratch of the visibility pass, for one window after another.
#[derive(Default)]
pub(crate) struct Scratch {
    canvas: Canvas,
    queue: BinaryHeap<QueuedNode>,
}

/// Casts the rays of a window into `out`: faces and depths from its first pixel on, `pitch` from row to row.
pub(crate) fn cast<T: ProjectionRaster>(
    scene: &Scene<'_>,
    origin: DVec3,
    raster: T,
    size: (usize, usize),
    scratch: &mut Scratch,
    out: (&mut [u32], &mut [f32]),
    pitch: usize,
) {
    registers::run(VisibilityKernel { scene, origin, raster, size, scratch, out, pitch });
}

/// As [`cast`], with registers that every processor has.
#[cfg(test)]
pub(crate) fn cast_portably<T: ProjectionRaster>(
    scene: &Scene<'_>,
    origin: DVec3,
    raster: T,
    size: (usize, usize),
    scratch: &mut Scratch,
    out: (&mut [u32], &mut [f32]),
    pitch: usize,
) {
    VisibilityKernel { scene, origin, raster, size, scratch, out, pitch }.run(registers::Portable::<LANES>);
}

struct VisibilityKernel<'a, 'm, T> {
    scene: &'a Scene<'m>,
    origin: DVec3,
    raster: T,
    size: (usize, usize),
    scratch: &'a mut Scratch,
    out: (&'a mut [u32], &'a mut [f32]),
    pitch: usize,
}

impl<T: ProjectionRaster> Work for VisibilityKernel<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Registers>(self, l: L) {
        let Self { scene, origin, mut raster, size, scratch, out, pitch } = self;
        let Scratch { canvas, queue } = scratch;
        canvas.begin(size.0, size.1);
        draw_all(l, scene.clusters(), &mut raster, canvas, queue);
        let mesh = scene.mesh();
        canvas.settle(|column, row, candidates| {
            let d = raster.direction(column, row);
            let (which, t) = nearest(mesh, origin, d, candidates)?;
            // The function and the exact ray say the same, unless the function is poor there.
            let off = raster.inverse_t(&candidates[which], column, row) * t - 1.0;
            let good = off.abs() < 1e-6;
            Some((which, !good))
        });
        let single = |face: u32, column: usize, row: usize| {
            distance(mesh, origin, raster.direction(column, row), face)
        };
        raster.finish(l, canvas, out, pitch, single);
    }
}

#[inline(always)]
fn draw_all<L: Registers, T: ProjectionRaster>(
    l: L,
    clusters: &Clusters,
    raster: &mut T,
    canvas: &mut Canvas,
    queue: &mut BinaryHeap<QueuedNode>,
) {
    let nodes = clusters.nodes();
    queue.clear();
    queue.extend(raster.cover(&nodes[0]).map(|cover| QueuedNode { node: 0, cover }));
    while let Some(QueuedNode { node, cover }) = queue.pop() {
        if canvas.hides(&cover) {
            continue;
        }
        match nodes[node as usize].content {
            Content::Children(first) => {
                for node in [first, first + 1] {
                    queue.extend(raster.cover(&nodes[node as usize]).map(|cover| QueuedNode { node, cover }));
                }
            }
            Content::Cluster(index) => {
                raster.draw(l, canvas, &clusters.cluster(index));
                canvas.touch(&cover);
            }
        }
    }
}

/// The nearest of `candidates` that the ray along `d` hits, by the rules of single rays, and its distance.
#[inline(never)]
fn nearest(mesh: &TriMesh, origin: DVec3, d: DVec3, candidates: &[DrawnFace]) -> Option<(usize, f64)> {
    let mut nearest = Nearest::default();
    for candidate in candidates {
        nearest.meet(mesh, candidate.face, origin, d);
    }
    let hit = nearest.hit()?;
    Some((candidates.iter().position(|c| c.face == hit.face)?, hit.t))
}

/// How far the ray along `d`, which hits the face, goes until then.
#[inline(never)]
fn distance(mesh: &TriMesh, origin: DVec3, d: DVec3, face: u32) -> f64 {
    Cone::new(mesh, face, origin).map_or(f64::INFINITY, |cone| cone.distance(d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::panorama::Panorama;
    use crate::raster::pinhole::Pinhole;
    use s3d_geom::Pose;
    use s3d_synth::scenes::scan_like;

    #[test]
    fn registers_of_any_width_give_the_same_bits() {
        let mesh = scan_like(6000, 2);
        let scene = Scene::new(&mesh);
        let pose = Pose::level(DVec3::new(3.0, 2.5, 1.5), 0.3);
        let views = [
            Camera::perspective(pose.turned(0.0, -0.4), 1.4, 203, 131),
            Camera::perspective(pose.turned(2.0, 0.2), 0.7, 203, 131),
            Camera::equirectangular(pose, 400),
        ];
        for camera in &views {
            let (width, height) = ((camera.width / 2) as usize, camera.height as usize - 5);
            let window = Window { camera, stride: 1, column: 60, row: 3, width, height };
            let mut images = [(); 2].map(|()| (vec![7; width * height], vec![7.0; width * height]));
            for (portable, (faces, depths)) in [true, false].into_iter().zip(&mut images) {
                let (size, out, mut scratch) =
                    ((width, height), (&mut faces[..], &mut depths[..]), Scratch::default());
                let origin = camera.pose.location;
                let pinhole = camera.projection != s3d_geom::Projection::Equirectangular;
                match (pinhole, portable) {
                    (true, true) => cast_portably(
                        &scene,
                        origin,
                        Pinhole::new(&mesh, &window),
                        size,
                        &mut scratch,
                        out,
                        width,
                    ),
                    (true, false) => {
                        cast(&scene, origin, Pinhole::new(&mesh, &window), size, &mut scratch, out, width)
                    }
                    (false, true) => cast_portably(
                        &scene,
                        origin,
                        Panorama::new(&mesh, &window),
                        size,
                        &mut scratch,
                        out,
                        width,
                    ),
                    (false, false) => {
                        cast(&scene, origin, Panorama::new(&mesh, &window), size, &mut scratch, out, width)
                    }
                }
            }
            assert!(images[0] == images[1]);
            assert!(images[0].0.iter().any(|&face| face != crate::NO_FACE));
        }
    }
}
