//! Reads how the faces of an OBJ file look: its material libraries and the images that they name.

use crate::error::Result;
use crate::fs::quote::{count, quote};
use crate::image::find::{find_image, resolve};
use crate::image::texture::{TextureFile, read_textures};
use crate::mesh::obj::lines::read_text;
use crate::mesh::obj::mtl::{MtlMap, MtlMaterial, parse_mtl};
use crate::mesh::obj::normal::ObjNames;
use crate::mesh::obj::tiles::is_tiled;
use s3d_geom::{DEFAULT_COLOR, Material, Raster, Texture, Wrap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The materials and textures of the faces.
#[derive(Default)]
pub(crate) struct ObjLooks {
    /// In the order of [`ObjNames::materials`].
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    /// One for each texture.
    pub(crate) files: Vec<Option<TextureFile>>,
    /// The libraries and images that were read.
    pub(crate) companions: Vec<PathBuf>,
    /// The materials whose texture has tiles, by index. Their images are not read yet.
    pub(crate) tiled: Vec<(u32, LibraryMaterial)>,
}

/// A material, and the library that describes it.
#[derive(Clone)]
pub(crate) struct LibraryMaterial {
    pub(crate) material: MtlMaterial,
    pub(crate) library: PathBuf,
}

impl ObjLooks {
    /// Reads the libraries in `names` of the file at `path`, and the images of the materials that it uses.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for images that are too large.
    pub(crate) fn load(path: &Path, names: &ObjNames, warnings: &mut Vec<String>) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut looks = Self::default();
        let library = load_libraries(folder, &names.libraries, &mut looks.companions, warnings);

        let mut images = WantedImages::default();
        let mut unknown: Vec<&str> = Vec::new();
        for name in &names.materials {
            let found = library.get(name.as_str());
            let color = found.map_or(DEFAULT_COLOR, |found| found.material.color);
            let material = looks.materials.len() as u32;
            looks
                .materials
                .push(Material { name: name.clone(), color, texture: None });
            match found.filter(|found| found.is_tiled()) {
                Some(tiled) => {
                    looks.tiled.push((material, tiled.clone()));
                    images.skip(1);
                }
                None => images.add(found, folder, warnings),
            }
            if found.is_none() {
                unknown.push(name);
            }
        }
        if let Some(first) = unknown.first() {
            let n = count(unknown.len(), "material");
            warnings
                .push(format!("{n} in no library and drawn gray, the first is {}", quote(first.as_bytes())));
        }

        looks.load_images(&images, warnings)?;
        looks.companions.append(&mut images.paths);
        Ok(looks)
    }

    /// Decodes the images and assigns them to their materials. An image that repeats in two ways becomes two
    /// textures.
    pub(crate) fn load_images(&mut self, images: &WantedImages, warnings: &mut Vec<String>) -> Result<()> {
        let loaded = read_textures(&images.paths)?;
        for (index, (loaded, image)) in loaded.into_iter().zip(&images.paths).enumerate() {
            let users: Vec<(usize, [Wrap; 2])> = images
                .of_material
                .iter()
                .enumerate()
                .filter_map(|(material, map)| (*map).map(|(image, wrap)| (material, image, wrap)))
                .filter(|(_, image, _)| *image == index)
                .map(|(material, _, wrap)| (material, wrap))
                .collect();

            let mut texture = match loaded {
                Ok(texture) => texture,
                Err(why) => {
                    let materials = count(users.len(), "material");
                    warnings.push(format!(
                        "texture {} {why}; {materials} drawn in their colour",
                        image.display()
                    ));
                    continue;
                }
            };

            // The different ways in which the image repeats.
            let mut wraps: Vec<[Wrap; 2]> = Vec::new();
            for &(material, wrap) in &users {
                let place = wraps.iter().position(|w| *w == wrap).unwrap_or_else(|| {
                    wraps.push(wrap);
                    wraps.len() - 1
                });
                if let Some(material) = self.materials.get_mut(material) {
                    material.texture = Some((self.textures.len() + place) as u32);
                }
            }

            let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
            while let Some((&wrap, more)) = wraps.split_first() {
                // The last texture takes the image without a copy: most images have one texture.
                let (pixels, file) = if more.is_empty() {
                    let pixels = std::mem::replace(&mut texture.image, Raster::from_vec(0, 0, Vec::new()));
                    (pixels, texture.file.take())
                } else {
                    (texture.image.clone(), texture.file.clone())
                };
                self.textures.push(Texture { name: name.clone(), image: pixels, wrap });
                self.files.push(file);
                wraps.remove(0);
            }
        }
        Ok(())
    }
}

