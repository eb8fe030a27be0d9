//! From hits to the bytes of image files, in two steps. `draw` makes the images: some of them together in one
//! walk over the hits (`together`), the others one after another. `file` encodes each.

pub(crate) mod cues;
pub(crate) mod picture_colors;

use crate::export::modality::cues::CueBuffers;
use crate::export::modality::picture_colors::PictureColors;
use half::f16;
use rayon::prelude::*;
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::{Conventions, DepthUnits, Domain, XyzType};
use s3d_io::image::{
    Compression, Content, encode_gray16, encode_levels8, encode_palette8, encode_rgb8, encode_xyz_float,
    encode_xyz_half,
};
use s3d_label::{LabelId, LabelTable, MAX_CLASSES, Taxonomy};
use s3d_render::{
    Hits, MipMaps, Modalities, Normals, Scene, Shading, TextureFilter, ViewImages, byte_per_face_image_into,
    color_per_face_image_into, depth_image_into, depth_image_mm_into, index_image_into, normal_image_into,
    rgb_image_into, sample_edges, view_images_into, xyz_image_half_into, xyz_image_into,
};

/// The byte of `semantic_class` images where a face has no class, or no face is seen.
pub(crate) const NO_CLASS: u8 = MAX_CLASSES as u8;

/// The index of each label's class in the taxonomy, or [`NO_CLASS`].
pub(crate) fn classes_of_labels(table: &LabelTable) -> Vec<u8> {
    (0..table.len() as u32)
        .map(|index| class_index(table, LabelId(index)))
        .collect()
}

/// The index of a label's class in the taxonomy, or [`NO_CLASS`].
pub(crate) fn class_index(table: &LabelTable, label: LabelId) -> u8 {
    table.class_of(label).map_or(NO_CLASS, |class| class.index() as u8)
}

/// The palette of `semantic_class` images: a colour for each byte, black for bytes without a class.
pub(crate) fn palette(taxonomy: &Taxonomy) -> Vec<[u8; 3]> {
    let mut palette: Vec<[u8; 3]> = taxonomy.classes().iter().map(|c| taxonomy.color(*c)).collect();
    palette.resize(MAX_CLASSES + 1, [0; 3]);
    palette
}

/// What images of a mesh are made from.
#[derive(Clone, Copy)]
pub(crate) struct Channels<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) textures: &'a MipMaps,
    /// The source of colours in place of the textures, if there is one.
    pub(crate) pictures: Option<PictureColors<'a>>,
    pub(crate) normals: Normals,
    /// How many samples decide the colour of a pixel at an edge; 1 samples the centre only.
    pub(crate) rgb_samples: u32,
    /// The label index of each face; may be empty if no semantic image is asked for.
    pub(crate) label_of_face: &'a [u32],
    /// The colour of each face in pretty images; may be empty without such images.
    pub(crate) pretty_of_face: &'a [[u8; 3]],
    /// The index of each face's class in the taxonomy, or [`NO_CLASS`]; may be empty without such images.
    pub(crate) class_of_face: &'a [u8],
    /// The principal curvatures of each face; may be empty without such images.
    pub(crate) curvature_of_face: &'a [[f32; 2]],
    /// The colours of `semantic_class` images, [`NO_CLASS`]'s last.
    pub(crate) palette: &'a [[u8; 3]],
    /// How much time the compression of the files may take.
    pub(crate) compression: Compression,
    /// The units of depth, the axes of normals and the type of coordinates. [`XyzType::None`] counts as half
    /// floats: no coordinates are asked for then.
    pub(crate) conventions: Conventions,
}

/// A domain that is an image: every domain but the pose and the objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Image {
    Rgb,
    Depth,
    Normal,
    Semantic,
    SemanticPretty,
    SemanticClass,
    GlobalXyz,
    /// A cue: see [`crate::export::modality::cues`].
    Cue(Domain),
}

impl Image {
    /// The image of a domain; `None` for the pose and the objects.
    pub(crate) fn of(domain: Domain) -> Option<Self> {
        Some(match domain {
            Domain::Rgb => Self::Rgb,
            Domain::Depth => Self::Depth,
            Domain::Normal => Self::Normal,
            Domain::Semantic => Self::Semantic,
            Domain::SemanticPretty => Self::SemanticPretty,
            Domain::SemanticClass => Self::SemanticClass,
            Domain::GlobalXyz => Self::GlobalXyz,
            Domain::Pose | Domain::Objects => return None,
            cue => Self::Cue(cue),
        })
    }

