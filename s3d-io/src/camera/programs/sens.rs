//! Recordings of ScanNet: `scene0000_00.sens`, with poses, intrinsics, colour pictures and depth. Source:
//! ScanNet/ScanNet, SensReader/README.md and SensReader/c++/src/sensorData.h. BundleFusion writes the same
//! form.
//!
//! All numbers are little-endian. A pose is camera → world in OpenCV's axes, 4 × 4 row by row.
//! Measurements of motion after the frames are not read.

use crate::camera::matterport::pose_of_matrix;
use crate::camera::picture_file::{PictureFile, read_part};
use crate::camera::posed::{Optics, PosedCamera};
use crate::camera::programs::scannet::optics_of_matrix;
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use s3d_deflate::Inflater;
use s3d_geom::{Pose, Raster};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The only version of the format.
const VERSION: u32 = 4;

/// The longest name of a sensor, bytes.
const LONGEST_NAME: u64 = 1024;

/// The most pixels that a side of a picture may have.
const LARGEST_SIDE: u32 = 65_535;

/// A recording of ScanNet.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// The name of the sensor, such as `StructureSensor`.
    pub sensor: String,
    /// The colour camera's width and height in pixels, and its optics.
    pub color: ([u32; 2], Optics),
    /// The depth camera's width and height in pixels, and its optics.
    pub depth: ([u32; 2], Optics),
    /// The value of a depth of one metre.
    pub depth_scale: f64,
    /// How the depth is compressed.
    depth_form: DepthForm,
    /// The frames, by time.
    pub frames: Vec<RecordedFrame>,
}

/// A frame of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// The pose of both cameras. `None`: the sensor was lost.
    pub pose: Option<Pose>,
    /// The colour picture.
    pub color: PictureFile,
    /// The bytes of the recording that are the compressed depth.
    pub depth: Range<u64>,
}

/// How depth is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DepthForm {
    /// Not at all.
    Raw,
    /// By zlib.
    Zlib,
    /// In another way, with the number that the file has for it.
    Other(i32),
}

impl Recording {
    /// Reads everything but the pictures, which are only found.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a file that is damaged or cut short, with the frame;
    /// [`Error::Unsupported`] for another version, or colours that are neither JPEG nor PNG.
    pub fn open(path: &Path) -> Result<Self> {
        let file = open_file(path)?;
        let length = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
        Source { path, length, file: BufReader::new(file) }.recording()
    }

    /// Reads the depth of a frame: `depth.0` pixels, row by row, in units of 1 / `depth_scale` metres. 0 is
    /// missing.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the depth is damaged; [`Error::Unsupported`] if it is compressed
    /// in another way than by zlib.
    pub fn read_depth(&self, frame: &RecordedFrame) -> Result<Raster<u16>> {
        let [width, height] = self.depth.0;
        let size = 2 * width as usize * height as usize;
        let fault = |why: &str| {
            let message = format!("the depth at byte {} {why}", frame.depth.start);
            Error::format(&self.path, message)
        };

        let stored = read_part(&self.path, &frame.depth)?;
        let bytes = match self.depth_form {
            DepthForm::Raw => stored,
            DepthForm::Zlib => {
                // Deflate makes at most 1,032 bytes of one.
                if size > stored.len().saturating_mul(1032) {
                    return Err(fault("is damaged"));
                }
                let mut bytes = vec![0; size];
                Inflater::default()
                    .zlib(&stored, &mut bytes)
                    .map_err(|e| fault(&format!("is damaged: {e}")))?;
                bytes
            }
            DepthForm::Other(form) => {
                let message = format!("compresses depth in the form {form}: only raw and zlib are read");
                return Err(Error::unsupported(&self.path, message));
            }
        };

        let (values, rest) = bytes.as_chunks::<2>();
        let values: Vec<u16> = values.iter().map(|pair| u16::from_le_bytes(*pair)).collect();
        if !rest.is_empty() || 2 * values.len() != size {
            return Err(fault(&format!("has {} bytes, not {size}", bytes.len())));
        }
        let mut depth = Raster::filled(width, height, 0);
        depth.pixels_mut().copy_from_slice(&values);
        Ok(depth)
    }

