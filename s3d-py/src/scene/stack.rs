//! Many images of one size, in one array for each modality.

use super::{Request, Scene, bytes_of};
use crate::error::exception;
use crate::work::watched;
use bytemuck::cast_slice_mut;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use s3d_dataset::check_memory;
use s3d_geom::Camera;
use s3d_render::Caster;

/// So many images are made by one thread, which keeps its memory for them.
const IMAGES: usize = 8;

/// Renders cameras of one size. Returns an array for each modality: N × height × width, or with 3 channels
/// more.
pub(super) fn render_stack<'py>(
    py: Python<'py>,
    scene: &Scene,
    cameras: &[Camera],
    [width, height]: [u32; 2],
    request: &Request,
    threads: Option<usize>,
    sink: &Py<PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let words = request.modalities()?;
    let pixels = cameras.len() * width as usize * height as usize;
    let bytes: f64 = words.iter().map(|word| bytes_of(word)).sum();
    let what = format!("{} images of {width} × {height} pixels", cameras.len());
    check_memory(&what, bytes * pixels as f64).map_err(|e| exception(&e))?;

    let mut stacks: Vec<Stack> = words.iter().map(|word| Stack::new(word, pixels)).collect();
    watched(py, threads, sink, |ctx| {
        let progress = ctx.progress("rendering", "images", cameras.len() as u64);
        // Each image has a place in each stack.
        let mut places: Vec<Vec<&mut [u8]>> = cameras.iter().map(|_| Vec::new()).collect();
        for stack in &mut stacks {
            let all = stack.bytes_mut();
            let len = all.len() / cameras.len();
            let parts = all.chunks_exact_mut(len);
            places
                .iter_mut()
                .zip(parts)
                .for_each(|(places, part)| places.push(part));
        }

        let images = places.into_par_iter().zip(cameras).with_min_len(IMAGES);
        images.try_for_each_init(
            || Caster::new(scene.tree()),
            |caster, (places, camera)| {
                ctx.check()?;
                let mut hits = caster.cast(camera);
                let mut places: Vec<_> = words.iter().map(String::as_str).zip(places).collect();
                scene.draw_all(&mut hits, camera, request, |word, image| {
                    let of_word = places.iter_mut().filter(|(asked, _)| *asked == word);
                    of_word.for_each(|(_, place)| place.copy_from_slice(image.bytes()));
                });
                progress.add(1);
                Ok(())
            },
        )
    })?;

    let size = [cameras.len(), height as usize, width as usize];
    let dict = PyDict::new(py);
    for (word, stack) in words.iter().zip(stacks) {
        dict.set_item(word, stack.into_array(py, word, size)?)?;
    }
    Ok(dict)
}

/// The images of one modality, one after the other.
enum Stack {
    Colors(Vec<u8>),
    Faces(Vec<i32>),
    Numbers(Vec<f32>),
}

impl Stack {
    fn new(word: &str, pixels: usize) -> Self {
        match word {
            "rgb" => Self::Colors(vec![0; 3 * pixels]),
            "face" => Self::Faces(vec![0; pixels]),
            "depth" => Self::Numbers(vec![0.0; pixels]),
            _ => Self::Numbers(vec![0.0; 3 * pixels]),
        }
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::Colors(all) => all,
            Self::Faces(all) => cast_slice_mut(all),
            Self::Numbers(all) => cast_slice_mut(all),
        }
    }

    fn into_array<'py>(self, py: Python<'py>, word: &str, size: [usize; 3]) -> PyResult<Bound<'py, PyAny>> {
        let [n, h, w] = size;
        let channels = matches!(word, "rgb" | "normal" | "xyz").then_some(3);
        let size: Vec<usize> = [n, h, w].into_iter().chain(channels).collect();
        Ok(match self {
            Self::Colors(all) => PyArray1::from_vec(py, all).reshape(size)?.into_any(),
            Self::Faces(all) => PyArray1::from_vec(py, all).reshape(size)?.into_any(),
            Self::Numbers(all) => PyArray1::from_vec(py, all).reshape(size)?.into_any(),
        })
    }
}