    /// The image's domain.
    pub(crate) fn domain(self) -> Domain {
        match self {
            Self::Rgb => Domain::Rgb,
            Self::Depth => Domain::Depth,
            Self::Normal => Domain::Normal,
            Self::Semantic => Domain::Semantic,
            Self::SemanticPretty => Domain::SemanticPretty,
            Self::SemanticClass => Domain::SemanticClass,
            Self::GlobalXyz => Domain::GlobalXyz,
            Self::Cue(domain) => domain,
        }
    }
}

/// The memory for the images of a view, used for one view after another.
pub(crate) struct ImageBuffers {
    pub(crate) images: ViewImages,
    class: Raster<u8>,
    xyz_float: Raster<[f32; 3]>,
    /// Which of `images` belong to the current view.
    made: Modalities,
    pub(crate) cues: CueBuffers,
    /// Whether the colours of `images` are those of the current view.
    pub(crate) has_colors: bool,
    /// The number of pixels of the last semantic image whose face has no label.
    pub(crate) unlabelled: u64,
}

impl ImageBuffers {
    /// Larger images give their memory back. A view's memory may stay; a panorama's, eight times as large and
    /// rarer, should not.
    const MAX_PIXELS: usize = 1 << 22;

    /// Gives memory back. Colours stay if `keeps_colors` says so.
    fn shrink(&mut self, keeps_colors: bool) {
        let mut old = std::mem::take(self);
        if keeps_colors {
            old.cues.shrink();
            self.cues = old.cues;
            self.images.rgb = old.images.rgb;
            self.has_colors = old.has_colors;
        }
    }

    /// Takes over the colours of the current view, which its cues are then made from.
    pub(crate) fn give_colors(&mut self, colors: Raster<[u8; 3]>) {
        self.images.rgb = colors;
        self.has_colors = true;
    }
}

impl Default for ImageBuffers {
    fn default() -> Self {
        let xyz_float = Raster::filled(0, 0, [0.0; 3]);
        let class = Raster::filled(0, 0, 0);
        Self {
            images: ViewImages::default(),
            class,
            xyz_float,
            made: Modalities::default(),
            cues: CueBuffers::default(),
            has_colors: false,
            unlabelled: 0,
        }
    }
}