    /// Returns the cameras of the colour pictures, by number, and the number of frames without a pose.
    pub(crate) fn cameras(self) -> (Vec<PosedCamera>, usize) {
        let (size, optics) = self.color;
        let count = self.frames.len();
        let cameras: Vec<PosedCamera> = (0..)
            .zip(self.frames)
            .filter_map(|(number, frame): (u64, _)| {
                Some(PosedCamera {
                    name: number.to_string(),
                    pose: frame.pose?,
                    size: Some(size),
                    optics: Some(optics),
                    picture: Some(frame.color),
                    mask: None,
                    line: 0,
                })
            })
            .collect();
        let untracked = count - cameras.len();
        (cameras, untracked)
    }
}

/// Returns whether the first bytes of a file are those of a recording: its version, and the length of the
/// sensor's name.
pub(crate) fn is_recording(start: &[u8]) -> bool {
    let Some((version, rest)) = start.split_first_chunk() else { return false };
    let length = rest.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
    u32::from_le_bytes(*version) == VERSION && length.is_some_and(|length| length <= LONGEST_NAME)
}

/// Returns the only recording in a folder, if there is one.
pub(crate) fn find(dir: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(dir).ok()?;
    let is_recording = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "sens");
    let mut found = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(is_recording);
    let first = found.next();
    first.filter(|_| found.next().is_none())
}

/// A recording as it is read.
struct Source<'a> {
    path: &'a Path,
    /// The length of the file in bytes.
    length: u64,
    file: BufReader<File>,
}

