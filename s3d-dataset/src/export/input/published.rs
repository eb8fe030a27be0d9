//! Opens the folder of a published area.

use crate::error::Result;
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::input::numbering::published_numbers;
use crate::export::input::photographs::Photographs;
use crate::export::input::scene::{Opened, files_of, photographs_of, pictures_of};
use crate::options::placing::Placing;
use crate::record::data_set::check_area;
use glam::{DAffine3, DVec3};
use s3d_io::scene::{PublishedArea, PublishedOptions, SceneFile};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl AreaInput {
    /// Opens the folder of a published area. `scene` is the scene file that names it; `None` if the command
    /// line does.
    pub(super) fn published(
        folder: &Path,
        scene: Option<SceneFile>,
        asked: Option<Placing>,
        opened: Opened,
    ) -> Result<Self> {
        let options = PublishedOptions {
            area: scene.as_ref().map(|s| s.area),
            world_from_area: scene.as_ref().map_or(DAffine3::IDENTITY, |s| s.world_from_published),
        };

        check_area(folder)?;
        let mut area = PublishedArea::open_with(folder, &options)?;
        let mut warnings = std::mem::take(&mut area.warnings);
        let mut rooms = Vec::new();
        let mut mesh = area.read_mesh()?;

        let is_labelled = area.semantic_mesh.is_some();
        if opened.annotations && is_labelled {
            for label in &mut mesh.labels {
                label.area = area.area;
            }
            let mut annotations = area.annotations(&mesh)?;
            warnings.append(&mut annotations.warnings);
            rooms = published_numbers(&mesh.labels, annotations);
        }

        let taxonomy = area.taxonomy.clone();

        let listed = match &scene {
            Some(scene) => Cameras::of_scene(scene, asked, DVec3::ZERO)?,
            None => asked.map(|placing| (Cameras::Placed(placing), folder.to_owned())),
        };
        let (cameras, cameras_path) = listed.unwrap_or_else(|| {
            let (locations, rooms) = std::mem::take(&mut area.locations)
                .into_iter()
                .map(|l| (l.location, l.room))
                .unzip();
            (Cameras::Listed(locations, rooms), folder.to_owned())
        });

        let mut files = vec![folder.to_owned()];
        let mut sources = published_sources(folder, &area);
        if let Some(scene) = &scene {
            files.extend(files_of(scene));
            sources.extend(files_of(scene).into_iter().filter(|path| path != folder));
        }

        let file = Arc::new(mesh.file);
        let frame = MeshFrame::of(&file);
        frame.refuse_far_locations(&cameras_path, cameras.listed())?;

        let photographs = match &scene {
            Some(scene) => photographs_of(scene, &MeshFrame { offset_m: DVec3::ZERO, ..frame })?,
            None => Photographs::default(),
        };

        files.extend(photographs.files().cloned());
        sources.extend(photographs.by_folder().into_keys());

        Ok(Self {
            number: area.area,
            path: scene.as_ref().map_or(folder, |s| &s.path).to_owned(),
            source: MeshSource::Published(Box::new(area)),
            frame,
            mesh_file: opened.keep_mesh.then_some(file),
            pictures: pictures_of(scene.and_then(|s| s.pictures), &cameras, &frame),
            is_labelled,
            taxonomy,
            rooms,
            cameras,
            cameras_path,
            photographs,
            notes: Vec::new(),
            warnings,
            lenient: false,
            files,
            sources,
            annotations: Vec::new(),
            found: None,
            records: Vec::new(),
        })
    }
}

/// The files and folders of a published area that decide the bytes of the data set.
fn published_sources(folder: &Path, area: &PublishedArea) -> Vec<PathBuf> {
    let mut sources = vec![area.mesh.clone()];
    sources.extend(area.semantic_mesh.iter().chain(&area.labels).cloned());
    if !area.taxonomy.is_s3dis() {
        sources.push(area.taxonomy_json());
    }
    if area.world_offset_m != DVec3::ZERO {
        sources.push(area.conventions());
    }
    let poses = ["data/pose", "pano/pose"].map(|name| folder.join(name));
    sources.extend(poses.into_iter().filter(|path| path.is_dir()));
    sources
}