/// An image that was drawn.
#[derive(Clone, Copy)]
pub(crate) enum Drawn<'a> {
    Color(&'a Raster<[u8; 3]>),
    Depth(&'a Raster<u16>),
    Gray(&'a Raster<u8>),
    Class(&'a Raster<u8>),
    Xyz(&'a Raster<[f32; 3]>),
    XyzHalf(&'a Raster<[f16; 3]>),
}

impl Channels<'_> {
    /// Encodes some images of a view from the view's hits. Gives each file to `each`, and returns its results
    /// in the order of `images`. Idle threads of the current rayon pool take part. What `buffers` were used
    /// for before changes the time, never the result.
    ///
    /// # Errors
    /// The error of `each`, which is given every file.
    pub(crate) fn encode<T: Send, E: Send>(
        &self,
        images: &[Image],
        hits: &Hits,
        camera: &Camera,
        buffers: &mut ImageBuffers,
        each: impl Fn(Image, Vec<u8>) -> Result<T, E> + Sync,
    ) -> Result<Vec<T>, E> {
        let large = hits.face.len() > ImageBuffers::MAX_PIXELS;
        self.draw_together(images, hits, camera, buffers);

        let mut done = Vec::new();
        let mut unlabelled = 0;
        for (at, &image) in images.iter().enumerate() {
            self.draw(image, hits, camera, buffers);
            if image == Image::Semantic {
                unlabelled = null_pixels(buffers.images.faces.index.pixels());
            }
            if large {
                done.push(each(image, self.file(image, buffers))?);
                let later = images.get(at + 1..).unwrap_or_default();
                buffers.shrink(later.iter().any(|image| image.domain().is_of_colors()));
            }
        }

        // Files of small images are made in parallel.
        if !large {
            let files = images.par_iter().with_max_len(1);
            done = files
                .map(|&image| each(image, self.file(image, buffers)))
                .collect::<Result<_, E>>()?;
        }

        buffers.unlabelled = unlabelled;
        Ok(done)
    }

    /// Draws the images that can be made in one walk over the hits, unless they are large. [`Self::draw`]
    /// draws the others.
    pub(crate) fn draw_together(
        &self,
        images: &[Image],
        hits: &Hits,
        camera: &Camera,
        buffers: &mut ImageBuffers,
    ) {
        let large = hits.face.len() > ImageBuffers::MAX_PIXELS;
        buffers.cues.begin();
        buffers.has_colors = false;
        buffers.made = if large {
            Modalities::default()
        } else {
            self.together(images)
        };

        if buffers.made != Modalities::default() {
            let shading = Shading {
                scene: self.scene,
                mip_maps: self.textures,
                filter: TextureFilter::default(),
                normal_axes: self.conventions.normal_axes,
                index_of_face: self.label_of_face,
                color_of_face: self.pretty_of_face,
            };
            view_images_into(&shading, hits, camera, buffers.made, &mut buffers.images);
        }
    }

    /// The images that are made in one walk over the hits.
    fn together(&self, images: &[Image]) -> Modalities {
        let wants = |image| images.contains(&image);
        let Conventions { depth_units, xyz, .. } = self.conventions;
        let flat = self.normals == Normals::Flat;
        Modalities {
            rgb: wants(Image::Rgb) && self.pictures.is_none(),
            depth: wants(Image::Depth) && depth_units == DepthUnits::Per512,
            faces: flat
                && [Image::Normal, Image::Semantic, Image::SemanticPretty]
                    .into_iter()
                    .all(wants),
            xyz: wants(Image::GlobalXyz) && xyz != XyzType::Float,
        }
    }

    /// Draws an image, unless it is made already.
    pub(crate) fn draw(&self, image: Image, hits: &Hits, camera: &Camera, buffers: &mut ImageBuffers) {
        if let Image::Cue(domain) = image {
            return self.draw_cue(domain, hits, camera, buffers);
        }
        let Conventions { depth_units, normal_axes, xyz: xyz_type } = self.conventions;
        buffers.has_colors |= image == Image::Rgb;
        let made = buffers.made;
        let ViewImages { rgb, depth, faces, xyz } = &mut buffers.images;

        // Images that no walk makes together with others are never made already.
        let is_made = match image {
            Image::Rgb => made.rgb,
            Image::Depth => made.depth,
            Image::Normal | Image::Semantic | Image::SemanticPretty => made.faces,
            Image::GlobalXyz => made.xyz,
            _ => false,
        };

        if is_made {
            if image == Image::Rgb {
                self.sample_edges(hits, camera, rgb);
            }
            return;
        }

        match image {
            Image::Rgb => match &self.pictures {
                Some(pictures) => pictures.image_into(self, hits, camera, rgb),
                None => {
                    let filter = TextureFilter::default();
                    rgb_image_into(self.scene, self.textures, hits, camera, &filter, rgb);
                    self.sample_edges(hits, camera, rgb);
                }
            },
            Image::Depth => match depth_units {
                DepthUnits::Per512 => depth_image_into(hits, depth),
                DepthUnits::Millimetres => depth_image_mm_into(hits, depth),
            },
            Image::Normal => {
                normal_image_into(self.scene, hits, camera, self.normals, normal_axes, &mut faces.normal);
            }
            Image::Semantic => index_image_into(hits, self.label_of_face, &mut faces.index),
            Image::SemanticPretty => {
                color_per_face_image_into(hits, self.pretty_of_face, &mut faces.color);
            }
            Image::SemanticClass => {
                byte_per_face_image_into(hits, self.class_of_face, NO_CLASS, &mut buffers.class);
            }
            Image::GlobalXyz if xyz_type == XyzType::Float => {
                xyz_image_into(hits, camera, &mut buffers.xyz_float);
            }
            Image::GlobalXyz => xyz_image_half_into(hits, camera, xyz),
            Image::Cue(_) => unreachable!("cues are drawn above"),
        }
    }

    /// Takes more samples at the edges of an RGB image of the mesh's own colours, if they are asked for.
    fn sample_edges(&self, hits: &Hits, camera: &Camera, rgb: &mut Raster<[u8; 3]>) {
        let filter = TextureFilter::default();
        sample_edges(self.scene, self.textures, hits, camera, &filter, self.rgb_samples, rgb);
    }

    /// Returns an image that was drawn.
    pub(crate) fn drawn<'a>(&self, image: Image, buffers: &'a ImageBuffers) -> Drawn<'a> {
        let ViewImages { rgb, depth, faces, xyz } = &buffers.images;
        match image {
            Image::Rgb => Drawn::Color(rgb),
            Image::Depth => Drawn::Depth(depth),
            Image::Normal => Drawn::Color(&faces.normal),
            Image::Semantic => Drawn::Color(&faces.index),
            Image::SemanticPretty => Drawn::Color(&faces.color),
            Image::SemanticClass => Drawn::Class(&buffers.class),
            Image::GlobalXyz if self.conventions.xyz == XyzType::Float => Drawn::Xyz(&buffers.xyz_float),
            Image::GlobalXyz => Drawn::XyzHalf(xyz),
            Image::Cue(domain) => buffers.cues.drawn(domain),
        }
    }

    /// Encodes an image that was drawn.
    fn file(&self, image: Image, buffers: &ImageBuffers) -> Vec<u8> {
        if let Image::Cue(domain) = image
            && let Some(file) = self.cue_file(domain, self.drawn(image, buffers))
        {
            return file;
        }
        let compression = self.compression;
        let content = match image {
            Image::Normal => Content::Normals,
            Image::Semantic | Image::SemanticPretty => Content::Labels,
            _ => Content::Photo,
        };

        match self.drawn(image, buffers) {
            Drawn::Color(colors) => encode_rgb8(colors, content, compression),
            Drawn::Depth(depth) => encode_gray16(depth, compression),
            Drawn::Gray(levels) => encode_levels8(levels, compression),
            Drawn::Class(class) => encode_palette8(class, self.palette, compression),
            Drawn::Xyz(points) => encode_xyz_float(points, compression),
            Drawn::XyzHalf(points) => encode_xyz_half(points, compression),
        }
    }
}

/// Counts the pixels of a label image that have the null label. Four pixels at a time are four times as fast
/// as one, which would take 3 % of a large panorama's time.
pub(crate) fn null_pixels(pixels: &[[u8; 3]]) -> u64 {
    let (fours, rest) = pixels.as_chunks::<4>();
    let mut count = rest.iter().filter(|pixel| **pixel == [0; 3]).count() as u64;
    for four in fours {
        let bytes = four.as_flattened();
        let (Some(first), Some(last)) = (bytes.first_chunk(), bytes.last_chunk()) else { continue };
        let first = u64::from_le_bytes(*first);
        let last = u64::from_le_bytes(*last);
        for pixel in [first << 40, first >> 24 << 40, last >> 16 << 40, last >> 40] {
            count += u64::from(pixel == 0);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_render::{MISSING_CURVATURE, MISSING_DEPTH, MISSING_DISTANCE, MISSING_INDEX, MISSING_NORMAL};

    /// What is drawn where nothing is seen is what the format says.
    #[test]
    fn pixels_that_see_nothing_are_those_of_the_format() {
        for domain in Domain::ALL {
            assert_eq!(Image::of(domain).is_some(), domain.pixels().is_some());
            assert!(Image::of(domain).is_none_or(|image| image.domain() == domain));
        }
        assert_eq!(Domain::Depth.missing(), [MISSING_DEPTH, 0, 0]);
        assert_eq!(Domain::Normal.missing(), MISSING_NORMAL.map(u16::from));
        assert_eq!(Domain::Semantic.missing(), MISSING_INDEX.map(u16::from));
        assert_eq!(Domain::SemanticClass.missing(), [u16::from(NO_CLASS), 0, 0]);
        assert_eq!(Domain::PrincipalCurvature.missing(), MISSING_CURVATURE.map(u16::from));
        assert_eq!(Domain::BoundaryDistance.missing(), [MISSING_DISTANCE, 0, 0]);
    }

    proptest! {
        #[test]
        fn null_pixels_are_counted(bytes in prop::collection::vec(prop::array::uniform3(0u8..2), 0..99)) {
            prop_assert_eq!(null_pixels(&bytes), bytes.iter().filter(|p| **p == [0; 3]).count() as u64);
        }
    }
}
