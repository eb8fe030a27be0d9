//! Makes all images of a view from its hits, in one walk.
//!
//! The walk goes band by band, so that the hits and the data of their faces stay in the cache from one
//! modality to the next. Each image equals the one that its own function makes.

use crate::hits::Hits;
use crate::scene::Scene;
use crate::shade::anchor::ray_grid::RayGrid;
use crate::shade::channels::{
    MISSING_INDEX, MISSING_NORMAL, assert_size, depths, fit, flat_normals_of, index_color,
};
use crate::shade::color::RgbPainter;
use crate::shade::flat_painter::FlatPainter;
use crate::shade::mip_maps::{MipMaps, TextureFilter};
use crate::shade::points::RayTable;
use crate::shade::prefetch::Prefetch;
use crate::shade::spans::{Spans, band_rows};
use crate::simd::shade_lanes::{LANES, ShadeLanes};
use crate::simd::{Kernel, Simd, dispatch};
use half::f16;
use s3d_geom::{Camera, NormalAxes, Raster};
use std::ops::Range;

/// The inputs of a view's images, besides its hits.
#[derive(Clone, Copy)]
pub struct Shading<'a> {
    /// The scene that was cast.
    pub scene: &'a Scene<'a>,
    /// The textures of the scene's mesh.
    pub mip_maps: &'a MipMaps,
    /// How the textures are filtered.
    pub filter: TextureFilter,
    /// The axes of normals.
    pub normal_axes: NormalAxes,
    /// The indices for [`crate::index_image`]; may be empty if no index image is wanted.
    pub index_of_face: &'a [u32],
    /// The colours for [`crate::color_per_face_image`]; may be empty if that image is not wanted.
    pub color_of_face: &'a [[u8; 3]],
}

/// The images of a view that [`view_images_into`] makes; by default none. They share most of their work.
/// Smooth normals, depth in millimetres and coordinates in 32 bits have functions of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modalities {
    /// [`ViewImages::rgb`].
    pub rgb: bool,
    /// [`ViewImages::depth`].
    pub depth: bool,
    /// All of [`ViewImages::faces`].
    pub faces: bool,
    /// [`ViewImages::xyz`].
    pub xyz: bool,
}

impl Modalities {
    /// All images.
    pub const ALL: Self = Self { rgb: true, depth: true, faces: true, xyz: true };
}

/// The images of a view; see [`view_images_into`].
#[derive(Clone, Debug, PartialEq)]
pub struct ViewImages {
    /// The image of [`crate::rgb_image_with`].
    pub rgb: Raster<[u8; 3]>,
    /// The image of [`crate::depth_image`].
    pub depth: Raster<u16>,
    /// The images that have one value all over a face.
    pub faces: FaceImages,
    /// The image of [`crate::xyz_image_half`].
    pub xyz: Raster<[f16; 3]>,
}

/// The images that have one value all over a face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceImages {
    /// The image of [`crate::normal_image`] with [`crate::Normals::Flat`], in the axes of
    /// [`Shading::normal_axes`].
    pub normal: Raster<[u8; 3]>,
    /// The image of [`crate::index_image`].
    pub index: Raster<[u8; 3]>,
    /// The image of [`crate::color_per_face_image`].
    pub color: Raster<[u8; 3]>,
}

impl Default for ViewImages {
    /// Returns images without pixels.
    fn default() -> Self {
        Self {
            rgb: Raster::filled(0, 0, [0; 3]),
            depth: Raster::filled(0, 0, 0),
            faces: FaceImages::default(),
            xyz: Raster::filled(0, 0, [f16::ZERO; 3]),
        }
    }
}

impl Default for FaceImages {
    /// Returns images without pixels.
    fn default() -> Self {
        Self { normal: empty(), index: empty(), color: empty() }
    }
}

fn empty() -> Raster<[u8; 3]> {
    Raster::filled(0, 0, [0; 3])
}

/// Makes the wanted images of a view, in less time than one after another. Other images in `out` stay as they
/// are; memory of the right size is reused.
///
/// # Panics
/// If the hits are not of the camera's size, or `shading` does not cover the visible faces: see
/// [`crate::rgb_image`], [`crate::index_image`] and [`crate::color_per_face_image`].
pub fn view_images_into(
    shading: &Shading<'_>,
    hits: &Hits,
    camera: &Camera,
    wanted: Modalities,
    out: &mut ViewImages,
) {
    assert_size(hits, camera);
    let ViewImages { rgb, depth, faces, xyz } = out;
    let FaceImages { normal, index, color } = faces;
    if wanted.rgb {
        fit(rgb, &hits.face, [0; 3]);
    }
    if wanted.depth {
        fit(depth, &hits.face, 0);
    }
    if wanted.faces {
        for image in [normal, index, color] {
            fit(image, &hits.face, [0; 3]);
        }
    }
    if wanted.xyz {
        fit(xyz, &hits.face, [f16::ZERO; 3]);
    }

    dispatch(ViewKernel { shading, faces: &hits.face, depths: &hits.depth, camera, wanted, out });
}