impl LibraryMaterial {
    /// Returns whether the material's texture has tiles.
    fn is_tiled(&self) -> bool {
        self.material.map.as_ref().is_some_and(|map| is_tiled(&map.file))
    }
}

/// The images that materials name, each once.
#[derive(Default)]
pub(crate) struct WantedImages {
    pub(crate) paths: Vec<PathBuf>,
    /// The index of each path.
    index_of: HashMap<PathBuf, usize>,
    /// For each material the index of its image, and how it repeats.
    of_material: Vec<Option<(usize, [Wrap; 2])>>,
}

impl WantedImages {
    /// Adds the next material, whose image is searched beside its library and in `folder`. `None` is a
    /// material that no library describes.
    fn add(&mut self, found: Option<&LibraryMaterial>, folder: &Path, warnings: &mut Vec<String>) {
        let image = found.and_then(|found| {
            let map = found.material.map.as_ref()?;
            Some((image_path(found, map, folder, warnings)?, map.wrap))
        });
        match image {
            Some((path, wrap)) => self.add_found(path, wrap),
            None => self.skip(1),
        }
    }

    /// Adds the next material, whose image is at `path`.
    pub(crate) fn add_found(&mut self, path: PathBuf, wrap: [Wrap; 2]) {
        let next = self.paths.len();
        let index = *self.index_of.entry(path.clone()).or_insert(next);
        if index == next {
            self.paths.push(path);
        }
        self.of_material.push(Some((index, wrap)));
    }

    /// Adds materials without images.
    pub(crate) fn skip(&mut self, materials: usize) {
        self.of_material.resize(self.of_material.len() + materials, None);
    }
}

/// Returns the path of the image that `map` names. Adds a warning if it lies elsewhere or is missing.
fn image_path(
    found: &LibraryMaterial,
    map: &MtlMap,
    folder: &Path,
    warnings: &mut Vec<String>,
) -> Option<PathBuf> {
    let library = found.library.display();
    let line = map.line;
    let written = quote(map.file.as_bytes());
    match find_image(&map.file, found.library.parent().unwrap_or(folder), folder) {
        Some((image, exact)) => {
            if !exact {
                let image = image.display();
                warnings.push(format!("{library}, line {line}: {written} is not there; {image} is used"));
            }
            Some(image)
        }
        None => {
            let material = quote(found.material.name.as_bytes());
            warnings.push(format!(
                "{library}, line {line}: texture {written} is not there; material {material} has its colour \
                 instead"
            ));
            None
        }
    }
}

