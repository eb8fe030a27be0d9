//! Tests of the images of E57 files. The expected pixels follow from the equations of the standard.

use super::{E57Pictures, E57Shot};
use crate::camera::{ScanLocation, uuid_from_name};
use crate::error::Error;
use e57::{
    E57Writer, ImageFormat, ImageWriter, PinholeImageProperties, Quaternion, Record,
    SphericalImageProperties, Transform, Translation, VisualReferenceImageProperties,
};
use image::{DynamicImage, GrayImage, ImageFormat as Format, RgbImage};
use s3d_geom::glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, dvec2, dvec3};
use s3d_geom::{CaptureLens, Pose};
use std::f64::consts::{PI, TAU};
use std::fs::File;
use std::io::Cursor;
use std::path::{Path, PathBuf};

const GUID: &str = "{5C2959C3-0BDF-4C8E-9D11-AABBCCDDEEFF}";
const UUID: &str = "5c2959c30bdf4c8e9d11aabbccddeeff";

type Writer = E57Writer<File>;

/// A file in the making: two scans, one of which has a uuid, and images.
struct Maker {
    dir: tempfile::TempDir,
    writer: Writer,
}

impl Maker {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let mut writer = E57Writer::from_file(dir.path().join("scan.e57"), "{0}").unwrap();
        for (guid, name, x) in [(GUID, "hall", 1.0), ("second", "kitchen", 5.0)] {
            let prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
            let mut scan = writer.add_pointcloud(guid, prototype).unwrap();
            scan.set_name(Some(name.to_owned()));
            scan.set_transform(Some(transform(dvec3(x, 2.0, 1.5), DQuat::IDENTITY)));
            scan.finalize().unwrap();
        }
        Self { dir, writer }
    }

    /// Adds an image whose name is `name`; `fill` adds the rest.
    fn image(&mut self, name: &str, fill: impl FnOnce(&mut ImageWriter<'_, File>)) {
        let mut image = self.writer.add_image(&format!("guid of {name}")).unwrap();
        image.set_name(name);
        fill(&mut image);
        image.finalize().unwrap();
    }

    fn close(mut self) -> (tempfile::TempDir, PathBuf) {
        self.writer.finalize().unwrap();
        let path = self.dir.path().join("scan.e57");
        (self.dir, path)
    }
}

fn transform(t: DVec3, q: DQuat) -> Transform {
    Transform {
        rotation: Quaternion { w: q.w, x: q.x, y: q.y, z: q.z },
        translation: Translation { x: t.x, y: t.y, z: t.z },
    }
}

/// A rotation about all axes.
fn turn() -> DQuat {
    DQuat::from_rotation_z(0.9) * DQuat::from_rotation_y(-0.5) * DQuat::from_rotation_x(1.3)
}

const PLACE: DVec3 = DVec3::new(1.1, 2.2, 1.6);

fn picture(w: u32, h: u32, format: Format) -> Cursor<Vec<u8>> {
    let image = RgbImage::from_fn(w, h, |x, y| image::Rgb([(5 * x) as u8, (7 * y) as u8, 90]));
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::from(image).write_to(&mut bytes, format).unwrap();
    bytes.set_position(0);
    bytes
}

fn pinhole_numbers() -> PinholeImageProperties {
    PinholeImageProperties {
        width: 40,
        height: 30,
        focal_length: 0.02,
        pixel_width: 0.001,
        pixel_height: 0.0011,
        principal_x: 21.5,
        principal_y: 13.25,
    }
}

fn add_pinhole(image: &mut ImageWriter<'_, File>) {
    image
        .add_pinhole(ImageFormat::Png, &mut picture(40, 30, Format::Png), pinhole_numbers(), None)
        .unwrap();
}

fn spherical_numbers(width: u32, height: u32, pixel: f64) -> SphericalImageProperties {
    SphericalImageProperties { width, height, pixel_width: pixel, pixel_height: pixel }
}

fn add_sphere(image: &mut ImageWriter<'_, File>, numbers: SphericalImageProperties) {
    let mut picture = picture(numbers.width, numbers.height, Format::Jpeg);
    image
        .add_spherical(ImageFormat::Jpeg, &mut picture, numbers, None)
        .unwrap();
}

fn location(uuid: &str, x: f64) -> ScanLocation {
    ScanLocation { uuid: uuid.to_owned(), pose: Pose::level(dvec3(x, 2.0, 1.5), 0.0), line: 0 }
}

fn locations() -> Vec<ScanLocation> {
    vec![location(UUID, 1.0), location(&uuid_from_name("kitchen"), 5.0)]
}

