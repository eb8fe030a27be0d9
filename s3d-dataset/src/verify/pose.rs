//! Checks pose files against themselves, their names, and the draws of their views.

use super::report::{OfFile, Report, Topic};
use glam::{DMat3, DVec3};
use s3d_geom::{Camera, Pose, euler_from_rotation, rotation_from_euler};
use s3d_io::dataset::{DatasetImage, Domain, Frame, Layout, PoseFile, ViewRecord};
use s3d_io::fs::read_json;
use serde_json::Value;
use std::path::Path;

/// The largest difference between equal rotations. Euler angles lose the last bits of a rotation, and half of
/// the bits where two axes nearly coincide.
const ROTATION: f64 = 1e-7;

const FAULT: (Topic, &str) = (Topic::Poses, "contradictions in a pose file");

/// Reads an image's pose and checks it against itself and the image's name. `size` is the size of the image's
/// files. A photograph has its own focal lengths and principal point; for other views they follow from the
/// angle of view.
///
/// The pose in the result is `camera_rt_matrix`, exact to the bit. If the file contradicts itself,
/// `is_consistent` is false and the pose comes from the angles.
pub(crate) fn read_and_check(
    layout: &Layout,
    image: &DatasetImage,
    size: (u32, u32),
    is_photograph: bool,
    report: &Report,
) -> Option<CheckedPose> {
    let path = image.path(layout, Domain::Pose);
    let raw: Value = report.read(Topic::Poses, &path, read_json)?;
    let file: PoseFile = match serde_json::from_value(raw.clone()) {
        Ok(file) => file,
        Err(e) => {
            report.fault(FAULT.0, FAULT.1, &path, e.to_string());
            return None;
        }
    };

    let checks = report.of(FAULT, &path);
    names(&file, image, &checks);
    misspelt_key(&raw, &checks);
    let exact = matrix(&file, &checks);
    angles(&file, &checks);

    let pose = exact.unwrap_or_else(|| file.pose());
    let camera = if is_photograph && image.frame != Frame::Panorama {
        photographs_camera(&file, pose, size, &checks)?
    } else {
        camera(&file, pose, image.frame, size, &checks)?
    };
    Some(CheckedPose { is_consistent: checks.all_hold(), file, camera })
}

/// A pose file that was read.
pub(crate) struct CheckedPose {
    pub(crate) file: PoseFile,
    pub(crate) camera: Camera,
    /// Whether the file has no contradictions.
    pub(crate) is_consistent: bool,
}

/// Compares the world's frame in the pose with the manifest.
pub(crate) fn check_frame(pose: &CheckedPose, offset_m: Option<[f64; 3]>, path: &Path, report: &Report) {
    let told = pose.file.world_offset_m;
    report.check(told == offset_m, FAULT, path, || {
        format!("world_offset_m is {told:?}, and the manifest tells of {offset_m:?}")
    });
}

/// Checks the identifiers in the file against its name.
fn names(file: &PoseFile, image: &DatasetImage, checks: &OfFile<'_>) {
    for (key, value) in [("camera_uuid", &file.camera_uuid), ("point_uuid", &file.point_uuid)] {
        checks.check(*value == image.uuid, || {
            format!("{key} is {value:?}, and the file's name says {:?}", image.uuid)
        });
    }
    let room = format!("{}_{}", image.room, image.area);
    checks.check(file.room == room, || {
        format!("room is {:?}, and the file's name and area say {room:?}", file.room)
    });
    checks.check(file.frame_num == image.frame, || {
        format!("frame_num is {}, and the file's name says {}", file.frame_num, image.frame)
    });
}

/// Checks that both spellings of the final rotation hold the same. Reading a pose takes only one of them.
fn misspelt_key(raw: &Value, checks: &OfFile<'_>) {
    let a = &raw["final_camera_rotation"];
    let b = &raw["camera_rotation_final"];
    let same = a.is_null() || b.is_null() || a == b;
    checks.check(same, || format!("final_camera_rotation is {a}, camera_rotation_final {b}"));
}

/// The rotation part of `camera_rt_matrix`, and its last column.
fn parts_of_matrix(file: &PoseFile) -> (DMat3, DVec3) {
    let rows = file.camera_rt_matrix;
    let [x, y, z] = [0, 1, 2].map(|i| DVec3::new(rows[i][0], rows[i][1], rows[i][2]));
    let rotation = DMat3::from_cols(x, y, z).transpose();
    (rotation, DVec3::new(rows[0][3], rows[1][3], rows[2][3]))
}

fn close(a: DMat3, b: DMat3) -> bool {
    a.abs_diff_eq(b, ROTATION)
}

