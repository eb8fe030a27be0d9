//! A face to be sampled, and the colours of its points.

use crate::mesh::texture::Quad;
use crate::{FaceColor, Texture, TriMesh};
use glam::{DVec3, Vec3};

/// A face, ready to be sampled.
pub(super) struct Patch<'m> {
    corners: [DVec3; 3],
    pub(super) color: FaceColor<'m>,
}

impl<'m> Patch<'m> {
    pub(super) fn new(mesh: &'m TriMesh, face: u32) -> Self {
        Self { corners: mesh.triangle(face).map(|p| p.as_dvec3()), color: mesh.color_of(face) }
    }

    /// Returns the point with these weights of the corners. It is computed in `f64`, so only the rounding of
    /// its coordinates moves it off the face.
    #[inline(always)]
    pub(super) fn point(&self, [wa, wb, wc]: [f64; 3]) -> Vec3 {
        let [a, b, c] = self.corners;
        (a * wa + b * wb + c * wc).as_vec3()
    }

    #[inline(always)]
    pub(super) fn color(&self, [wa, wb, wc]: [f64; 3]) -> PointColor<'m> {
        PointColor::Known(match self.color {
            FaceColor::Texture(_, Texture { image, .. }, _) if image.is_empty() => [0; 3],
            FaceColor::Texture(_, Texture { image, wrap, .. }, uvs) => {
                let [a, b, c] = uvs.map(|uv| uv.as_dvec2());
                let uv = (a * wa + b * wb + c * wc).as_vec2();
                return PointColor::Texels(Quad::new(image, *wrap, uv), image.pixels());
            }
            FaceColor::Corners([a, b, c]) => std::array::from_fn(|k| {
                (f64::from(a[k]) * wa + f64::from(b[k]) * wb + f64::from(c[k]) * wc + 0.5) as u8
            }),
            FaceColor::Flat(color) => color,
        })
    }
}

/// The colour of a point.
pub(super) enum PointColor<'m> {
    /// A place between four pixels of a texture, which may have to come from memory.
    Texels(Quad, &'m [[u8; 3]]),
    /// A colour that needs no texture.
    Known([u8; 3]),
}

impl PointColor<'_> {
    /// Prefetches the pixels.
    #[inline(always)]
    pub(super) fn prefetch(&self) {
        if let Self::Texels(quad, pixels) = self {
            let rows = [[quad.at[0], quad.at[1]], [quad.at[2], quad.at[3]]];
            for row in rows {
                if let [Some([first, ..]), Some([.., last])] = row.map(|at| pixels.get(at)) {
                    s3d_simd::prefetch(first);
                    s3d_simd::prefetch(last);
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn rounded(&self) -> [u8; 3] {
        match self {
            Self::Texels(quad, pixels) => quad.color(pixels).map(|c| (c + 0.5) as u8),
            Self::Known(color) => *color,
        }
    }
}