fn open(path: &Path) -> E57Pictures {
    E57Pictures::open(path, &DAffine3::IDENTITY).unwrap()
}

fn project(shot: &E57Shot, point: DVec3) -> DVec2 {
    let v = shot.pose.opencv_from_world() * (point - shot.pose.location);
    match &shot.lens {
        CaptureLens::Straight(lens) => lens.project(v).unwrap(),
        CaptureLens::Spherical(lens) => lens.project(v),
    }
}

/// Points of the world around the image, from its own frame.
fn points() -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..200).map(|k| {
        let k = f64::from(k);
        let own = dvec3(libm::sin(1.7 * k), libm::cos(2.3 * k), libm::sin(3.1 * k + 1.0)) * (1.0 + k / 50.0);
        (own, PLACE + turn() * own)
    })
}

#[test]
fn pinholes_project_as_the_standard_says() {
    let mut maker = Maker::new();
    maker.image("a", |image| {
        image.set_transform(transform(PLACE, turn()));
        add_pinhole(image);
    });
    let (_dir, path) = maker.close();
    let shots = open(&path).read(&[0]).unwrap();
    assert_eq!(shots[0].image.at(3, 2), [15, 14, 90]);

    // 8.4.13.5: z < 0, x − (x / z) f / w, y + (y / z) f / h, from the top left corner.
    let n = pinhole_numbers();
    let mut count = 0;
    for (own, world) in points().filter(|p| p.0.z < -0.3 * p.0.length()) {
        let x = n.principal_x - own.x / own.z * n.focal_length / n.pixel_width;
        let y = n.principal_y + own.y / own.z * n.focal_length / n.pixel_height;
        assert!(project(&shots[0], world).abs_diff_eq(dvec2(x, y), 1e-6), "{own}");
        count += 1;
    }
    assert!(count > 50);
}

#[test]
fn spheres_project_as_the_standard_says() {
    let mut maker = Maker::new();
    // All around, and a part of a turn.
    for (name, numbers) in
        [("a", spherical_numbers(64, 32, TAU / 64.0)), ("b", spherical_numbers(50, 20, 0.05))]
    {
        maker.image(name, |image| {
            image.set_transform(transform(PLACE, turn()));
            add_sphere(image, numbers);
        });
    }
    let (_dir, path) = maker.close();
    let shots = open(&path).read(&[0, 1]).unwrap();

    // 8.4.14.5: width / 2 − azimuth / w, height / 2 − elevation / h.
    for (shot, w, h, pixel) in [(&shots[0], 64.0, 32.0, TAU / 64.0), (&shots[1], 50.0, 20.0, 0.05)] {
        for (own, world) in points() {
            let azimuth = libm::atan2(own.y, own.x);
            let elevation = libm::asin(own.z / own.length());
            let expected = dvec2(w / 2.0 - azimuth / pixel, h / 2.0 - elevation / pixel);
            assert!(project(shot, world).abs_diff_eq(expected, 1e-6), "{own}");
        }
    }
}

#[test]
fn the_frame_of_the_file_is_moved_with_the_picture() {
    let mut maker = Maker::new();
    maker.image("a", |image| {
        image.set_transform(transform(PLACE, turn()));
        add_pinhole(image);
    });
    let (_dir, path) = maker.close();
    let world_from_file =
        DAffine3::from_mat3_translation(DMat3::from_rotation_x(0.5 * PI), dvec3(10.0, 0.0, 3.0));
    let mut pictures = E57Pictures::open(&path, &world_from_file).unwrap();
    pictures.move_all(&DAffine3::from_translation(dvec3(0.0, -1.0, 0.0)));
    let moved = pictures.read(&[0]).unwrap();
    let still = open(&path).read(&[0]).unwrap();
    let point = PLACE + turn() * dvec3(0.2, -0.3, -2.0);
    let moved_point = world_from_file.transform_point3(point) - dvec3(0.0, 1.0, 0.0);
    assert!(project(&moved[0], moved_point).abs_diff_eq(project(&still[0], point), 1e-9));
}

/// Corrects the name of a cylinder's radius, which the writer misspells, and the checksums of the pages.
fn correct_radius(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    for page in bytes.chunks_mut(1024) {
        for (from, to) in [(b"<readius ", b"<radius  "), (b"/readius>", b"/radius >")] {
            while let Some(at) = page.windows(9).position(|w| w == from) {
                page[at..at + 9].copy_from_slice(to);
            }
        }
        let checksum = crc32c(&page[..1020]);
        page[1020..].copy_from_slice(&checksum.to_be_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

/// CRC-32C, bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 == 1 { 0x82F6_3B78 } else { 0 };
        }
    }
    !crc
}