/// Checks `camera_rt_matrix` against angles and location. Returns the exact pose if it holds.
fn matrix(file: &PoseFile, checks: &OfFile<'_>) -> Option<Pose> {
    let (rotation, translation) = parts_of_matrix(file);
    let location = DVec3::from_array(file.camera_location);
    let expected = file.pose().opencv_from_world();

    let orthonormal = close(rotation * rotation.transpose(), DMat3::IDENTITY)
        && (rotation.determinant() - 1.0).abs() <= ROTATION;
    let mut holds = checks.check(orthonormal, || {
        "camera_rt_matrix is no rotation: its rows are not at right angles, of length 1 and right-handed"
            .to_owned()
    });
    if orthonormal {
        holds &= checks.check(close(rotation, expected), || {
            format!(
                "the rotation of camera_rt_matrix is not that of final_camera_rotation{}",
                looks_like(rotation, expected)
            )
        });
    }

    let tolerance = 1e-9 * (1.0 + location.abs().max_element());
    let fits = |r: DMat3| (translation + r * location).abs().max_element() <= tolerance;
    holds &= checks.check(fits(rotation), || {
        let why = if (translation - location).abs().max_element() <= tolerance {
            ": it is camera_location itself, as of a matrix camera → world"
        } else if fits(expected) {
            ", but it is with that of the angles"
        } else if fits(rotation.transpose()) {
            ", but it is with the rotation transposed"
        } else {
            ""
        };
        format!("the last column of camera_rt_matrix is not −R · camera_location{why}")
    });

    holds.then(|| file.exact_pose())
}

/// Names the usual mistake that turns the expected rotation into this one.
fn looks_like(rotation: DMat3, expected: DMat3) -> &'static str {
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let guesses = [
        (expected.transpose(), ": it is transposed"),
        (flip * expected, ": it is in Blender's axes (y up, looking along −z) instead of OpenCV's"),
        ((flip * expected).transpose(), ": it is camera → world in Blender's axes"),
    ];
    guesses
        .into_iter()
        .find(|(guess, _)| close(rotation, *guess))
        .map_or("", |(_, words)| words)
}

/// Checks that the three rotations in the file fit together.
fn angles(file: &PoseFile, checks: &OfFile<'_>) {
    let [between, original, last] =
        [file.rotation_from_original_to_point, file.camera_original_rotation, file.final_camera_rotation]
            .map(|angles| rotation_from_euler(DVec3::from_array(angles)));
    checks.check(close(between * original, last), || {
        let why = if close(original * between, last) {
            ": the product is in the other order"
        } else {
            ""
        };
        format!(
            "final_camera_rotation is not rotation_from_original_to_point after camera_original_rotation{why}"
        )
    });
}

/// Reads the camera of a photograph's view, and checks that its angle of view matches K.
fn photographs_camera(
    file: &PoseFile,
    pose: Pose,
    (width, height): (u32, u32),
    checks: &OfFile<'_>,
) -> Option<Camera> {
    let rt = pose.rt_matrix();
    let camera = Camera::from_k_rt(file.camera_k_matrix, rt, width, height).map(|c| Camera { pose, ..c });
    let told = camera.as_ref().err().map(ToString::to_string);
    checks.check(told.is_none(), || format!("no camera: {}", told.unwrap_or_default()));
    let camera = camera.ok()?;
    let fov = file.field_of_view_rads;
    checks.check((camera.fov_rad() - fov).abs() <= 1e-12, || {
        format!("field_of_view_rads is {fov}; camera_k_matrix and the width make it {}", camera.fov_rad())
    });
    Some(camera)
}

/// Reads the camera of a view or a panorama, and checks that K matches its angle of view.
fn camera(
    file: &PoseFile,
    pose: Pose,
    frame: Frame,
    (width, height): (u32, u32),
    checks: &OfFile<'_>,
) -> Option<Camera> {
    let fov = file.field_of_view_rads;
    let finite = pose.location.is_finite() && pose.world_from_camera.is_finite();
    let usable = finite && fov > 0.0 && fov < std::f64::consts::PI;
    if !checks.check(usable, || format!("no camera: field_of_view_rads {fov}, location {}", pose.location)) {
        return None;
    }

    let camera = match frame {
        Frame::View(_) => Camera::perspective(pose, fov, width, height),
        Frame::Panorama => Camera::equirectangular(pose, width),
    };

    checks.check((camera.fov_rad() - fov).abs() <= 1e-12, || {
        format!("field_of_view_rads is {fov}; a panorama's is π/2")
    });

    let k = file.camera_k_matrix;
    let expected = camera.k_matrix();
    let same = |k: [[f64; 3]; 3]| {
        let pairs = k.as_flattened().iter().zip(expected.as_flattened());
        pairs.fold(true, |same, (a, b)| same && (a - b).abs() <= 1e-9 * (1.0 + b.abs()))
    };

    checks.check(same(k), || {
        let transposed = std::array::from_fn(|i| std::array::from_fn(|j| k[j][i]));
        if same(transposed) {
            return "camera_k_matrix is transposed".to_owned();
        }
        let [[fx, _, cx], [_, fy, cy], _] = k;
        let [[f, _, x], [.., y], _] = expected;
        format!(
            "camera_k_matrix has the focal lengths {fx} and {fy} px and the centre ({cx}, {cy}); field of \
             view and size make that {f} px and ({x}, {y})"
        )
    });

    Some(camera)
}

