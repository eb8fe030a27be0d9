//! Textures in UDIM tiles: `map_Kd wall.<UDIM>.png` means an image for each square of the texture plane. The
//! square from (u, v) to (u + 1, v + 1) is tile 1001 + u + 10 v. Source: Foundry's and Blender's manuals,
//! "UDIM".
//!
//! The faces of a material that lie in different tiles get a material each, all with one name. Their texture
//! coordinates are moved to the first square.

use crate::error::Result;
use crate::image::find::find_image;
use crate::mesh::obj::looks::{LibraryMaterial, ObjLooks, WantedImages};
use s3d_geom::glam::{Vec2, vec2};
use s3d_geom::{NO_INDEX, Wrap};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// The word that stands for the number of a tile.
const WORD: &str = "<UDIM>";

/// The number of tiles in a row.
const ROW: u32 = 10;

/// The number of the first tile. Numbers have four digits.
const FIRST: u32 = 1001;
const LAST: u32 = 9999;

/// The faces of a mesh, as far as their looks go.
pub(crate) struct TiledFaces<'a> {
    pub(crate) uvs: &'a mut Vec<Vec2>,
    pub(crate) face_uvs: &'a mut [[u32; 3]],
    pub(crate) face_materials: &'a mut [u32],
}

/// Returns whether the name of an image stands for tiles.
pub(crate) fn is_tiled(file: &str) -> bool {
    file.contains(WORD)
}

impl ObjLooks {
    /// Gives the faces of materials in tiles the images of their tiles. The libraries' images are searched
    /// beside them and in the folder of the mesh at `path`.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for images that are too large.
    pub(crate) fn add_tiles(
        &mut self,
        path: &Path,
        mut faces: TiledFaces<'_>,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let tiled = std::mem::take(&mut self.tiled);
        if tiled.is_empty() {
            return Ok(());
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut images = WantedImages::default();
        images.skip(self.materials.len());

        for (material, found) in &tiled {
            let mut missing = Vec::new();
            for (tile, members) in faces.by_tile(*material) {
                let Some(image) = image_of(found, tile, folder) else {
                    missing.push(tile.number().to_string());
                    continue;
                };
                let Some(of_tile) = self.materials.get(*material as usize).cloned() else { continue };
                faces.move_to(&members, tile, self.materials.len() as u32);
                self.materials.push(of_tile);
                images.add_found(image, [Wrap::Clamp; 2]);
            }
            if !missing.is_empty() {
                let map = found.material.map.as_ref();
                warnings.push(format!(
                    "{}, line {}: {} has no image for the tiles {}; their faces have the material's colour",
                    found.library.display(),
                    map.map_or(0, |map| map.line),
                    map.map_or("", |map| map.file.as_str()),
                    missing.join(", ")
                ));
            }
        }
        self.load_images(&images, warnings)?;
        self.companions.append(&mut images.paths);
        Ok(())
    }
}

/// Returns the path of a tile's image, if it is there.
fn image_of(found: &LibraryMaterial, tile: Tile, folder: &Path) -> Option<PathBuf> {
    let map = found.material.map.as_ref()?;
    let number = tile.number();
    if !(FIRST..=LAST).contains(&number) {
        return None;
    }
    let name = map.file.replace(WORD, &number.to_string());
    let (image, _) = find_image(&name, found.library.parent().unwrap_or(folder), folder)?;
    Some(image)
}

/// A square of the texture plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Tile {
    row: u32,
    column: u32,
}

impl Tile {
    /// Returns the square that holds a point. Returns `None` left of the first column, below the first row,
    /// and right of the tenth column.
    fn of(at: Vec2) -> Option<Self> {
        let whole = at.floor();
        let is_tile = whole.x >= 0.0 && whole.y >= 0.0 && whole.x < ROW as f32 && whole.y <= LAST as f32;
        is_tile.then_some(Self { row: whole.y as u32, column: whole.x as u32 })
    }

    fn number(self) -> u32 {
        FIRST + self.column + ROW * self.row
    }

    fn corner(self) -> Vec2 {
        vec2(self.column as f32, self.row as f32)
    }
}

