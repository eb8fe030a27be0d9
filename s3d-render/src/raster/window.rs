//! Runs the visibility pass over a window of an image, for any projection.

use crate::raster::canvas::{Canvas, Cover};
use crate::ray::caster::Nearest;
use crate::ray::cone::Cone;
use crate::scene::Scene;
use crate::scene::clusters::{Cluster, Clusters};
use crate::scene::tree::{Content, Node};
use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes};
use crate::simd::{Kernel, Simd};
use glam::DVec3;
use s3d_geom::{Camera, Rays, TriMesh};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The samples of an image that are cast together. Column i of the window is column stride / 2 + stride ·
/// (`column` + i) of the image; rows likewise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'a> {
    pub(crate) camera: &'a Camera,
    /// The camera's rays.
    pub(crate) rays: &'a Rays,
    pub(crate) stride: u32,
    /// The first column and row of the window among the samples, and the size of the window.
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Window<'_> {
    /// Returns the column or row of a sample's pixel in the image.
    pub(crate) fn pixel_of(&self, sample: usize) -> u32 {
        self.stride / 2 + self.stride * sample as u32
    }
}

/// Maps the samples of a window to pixels of the image.
pub(crate) struct Pixels<'a> {
    pub(crate) rays: &'a Rays,
    stride: u32,
    column: u32,
    row: u32,
}

impl<'a> Pixels<'a> {
    pub(crate) fn new(window: &Window<'a>) -> Self {
        let column = window.pixel_of(window.column);
        let row = window.pixel_of(window.row);
        Self { rays: window.rays, stride: window.stride, column, row }
    }

    /// Returns the direction of a sample's ray, the same as for single rays.
    pub(crate) fn direction(&self, column: usize, row: usize) -> DVec3 {
        self.rays
            .at(self.column + self.stride * column as u32, self.row + self.stride * row as u32)
    }
}

/// Splits values by column into groups of a register. The last group is filled up with zeros.
pub(crate) fn groups(values: &[f64]) -> Vec<[f64; LANES]> {
    values
        .chunks(LANES)
        .map(|chunk| std::array::from_fn(|k| chunk.get(k).copied().unwrap_or(0.0)))
        .collect()
}

/// Projects faces onto a window.
pub(crate) trait ProjectionRaster {
    /// The common origin of the rays.
    fn origin(&self) -> DVec3;
    /// The width and the height of the window.
    fn size(&self) -> (usize, usize);
    /// Returns the pixels that a box may cover; `None` if it is outside the window.
    fn cover(&self, node: &Node) -> Option<Cover>;
    /// Draws the faces of a cluster.
    fn draw<L: RasterLanes>(&mut self, l: L, canvas: &mut Canvas, cluster: &Cluster<'_>);
    /// Calls [`Canvas::finish`] with the functions of this projection.
    fn finish<L: RasterLanes>(
        &self,
        l: L,
        canvas: &mut Canvas,
        out: (&mut [u32], &mut [f32]),
        out_pitch: usize,
        single: impl Fn(u32, usize, usize) -> f64,
    );
    /// Returns 1/t of a drawn face at a pixel.
    fn inverse_t(&self, drawn: &DrawnFace, column: usize, row: usize) -> f64;
    /// Returns the direction of the ray through the centre of a pixel.
    fn direction(&self, column: usize, row: usize) -> DVec3;
}

/// A node that waits to be drawn. The nearest comes first.
struct QueuedNode {
    node: u32,
    cover: Cover,
}

impl Ord for QueuedNode {
    fn cmp(&self, other: &Self) -> Ordering {
        // The bits of non-negative numbers are ordered like their values.
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

/// The memory of the visibility pass, reused from window to window.
#[derive(Default)]
pub(crate) struct Scratch {
    canvas: Canvas,
    queue: BinaryHeap<QueuedNode>,
}

/// Casts the rays of a window.
pub(crate) struct VisibilityKernel<'a, 'm, T> {
    pub(crate) scene: &'a Scene<'m>,
    pub(crate) raster: T,
    pub(crate) scratch: &'a mut Scratch,
    /// Faces and depths from the first pixel of the window on; rows are `pitch` apart.
    pub(crate) out: (&'a mut [u32], &'a mut [f32]),
    pub(crate) pitch: usize,
}

impl<T: ProjectionRaster> Kernel for VisibilityKernel<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let l = simd.raster();
        let Self { scene, mut raster, scratch, out, pitch } = self;
        let origin = raster.origin();
        let size = raster.size();
        let Scratch { canvas, queue } = scratch;
        canvas.begin(size.0, size.1);
        draw_all(l, scene.clusters(), &mut raster, canvas, queue);

        let mesh = scene.mesh();
        canvas.settle(|column, row, candidates| {
            let d = raster.direction(column, row);
            let (which, t) = nearest(mesh, origin, d, candidates)?;
            // The function and the exact ray agree unless the function is poor there.
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

/// Draws the clusters that the window shows, the nearest first.
#[inline(always)]
fn draw_all<L: RasterLanes, T: ProjectionRaster>(
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
                    let Some(cover) = raster.cover(&nodes[node as usize]) else { continue };
                    clusters.prefetch_below(node);
                    queue.push(QueuedNode { node, cover });
                }
            }
            Content::Leaf { first: index, .. } => {
                if let Some(next) = queue.peek() {
                    clusters.prefetch(next.node);
                }
                raster.draw(l, canvas, &clusters.cluster(index));
                canvas.touch(&cover);
            }
        }
    }
}

/// Returns the nearest of `candidates` that the ray along `d` hits, by the rules of single rays: its place in
/// the list and its distance.
#[inline(never)]
fn nearest(mesh: &TriMesh, origin: DVec3, d: DVec3, candidates: &[DrawnFace]) -> Option<(usize, f64)> {
    let mut nearest = Nearest::default();
    for candidate in candidates {
        nearest.meet(mesh, candidate.face, origin, d);
    }
    let hit = nearest.hit()?;
    Some((candidates.iter().position(|c| c.face == hit.face)?, hit.t))
}

/// Returns the distance along `d` of a face that the ray hits.
#[inline(never)]
fn distance(mesh: &TriMesh, origin: DVec3, d: DVec3, face: u32) -> f64 {
    Cone::new(mesh, face, origin).map_or(f64::INFINITY, |cone| cone.distance(d))
}