/// Checks the pose of a view against its draw, and the pose of a panorama against the scanner's.
pub(crate) fn check_draw(pose: &CheckedPose, draw: Option<&ViewRecord>, path: &Path, report: &Report) {
    let checks = report.of(FAULT, path);
    let file = &pose.file;
    let original = file.original();
    let (yaw, pitch) = draw.map_or((0.0, 0.0), |d| (d.yaw_rad, d.pitch_rad));
    let expected = original.turned(yaw, pitch).world_from_camera;
    let found = file.pose().world_from_camera;

    let what = if draw.is_some() {
        "as views.json drew it"
    } else {
        "the scanner's own, as a panorama's is"
    };

    checks.check(close(expected, found), || {
        let transposed = if close(expected.transpose(), found) {
            ": it is transposed"
        } else {
            ""
        };
        let angles = euler_from_rotation(expected).to_array();
        format!(
            "final_camera_rotation {:?} is not {what} ({angles:?}){transposed}",
            file.final_camera_rotation
        )
    });

    if let Some(draw) = draw {
        let fov = file.field_of_view_rads;
        checks.check(fov == draw.fov_rad, || {
            format!("field_of_view_rads is {fov}, and views.json drew {}", draw.fov_rad)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_io::fs::create_dir;

    const UUID: &str = "00112233445566778899aabbccddeeff";

    /// The report on a pose file after `change`, and whether its pose is consistent.
    fn report_after(change: impl FnOnce(&mut PoseFile)) -> (String, bool) {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        let original = Pose::level(DVec3::new(1.0, -2.0, 1.5), 0.7);
        let camera = Camera::perspective(original.turned(0.4, -0.3), 1.1, 64, 64);
        let image = DatasetImage {
            area: 2,
            uuid: UUID.to_owned(),
            room: "WC_1".to_owned(),
            frame: Frame::View(3),
            domains: vec![Domain::Pose],
        };

        let mut file = PoseFile::new(&camera, &original, UUID, "WC_1_2", image.frame);
        change(&mut file);
        create_dir(&layout.image_dir(2, image.frame, Domain::Pose)).unwrap();
        file.write(&image.path(&layout, Domain::Pose)).unwrap();

        let report = Report::new(&layout);
        let pose = read_and_check(&layout, &image, (64, 64), false, &report).unwrap();
        if pose.is_consistent {
            // Equal images need an equal camera.
            assert_eq!(pose.camera, camera);
        }
        (report.finish().to_string(), pose.is_consistent)
    }

    #[test]
    fn a_good_file_gives_its_camera_to_the_bit() {
        let (text, consistent) = report_after(|_| ());
        assert!(consistent && text.ends_with(" 0 faults\n"), "{text}");
    }

    #[test]
    fn what_is_wrong_with_a_matrix_is_called_by_its_name() {
        fn rows(file: &mut PoseFile, change: impl Fn(DMat3, DVec3) -> (DMat3, DVec3)) {
            let (r, t) = parts_of_matrix(file);
            let (r, t) = change(r, t);
            let r = r.transpose();
            for (row, (of, t)) in file
                .camera_rt_matrix
                .iter_mut()
                .zip([r.x_axis, r.y_axis, r.z_axis].iter().zip(t.to_array()))
            {
                *row = [of.x, of.y, of.z, t];
            }
        }

        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let location = DVec3::new(1.0, -2.0, 1.5);
        type Change<'c> = &'c dyn Fn(&mut PoseFile);

        let cases: [(&str, Change<'_>); 9] = [
            ("final_camera_rotation: it is transposed", &|f| rows(f, |r, t| (r.transpose(), t))),
            ("not −R · camera_location, but it is with that of the angles", &|f| {
                rows(f, |r, t| (r.transpose(), t))
            }),
            ("as of a matrix camera → world", &|f| rows(f, |r, _| (r.transpose(), location))),
            ("in Blender's axes (y up", &|f| rows(f, |r, t| (flip * r, flip * t))),
            ("is no rotation", &|f| rows(f, |r, t| (r * 1.01, t))),
            ("the product is in the other order", &|f| {
                let [original, last] = [f.camera_original_rotation, f.final_camera_rotation]
                    .map(|angles| rotation_from_euler(DVec3::from_array(angles)));
                let between = original.transpose() * last;
                f.rotation_from_original_to_point = euler_from_rotation(between).to_array();
            }),
            ("room is \"WC_1_3\"", &|f| f.room = "WC_1_3".into()),
            ("frame_num is 4, and the file's name says 3", &|f| f.frame_num = Frame::View(4)),
            ("the centre (31.5, 31.5)", &|f| {
                (f.camera_k_matrix[0][2], f.camera_k_matrix[1][2]) = (31.5, 31.5)
            }),
        ];

        for (words, change) in cases {
            let (text, consistent) = report_after(|f| change(f));
            assert!(text.contains(words) && !consistent, "{words}: {text}");
        }
    }
}