/// Makes the wanted images, which must have the size of `faces` already.
pub(crate) struct ViewKernel<'a> {
    pub(crate) shading: &'a Shading<'a>,
    pub(crate) faces: &'a Raster<u32>,
    /// Only read for depth and xyz; may be empty otherwise.
    pub(crate) depths: &'a Raster<f32>,
    pub(crate) camera: &'a Camera,
    pub(crate) wanted: Modalities,
    pub(crate) out: &'a mut ViewImages,
}

impl Kernel for ViewKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lanes = simd.shade();
        let grid = RayGrid::new(self.camera);
        if grid.is_panorama() {
            self.bands::<true>(lanes, &grid);
        } else {
            self.bands::<false>(lanes, &grid);
        }
    }
}

impl ViewKernel<'_> {
    #[inline(always)]
    fn bands<const PANORAMA: bool>(self, lanes: impl ShadeLanes, grid: &RayGrid) {
        let Self { shading, faces: all_faces, depths: all_depths, camera, wanted, out } = self;
        let &Shading { scene, mip_maps, ref filter, normal_axes, index_of_face, color_of_face } = shading;
        let ViewImages { rgb, depth, faces: FaceImages { normal, index, color }, xyz } = out;
        let mut painter = RgbPainter::new(lanes, scene, mip_maps, camera, filter);
        let view = (camera.pose.location, camera.normal_axes_from_world(normal_axes));
        let values = |faces: &[u32; LANES]| {
            let normals = flat_normals_of(scene.mesh(), faces, view);
            std::array::from_fn(|k| {
                let face = faces[k];
                [normals[k], index_color(index_of_face, face), color_of_face[face as usize]]
            })
        };
        let mut flat = FlatPainter::new([MISSING_NORMAL, MISSING_INDEX, [0; 3]], values);
        let directions = RayTable::new(camera);

        let width = all_faces.width() as usize;
        let mut spans = Spans::new(width);
        let rows = band_rows(width);
        let band = (rows * width).max(1);
        for (k, faces) in all_faces.pixels().chunks(band).enumerate() {
            let pixels = k * band..k * band + faces.len();
            if wanted.depth {
                let distances = &all_depths.pixels()[pixels.clone()];
                depths(lanes, distances, &mut depth.pixels_mut()[pixels.clone()]);
            }
            if wanted.xyz {
                let distances = &all_depths.pixels()[pixels.clone()];
                let out = &mut xyz.pixels_mut()[pixels.clone()];
                directions.points::<PANORAMA, f16>(lanes, k * rows, distances, out);
            }

            if !wanted.rgb && !wanted.faces {
                continue;
            }

            if spans.find(lanes, Some(scene.mesh()), faces) {
                painter.forget();
                flat.forget();
            }

            if wanted.rgb {
                let next = pixels.end..all_faces.len().min(pixels.end + band);
                let (done, rest) = rgb.pixels_mut().split_at_mut(next.start);
                let painted = part(&pixels, wanted.faces);
                let prefetch = Prefetch {
                    faces: &all_faces.pixels()[next.clone()],
                    distances: &all_depths.pixels()[part(&next, wanted.depth || wanted.xyz)],
                    depth: &depth.pixels()[part(&next, wanted.depth)],
                    xyz: &xyz.pixels()[part(&next, wanted.xyz)],
                    rgb: &rest[..next.len()],
                    flat: [&*normal, &*index, &*color].map(|i| &i.pixels()[painted.clone()]),
                };
                painter.band::<PANORAMA>(grid, &spans, k * rows, faces, &mut done[pixels.start..], &prefetch);
            }

            if wanted.faces {
                let out =
                    [&mut *normal, &mut *index, &mut *color].map(|i| &mut i.pixels_mut()[pixels.clone()]);
                // The faces have been prefetched already if colours were painted.
                let mesh = (!wanted.rgb).then_some(scene.mesh());
                flat.band(lanes, mesh, &spans, out);
            }
        }
    }
}

fn part(of: &Range<usize>, wanted: bool) -> Range<usize> {
    if wanted { of.clone() } else { 0..0 }
}