impl Source<'_> {
    fn recording(mut self) -> Result<Recording> {
        let version = u32::from_le_bytes(self.take()?);
        if version != VERSION {
            let message =
                format!("is no recording of ScanNet of version {VERSION}: it begins with {version}");
            return Err(Error::unsupported(self.path, message));
        }
        let sensor = self.name()?;

        // Each camera has its intrinsics and its place, which is the origin.
        let color_optics = self.optics("the colour camera")?;
        self.matrix()?;
        let depth_optics = self.optics("the depth camera")?;
        self.matrix()?;

        let color_form = i32::from_le_bytes(self.take()?);
        let depth_form = match i32::from_le_bytes(self.take()?) {
            0 => DepthForm::Raw,
            1 => DepthForm::Zlib,
            form => DepthForm::Other(form),
        };
        // 1 is PNG, 2 is JPEG.
        if ![1, 2].contains(&color_form) {
            let message = format!("compresses colours in the form {color_form}: only PNG and JPEG are read");
            return Err(Error::unsupported(self.path, message));
        }

        let color_size = self.size()?;
        let depth_size = self.size()?;
        let depth_scale = f64::from(f32::from_le_bytes(self.take()?));
        if !(depth_scale > 0.0 && depth_scale.is_finite()) {
            let message = format!("a depth of one metre is {depth_scale}: it must be above 0");
            return Err(Error::format(self.path, message));
        }

        let count = u64::from_le_bytes(self.take()?);
        let mut frames = Vec::new();
        for number in 0..count {
            frames.push(self.frame(number, count)?);
        }
        Ok(Recording {
            path: self.path.to_owned(),
            sensor,
            color: (color_size, color_optics),
            depth: (depth_size, depth_optics),
            depth_scale,
            depth_form,
            frames,
        })
    }

    /// Reads the head of a frame, and skips its pictures.
    fn frame(&mut self, number: u64, count: u64) -> Result<RecordedFrame> {
        let fault = |path: &Path, message: String| Error::format(path, format!("frame {number}: {message}"));
        let cut = |path: &Path| fault(path, format!("the file ends within it, and tells of {count} frames"));

        let matrix = self.matrix().map_err(|_| cut(self.path))?;
        let pose = match matrix.iter().all(|v| v.is_finite()) {
            true => Some(pose_of_matrix(&matrix).map_err(|(_, message)| fault(self.path, message))?),
            false => None,
        };

        // The times of both pictures, then their lengths in bytes.
        let mut numbers = [0u64; 4];
        for number in &mut numbers {
            *number = u64::from_le_bytes(self.take().map_err(|_| cut(self.path))?);
        }
        let [_, _, color_bytes, depth_bytes] = numbers;

        let start = self.place()?;
        let color_end = start.checked_add(color_bytes);
        let depth_end = color_end.and_then(|end| end.checked_add(depth_bytes));
        let Some((color_end, depth_end)) = color_end.zip(depth_end).filter(|(_, end)| *end <= self.length)
        else {
            return Err(cut(self.path));
        };
        self.skip(depth_end - start)?;
        Ok(RecordedFrame {
            pose,
            color: PictureFile { path: self.path.to_owned(), part: Some(start..color_end) },
            depth: color_end..depth_end,
        })
    }

    fn name(&mut self) -> Result<String> {
        let length = u64::from_le_bytes(self.take()?);
        if length > LONGEST_NAME {
            let message = format!("the name of the sensor has {length} bytes: is it a recording of ScanNet?");
            return Err(Error::format(self.path, message));
        }
        let mut name = vec![0; length as usize];
        self.fill(&mut name)?;
        Ok(String::from_utf8_lossy(&name).into_owned())
    }

    fn size(&mut self) -> Result<[u32; 2]> {
        let width = u32::from_le_bytes(self.take()?);
        let height = u32::from_le_bytes(self.take()?);
        if [width, height].iter().all(|side| (1..=LARGEST_SIDE).contains(side)) {
            return Ok([width, height]);
        }
        Err(Error::format(self.path, format!("a picture of {width} × {height} pixels")))
    }

    fn optics(&mut self, camera: &str) -> Result<Optics> {
        let matrix = self.matrix()?;
        optics_of_matrix(&matrix).map_err(|message| Error::format(self.path, format!("{camera}: {message}")))
    }

    fn matrix(&mut self) -> Result<[f64; 16]> {
        let mut numbers = [0.0; 16];
        for number in &mut numbers {
            *number = f64::from(f32::from_le_bytes(self.take()?));
        }
        Ok(numbers)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<()> {
        self.file.read_exact(bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => Error::format(self.path, "the file ends within its head"),
            _ => Error::io(self.path, "read", e),
        })
    }

    fn place(&mut self) -> Result<u64> {
        self.file.stream_position().map_err(|e| Error::io(self.path, "read", e))
    }

    fn skip(&mut self, bytes: u64) -> Result<()> {
        self.file
            .seek_relative(bytes.cast_signed())
            .map_err(|e| Error::io(self.path, "read", e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DVec3, dvec2};
    use std::fs;

    const COLOR: [f32; 16] =
        [1170.0, 0.0, 648.0, 0.0, 0.0, 1171.0, 484.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    const DEPTH: [f32; 16] =
        [577.0, 0.0, 319.0, 0.0, 0.0, 578.0, 239.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    const IDENTITY: [f32; 16] =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    /// A level camera at (4, 5, 1.5) that looks along +Y.
    const ALONG_Y: [f32; 16] =
        [1.0, 0.0, 0.0, 4.0, 0.0, 0.0, 1.0, 5.0, 0.0, -1.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0];
    const LOST: [f32; 16] = [f32::NEG_INFINITY; 16];

    /// The value of depth at the pixel `i` of a frame.
    fn depth_at(i: usize) -> u16 {
        (i * 257) as u16
    }

    /// Returns a recording with frames of these poses. Colours are 13 × 9, depth is 4 × 3.
    fn recording(poses: &[[f32; 16]], depth_form: i32) -> Vec<u8> {
        let mut bytes = VERSION.to_le_bytes().to_vec();
        let name = b"StructureSensor";
        bytes.extend((name.len() as u64).to_le_bytes());
        bytes.extend(name);
        for matrix in [COLOR, IDENTITY, DEPTH, IDENTITY] {
            bytes.extend(matrix.iter().flat_map(|v| v.to_le_bytes()));
        }
        bytes.extend([2i32.to_le_bytes(), depth_form.to_le_bytes()].concat());
        bytes.extend([13u32, 9, 4, 3].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(1000f32.to_le_bytes());
        bytes.extend((poses.len() as u64).to_le_bytes());

        let raw: Vec<u8> = (0..12).flat_map(|i| depth_at(i).to_le_bytes()).collect();
        let depth = if depth_form == 1 {
            let mut out = Vec::new();
            s3d_deflate::Deflater::new(s3d_deflate::Search::photo(8))
                .unwrap()
                .zlib(&raw, None, &mut out);
            out
        } else {
            raw
        };
        for (number, pose) in (0u8..).zip(poses) {
            let jpeg = jpeg(number);
            bytes.extend(pose.iter().flat_map(|v| v.to_le_bytes()));
            let numbers = [7, 8, jpeg.len() as u64, depth.len() as u64];
            bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
            bytes.extend(&jpeg);
            bytes.extend(&depth);
        }
        bytes.extend(0u64.to_le_bytes());
        bytes
    }

    /// A grey picture of 13 × 9 pixels.
    fn jpeg(number: u8) -> Vec<u8> {
        let image = image::RgbImage::from_pixel(13, 9, image::Rgb([10 + 40 * number; 3]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        bytes.into_inner()
    }

    fn opened(bytes: &[u8]) -> (tempfile::TempDir, Result<Recording>) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene0000_00.sens");
        fs::write(&path, bytes).unwrap();
        let recording = Recording::open(&path);
        (dir, recording)
    }

    #[test]
    fn frames_have_their_poses_pictures_and_depth() {
        for form in [0, 1] {
            let bytes = recording(&[ALONG_Y, LOST, ALONG_Y], form);
            assert!(is_recording(&bytes[..16]));
            let (dir, recording) = opened(&bytes);
            let recording = recording.unwrap();
            assert_eq!((recording.sensor.as_str(), recording.depth_scale), ("StructureSensor", 1000.0));
            assert_eq!((recording.frames.len(), recording.depth.0), (3, [4, 3]));
            let depth = recording.read_depth(&recording.frames[2]).unwrap();
            let expected: Vec<u16> = (0..12).map(depth_at).collect();
            assert_eq!(depth.pixels(), expected);

            assert_eq!(find(dir.path()).unwrap(), recording.path);
            let (cameras, untracked) = recording.cameras();
            assert_eq!((cameras.len(), untracked), (2, 1));
            let last = &cameras[1];
            assert_eq!((last.name.as_str(), last.size), ("2", Some([13, 9])));
            assert_eq!((last.pose.location, last.pose.forward()), (DVec3::new(4.0, 5.0, 1.5), DVec3::Y));
            let Some(Optics::Pinhole { focal_px, center_px, .. }) = last.optics else { panic!() };
            assert_eq!((focal_px, center_px), (dvec2(1170.0, 1171.0), Some(dvec2(648.0, 484.0))));

            let picture = last.picture.as_ref().unwrap();
            assert_eq!((picture.check().unwrap(), picture.turn().unwrap()), ((13, 9), 1));
            assert!(picture.read().unwrap().at(6, 4)[0].abs_diff(90) < 3);
        }
    }

    #[test]
    fn faults_name_their_frame() {
        let whole = recording(&[ALONG_Y, ALONG_Y], 1);
        let message = |bytes: &[u8]| opened(bytes).1.unwrap_err().to_string();
        assert!(message(&whole[..100]).contains("the file ends within its head"));
        let ends = "frame 1: the file ends within it, and tells of 2 frames";
        assert!(message(&whole[..whole.len() - 20]).contains(ends));
        assert!(message(&[&[9, 0, 0, 0], &whole[4..]].concat()).contains("it begins with 9"));
        let mut sheared = ALONG_Y;
        sheared[0] = 2.0;
        assert!(message(&recording(&[ALONG_Y, sheared], 1)).contains("frame 1: the upper left 3×3 part"));

        let (_dir, other) = opened(&recording(&[ALONG_Y], 2));
        let other = other.unwrap();
        let fault = other.read_depth(&other.frames[0]).unwrap_err().to_string();
        assert!(fault.contains("compresses depth in the form 2"), "{fault}");

        // Every byte of the head, and every length of the file, is an error or a recording.
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x80;
            for bytes in [&bytes[..], &whole[..at]] {
                if let (_dir, Ok(read)) = opened(bytes) {
                    read.frames
                        .iter()
                        .for_each(|frame| drop((read.read_depth(frame), frame.color.read())));
                }
            }
        }
    }
}