#[test]
fn each_location_takes_its_own_images_in_their_order() {
    let mut maker = Maker::new();
    let far = transform(dvec3(50.0, 0.0, 0.0), DQuat::IDENTITY);
    let near_kitchen = transform(dvec3(5.2, 2.3, 1.5), DQuat::IDENTITY);
    let mut add = |name: &str, guid: Option<&str>, pose: &Transform| {
        maker.image(name, |image| {
            image.set_transform(pose.clone());
            if let Some(guid) = guid {
                image.set_pointcloud_guid(guid);
            }
            add_pinhole(image);
        });
    };
    // A guid counts before the place, and its case and braces do not matter.
    add("of hall", Some("5c2959c3-0bdf-4c8e-9d11-aabbccddeeff"), &far);
    add("beside the kitchen", None, &near_kitchen);
    add("of the kitchen", Some("second"), &near_kitchen);
    add("of no scan", Some("gone"), &near_kitchen);
    add("lost", None, &far);
    maker.image("preview", |image| {
        let numbers = VisualReferenceImageProperties { width: 40, height: 30 };
        image
            .add_visual_reference(ImageFormat::Png, &mut picture(40, 30, Format::Png), numbers, None)
            .unwrap();
    });
    maker.image("around", |image| {
        let numbers = e57::CylindricalImageProperties {
            width: 40,
            height: 30,
            radius: 1.0,
            principal_y: 15.0,
            pixel_width: 0.1,
            pixel_height: 0.1,
        };
        image.set_transform(transform(PLACE, turn()));
        image
            .add_cylindrical(ImageFormat::Png, &mut picture(40, 30, Format::Png), numbers, None)
            .unwrap();
    });
    maker.image("nowhere", add_pinhole);
    maker.image("not turned", |image| {
        let mut pose = transform(PLACE, turn());
        pose.rotation = Quaternion { w: 0.0, x: 0.0, y: 0.0, z: 0.0 };
        image.set_transform(pose);
        add_pinhole(image);
    });
    maker.image("far", |image| {
        image.set_transform(transform(dvec3(1e9, 0.0, 0.0), turn()));
        add_pinhole(image);
    });
    let (_dir, path) = maker.close();
    correct_radius(&path);

    let owners = open(&path).of_locations(&locations());
    assert_eq!(owners.pictures, [vec![0], vec![1, 2, 3]]);
    let told = owners.warnings.join("\n");
    for words in [
        "scan.e57: image 4 `lost` is not of a scan location, nor within 0.5 m of one, left out",
        "image 5 `preview` is a preview without a projection",
        "image 6 `around` is cylindrical",
        "image 7 `nowhere` has no pose",
        "image 8 `not turned` has a pose without a rotation",
        "image 9 `far` has a pose more than 10,000 km from the origin",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
}

#[test]
fn masks_are_where_they_are_not_zero() {
    let mut maker = Maker::new();
    // One and 255 both say that a pixel is valid.
    let mask = GrayImage::from_fn(40, 30, |x, _| image::Luma([[0, 1, 255][x as usize % 3]]));
    let sixteen = image::ImageBuffer::from_fn(40, 30, |x, _| image::Luma([u16::from(x > 9)]));
    for (name, mask) in [("a", DynamicImage::from(mask)), ("b", DynamicImage::from(sixteen))] {
        let mut bytes = Cursor::new(Vec::new());
        mask.write_to(&mut bytes, Format::Png).unwrap();
        bytes.set_position(0);
        maker.image(name, |image| {
            image.set_transform(transform(PLACE, turn()));
            let mut picture = picture(40, 30, Format::Png);
            image
                .add_pinhole(ImageFormat::Png, &mut picture, pinhole_numbers(), Some(&mut bytes))
                .unwrap();
        });
    }
    let (_dir, path) = maker.close();
    let pictures = open(&path);
    pictures.check(&[0, 1]).unwrap();
    let shots = pictures.read(&[1, 0]).unwrap();
    let [sixteen, eight] = [0, 1].map(|k| shots[k].mask.clone().unwrap());
    assert_eq!([9, 10].map(|x| sixteen.at(x, 7)), [0, 255]);
    assert_eq!([0, 1, 2, 3].map(|x| eight.at(x, 7)), [0, 255, 255, 0]);
}

/// Writes a file with one image, and returns the message of its fault.
fn fault(fill: impl FnOnce(&mut ImageWriter<'_, File>)) -> String {
    let mut maker = Maker::new();
    maker.image("a", |image| {
        image.set_transform(transform(PLACE, turn()));
        fill(image);
    });
    let (_dir, path) = maker.close();
    let pictures = open(&path);
    let checked = pictures.check(&[0]).unwrap_err().to_string();
    let read = pictures.read(&[0]).unwrap_err().to_string();
    assert_eq!(checked, read);
    assert!(
        checked.contains("scan.e57: image 0 `a`: ") && checked.contains("export the file again"),
        "{checked}"
    );
    checked
}

#[test]
fn images_that_cannot_be_used_are_named() {
    let of = |numbers: PinholeImageProperties, mut bytes: Cursor<Vec<u8>>| {
        fault(|image| image.add_pinhole(ImageFormat::Jpeg, &mut bytes, numbers, None).unwrap())
    };
    let jpeg = || picture(40, 30, Format::Jpeg);
    let cut = Cursor::new(jpeg().into_inner()[..400].to_vec());
    let message = of(pinhole_numbers(), cut);
    assert!(message.contains("decoded") || message.contains("rows are there"), "{message}");
    let message = of(pinhole_numbers(), Cursor::new(b"no picture".to_vec()));
    assert!(message.contains("is no image"), "{message}");
    let message = of(pinhole_numbers(), picture(41, 30, Format::Jpeg));
    assert!(message.contains("has 41 × 30 pixels, and its projection is for 40 × 30"), "{message}");
    let message = of(PinholeImageProperties { focal_length: 0.0, ..pinhole_numbers() }, jpeg());
    assert!(message.contains("focalLength 0"), "{message}");
    let message = of(PinholeImageProperties { focal_length: 20.0, ..pinhole_numbers() }, jpeg());
    assert!(message.contains("an angle of view of 0."), "{message}");

    let message = fault(|image| add_sphere(image, spherical_numbers(64, 34, TAU / 64.0)));
    assert!(message.contains("no sphere has 64 × 34 pixels"), "{message}");
    let message = fault(|image| {
        let mut mask = picture(40, 31, Format::Png);
        image
            .add_pinhole(ImageFormat::Jpeg, &mut jpeg(), pinhole_numbers(), Some(&mut mask))
            .unwrap();
    });
    assert!(message.contains("its mask has 40 × 31 pixels"), "{message}");
}

#[test]
fn a_sphere_of_tiny_pixels_is_whole() {
    let mut maker = Maker::new();
    maker.image("a", |image| {
        image.set_transform(transform(PLACE, turn()));
        add_sphere(image, spherical_numbers(64, 32, 5e-6));
    });
    let (_dir, path) = maker.close();
    let shots = open(&path).read(&[0]).unwrap();
    assert!(matches!(&shots[0].lens, CaptureLens::Spherical(lens) if lens.is_whole()));
}

/// Every page has a checksum, so a changed byte of an image is told. A file that is cut is refused.
#[test]
fn damaged_files_are_errors() {
    let mut maker = Maker::new();
    maker.image("a", |image| {
        image.set_transform(transform(PLACE, turn()));
        add_sphere(image, spherical_numbers(400, 200, TAU / 400.0));
    });
    let (_dir, path) = maker.close();
    let whole = std::fs::read(&path).unwrap();
    let at = whole.windows(3).position(|w| w == b"\xff\xd8\xff").unwrap() + 2000;
    let mut bytes = whole.clone();
    bytes[at] ^= 0xff;
    std::fs::write(&path, &bytes).unwrap();
    let message = open(&path).check(&[0]).unwrap_err().to_string();
    assert!(message.contains("image 0 `a`: cannot be read"), "{message}");

    for bytes in [&whole[..1024], &whole[..1500], b"ASTM-E57 and no more", b""] {
        std::fs::write(&path, bytes).unwrap();
        assert!(E57Pictures::open(&path, &DAffine3::IDENTITY).is_err());
    }
    assert!(matches!(
        E57Pictures::open(&path.with_file_name("gone.e57"), &DAffine3::IDENTITY),
        Err(Error::Io { .. })
    ));
    let folder = path.parent().unwrap();
    let message = E57Pictures::open(folder, &DAffine3::IDENTITY).unwrap_err().to_string();
    assert!(message.contains("is a folder, not a file"), "{message}");

    let (_dir, path) = Maker::new().close();
    let message = E57Pictures::open(&path, &DAffine3::IDENTITY).unwrap_err().to_string();
    assert!(
        message.contains("has no image with a pose") && message.contains("rgb = \"texture\""),
        "{message}"
    );
}