/// Reads all libraries and returns their materials by name. The later of two materials with one name counts.
fn load_libraries(
    folder: &Path,
    libraries: &[(u64, String)],
    read: &mut Vec<PathBuf>,
    warnings: &mut Vec<String>,
) -> HashMap<String, LibraryMaterial> {
    let mut found = HashMap::new();

    for (line, names) in libraries {
        // A name may hold spaces, and a line may hold several names.
        let whole = resolve(folder, names);
        let files: Vec<PathBuf> = if whole.is_file() || names.split_whitespace().count() < 2 {
            vec![whole]
        } else {
            names.split_whitespace().map(|name| resolve(folder, name)).collect()
        };

        for library in files {
            match read_text(&library) {
                Ok(bytes) => {
                    if !read.contains(&library) {
                        read.push(library.clone());
                    }
                    let (materials, complaints) = parse_mtl(&bytes);
                    warnings.extend(complaints.iter().map(|c| format!("{}, {c}", library.display())));
                    for material in materials {
                        found.insert(
                            material.name.clone(),
                            LibraryMaterial { material, library: library.clone() },
                        );
                    }
                }
                Err(e) => warnings.push(format!("line {line}: the materials of {names:?} are missing: {e}")),
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::texture::tests::two_pixels;
    use crate::mesh::file::{MeshFile, UpAxis};
    use s3d_geom::FaceColor;
    use std::fs;

    /// Reads `obj` in a folder that also holds `files`.
    fn read_with(obj: &str, files: &[(&str, &[u8])]) -> MeshFile {
        let dir = tempfile::tempdir().unwrap();
        for (name, bytes) in files {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        let path = dir.path().join("a.obj");
        fs::write(&path, obj).unwrap();
        crate::mesh::obj::read::read(&path, UpAxis::Z).unwrap()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";

    const LIBRARY: &[u8] = b"newmtl a\nKd 1 0 0\nmap_Kd -clamp on tex\\two words.png\nnewmtl b\nKd 0 1 0\n\
                             map_Kd tex/two words.png\nnewmtl c\nKd 0 0 1\nmap_Kd gone.png\nnewmtl d\n\
                             Kd 0 0.2 0\nmap_Kd bad.png\n";

    #[test]
    fn materials_and_textures() {
        let obj = format!(
            "mtllib no lib.mtl\nmtllib lib.mtl other.mtl\n{SQUARE}usemtl a\nf 1/1 2/2 3/3\nusemtl b\n\
             f 1/1 2/2 3/3\nusemtl c\nf 1/1 2/2 3/3\n\
            usemtl d\nf 1/1 2/2 3/3\nusemtl e\nf 1/1 2/2 3/3\nusemtl a\nf 1 2 3\nusemtl f\nf 1 2 3\n"
        );
        let png = two_pixels([10, 20, 30], [40, 50, 60]);
        let files: [(&str, &[u8]); 4] = [
            ("lib.mtl", LIBRARY),
            ("other.mtl", b"newmtl e\nKd 1 1 1\n"),
            ("tex/two words.png", &png),
            ("bad.png", b"no image"),
        ];
        let file = read_with(&obj, &files);
        let mesh = &file.mesh;
        let textures: Vec<_> = mesh
            .textures()
            .iter()
            .map(|t| (t.name.as_str(), t.wrap[0], t.image.len()))
            .collect();
        assert_eq!(textures, [("two words.png", Wrap::Clamp, 2), ("two words.png", Wrap::Repeat, 2)]);
        let read: Vec<&str> = file
            .companions
            .iter()
            .map(|path| path.file_name().unwrap().to_str().unwrap())
            .collect();
        assert_eq!(read, ["lib.mtl", "other.mtl", "two words.png", "bad.png"]);

        let kept = TextureFile { extension: "png", bytes: png.clone() };
        assert_eq!(file.texture_files, [Some(kept.clone()), Some(kept)]);
        assert!(matches!(mesh.color_of(0), FaceColor::Texture(0, ..)));
        assert!(matches!(mesh.color_of(1), FaceColor::Texture(1, ..)));
        for (face, color) in
            [(2, [0, 0, 255]), (3, [0, 51, 0]), (4, [255; 3]), (5, [255, 0, 0]), (6, DEFAULT_COLOR)]
        {
            assert!(matches!(mesh.color_of(face), FaceColor::Flat(c) if c == color), "{face}");
        }
        let told = file.warnings.join("\n");
        for words in [
            "line 1: the materials of \"no lib.mtl\" are missing",
            "lib.mtl, line 9: texture `gone.png` is not there; material `c`",
            "bad.png is no image; PNG, JPEG, WebP, BMP, TGA and TIFF are read; 1 material",
            "1 material in no library and drawn gray, the first is `f`",
        ] {
            assert!(told.contains(words), "{words}: {told}");
        }
    }

    #[test]
    fn a_texture_of_another_machine_is_found_by_its_last_part() {
        let mtl = b"newmtl a\nmap_Kd C:\\scans\\out\\t.png\n";
        let png = two_pixels([1; 3], [2; 3]);
        let obj = format!("mtllib lib/a.mtl\n{SQUARE}usemtl a\nf 1/1 2/2 3/3\n");
        let file = read_with(&obj, &[("lib/a.mtl", mtl), ("t.png", &png)]);
        assert_eq!(file.mesh.textures().len(), 1);
        assert!(file.warnings[0].contains("is not there") && file.warnings[0].contains("t.png is used"));
    }
}