impl TiledFaces<'_> {
    /// Returns the faces of a material by the tile that their middle is in, by number. Faces without texture
    /// coordinates are in none.
    fn by_tile(&self, material: u32) -> Vec<(Tile, Vec<usize>)> {
        let mut tiles: BTreeMap<Tile, Vec<usize>> = BTreeMap::new();
        for (face, corners) in self.face_uvs.iter().enumerate() {
            if self.face_materials.get(face) != Some(&material) || corners.contains(&NO_INDEX) {
                continue;
            }
            let places = corners.map(|corner| self.uvs.get(corner as usize).copied().unwrap_or(Vec2::NAN));
            let middle = places.iter().sum::<Vec2>() / 3.0;
            if let Some(tile) = Tile::of(middle) {
                tiles.entry(tile).or_default().push(face);
            }
        }
        tiles.into_iter().collect()
    }

    /// Gives faces another material, and moves their texture coordinates from a tile to the first square.
    fn move_to(&mut self, faces: &[usize], tile: Tile, material: u32) {
        let mut moved: HashMap<u32, u32> = HashMap::new();
        for &face in faces {
            if let Some(of_face) = self.face_materials.get_mut(face) {
                *of_face = material;
            }
            let Some(corners) = self.face_uvs.get_mut(face) else { continue };
            for corner in corners {
                *corner = *moved.entry(*corner).or_insert_with_key(|index| {
                    let place = self.uvs.get(*index as usize).copied().unwrap_or_default();
                    self.uvs.push(place - tile.corner());
                    self.uvs.len() as u32 - 1
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::image::texture::tests::two_pixels;
    use crate::mesh::file::{MeshFile, UpAxis};
    use s3d_geom::FaceColor;
    use std::fs;

    /// Reads a mesh whose triangles have their texture in the squares at these corners.
    fn read(squares: &[[f32; 2]], tiles: &[u32]) -> MeshFile {
        let dir = tempfile::tempdir().unwrap();
        let mut obj = "mtllib a.mtl\nusemtl wall\n".to_owned();
        for (i, [u, v]) in squares.iter().enumerate() {
            obj += &format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\n");
            obj += &format!("vt {u} {v}\nvt {} {v}\nvt {u} {}\n", u + 1.0, v + 1.0);
            let [a, b, c] = [3 * i + 1, 3 * i + 2, 3 * i + 3];
            obj += &format!("f {a}/{a} {b}/{b} {c}/{c}\n");
        }
        fs::write(dir.path().join("a.mtl"), "newmtl wall\nKd 1 0 0\nmap_Kd tex/wall.<UDIM>.png\n").unwrap();
        fs::create_dir(dir.path().join("tex")).unwrap();
        for tile in tiles {
            let color = [(*tile % 256) as u8; 3];
            fs::write(dir.path().join(format!("tex/wall.{tile}.png")), two_pixels(color, color)).unwrap();
        }
        let path = dir.path().join("a.obj");
        fs::write(&path, obj).unwrap();
        crate::mesh::obj::read::read(&path, UpAxis::Z).unwrap()
    }

    #[test]
    fn each_face_has_the_image_of_its_tile() {
        let file =
            read(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [9.0, 2.0], [1.0, 0.0]], &[1001, 1002, 1011, 1030]);
        let mesh = &file.mesh;
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);
        assert_eq!((mesh.textures().len(), file.companions.len()), (4, 5));
        for (face, tile) in [(0, 1001u32), (1, 1002), (2, 1011), (3, 1030), (4, 1002)] {
            let FaceColor::Texture(_, texture, uvs) = mesh.color_of(face) else { panic!("face {face}") };
            assert_eq!(texture.name, format!("wall.{tile}.png"));
            assert!(uvs.iter().all(|uv| uv.min_element() >= 0.0 && uv.max_element() <= 1.0), "{uvs:?}");
            let material = &mesh.materials()[mesh.material_of(face).unwrap() as usize];
            assert_eq!(material.name, "wall");
        }
    }

    #[test]
    fn tiles_without_an_image_have_the_colour_and_are_told() {
        let file = read(&[[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 3.0]], &[1001]);
        assert!(matches!(file.mesh.color_of(0), FaceColor::Texture(..)));
        for face in 1..4 {
            assert!(matches!(file.mesh.color_of(face), FaceColor::Flat([255, 0, 0])), "{face}");
        }
        let told = "a.mtl, line 3: tex/wall.<UDIM>.png has no image for the tiles 1002, 1031";
        assert!(file.warnings[0].contains(told), "{:?}", file.warnings);
    }
}
