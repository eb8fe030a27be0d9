//! Laser scans of every kind, right and wrong, in files that the tests write.

use crate::cloud::OnFault;
use crate::raw::{LaserScans, RawForm, RawOptions, RawScan, ReadScan, ScanBlock};
use crate::{Error, Result};
use s3d_geom::glam::{DAffine3, DVec3, dvec3};
use std::fs;
use std::path::{Path, PathBuf};

fn open(path: &Path, options: &RawOptions) -> Result<LaserScans> {
    match RawScan::open(path, options)? {
        RawScan::Scans(scans) => Ok(scans),
        RawScan::Pictures(_) => panic!("pictures"),
    }
}

fn refused(path: &Path, options: &RawOptions) -> String {
    open(path, options).unwrap_err().to_string()
}

/// Reads all points of a scan.
fn all(scans: &LaserScans, number: usize) -> Result<(ScanBlock, ReadScan)> {
    let mut all = ScanBlock::default();
    let read = scans.read(number, |block| {
        all.positions_m.extend(&block.positions_m);
        all.colors.extend(&block.colors);
        all.intensities.extend(&block.intensities);
        all.cells.extend(&block.cells);
        all.times_s.extend(&block.times_s);
        all.origins_m.extend(&block.origins_m);
        Ok::<(), Error>(())
    })?;
    assert_eq!(read.points, all.len() as u64);
    Ok((all, read))
}

/// Returns the points, rounded: turns are products of rounded numbers.
fn places(block: &ScanBlock) -> Vec<[f64; 3]> {
    let round = |v: f64| (v * 1e6).round() / 1e6 + 0.0;
    block.positions_m.iter().map(|p| p.to_array().map(round)).collect()
}

fn at(x: f64, y: f64, z: f64) -> RawOptions {
    RawOptions { origin_m: Some(dvec3(x, y, z)), ..RawOptions::default() }
}

#[cfg(feature = "e57")]
mod of_e57 {
    use super::*;
    use e57::{
        E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
    };

    const XYZ: [Record; 3] = [Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];

    fn record(name: RecordName, min: i64, max: i64) -> Record {
        Record { name, data_type: RecordDataType::Integer { min, max } }
    }

    /// A scanner at (1, 2, 3), turned by 90° about z.
    fn pose() -> Transform {
        let half = 0.5f64.sqrt();
        Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 1.0, y: 2.0, z: 3.0 },
        }
    }

    /// The records, the pose and the points of a scan.
    type WrittenScan = (Vec<Record>, Option<Transform>, Vec<Vec<RecordValue>>);

    fn write(path: &Path, scans: &[WrittenScan]) {
        let mut writer = E57Writer::from_file(path, "file").unwrap();
        for (number, (prototype, pose, points)) in scans.iter().enumerate() {
            let mut scan = writer
                .add_pointcloud(&format!("guid {number}"), prototype.clone())
                .unwrap();
            scan.set_name(Some(format!("hall {number}")));
            scan.set_transform(pose.clone());
            points.iter().for_each(|point| scan.add_point(point.clone()).unwrap());
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
    }

    /// A grid of 2 rows and 3 columns, with two rays without a return and a point that is marked as invalid.
    fn grid() -> (Vec<Record>, Vec<Vec<RecordValue>>) {
        let mut prototype = XYZ.to_vec();
        prototype.extend([
            record(RecordName::CartesianInvalidState, 0, 2),
            record(RecordName::RowIndex, 0, 9),
            record(RecordName::ColumnIndex, 0, 9),
            Record { name: RecordName::Intensity, data_type: RecordDataType::UNIT_F32 },
            record(RecordName::ColorRed, 0, 255),
            record(RecordName::ColorGreen, 0, 255),
            record(RecordName::ColorBlue, 0, 255),
        ]);
        let point = |x: f64, invalid: i64, row: i64, column: i64| {
            let mut values: Vec<RecordValue> =
                [x, 0.0, 0.0].iter().map(|v| RecordValue::Double(*v)).collect();
            values.extend([invalid, row, column].map(RecordValue::Integer));
            values.push(RecordValue::Single(0.25));
            values.extend([10 * row + column, 200, 100].map(RecordValue::Integer));
            values
        };
        let points = vec![
            point(2.0, 0, 0, 0),
            point(0.0, 0, 0, 1),
            point(0.0, 0, 0, 2),
            point(3.0, 1, 1, 0),
            point(4.0, 0, 1, 1),
            point(5.0, 0, 1, 2),
            // Twice in a cell: the nearer one counts.
            point(9.0, 0, 1, 2),
        ];
        (prototype, points)
    }

    #[test]
    fn a_scan_has_its_pose_its_grid_and_what_was_measured() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("hall.e57");
        let (prototype, points) = grid();
        write(&path, &[(prototype, Some(pose()), points)]);
        assert_eq!(RawScan::form_of(&path).unwrap(), Some(RawForm::E57));
        let scans = open(&path, &RawOptions::default()).unwrap();
        scans.require_origins().unwrap();
        let info = &scans.scans()[0];
        assert_eq!((info.name.as_str(), info.grid, info.points), ("hall 0", Some([2, 3]), Some(7)));
        assert_eq!([info.has_colors, info.has_intensity, info.has_times], [true, true, false]);
        assert_eq!(info.origin_m, Some(dvec3(1.0, 2.0, 3.0)));
        assert!(info.pose.unwrap().forward().abs_diff_eq(DVec3::NEG_X, 1e-9));

        let (block, read) = all(&scans, 0).unwrap();
        assert_eq!(places(&block), [2.0, 4.0, 5.0, 9.0].map(|x| [1.0, 2.0 + x, 3.0]));
        assert_eq!(block.cells, [[0, 0], [1, 1], [1, 2], [1, 2]]);
        assert_eq!(block.colors, [[0, 200, 100], [11, 200, 100], [12, 200, 100], [12, 200, 100]]);
        assert_eq!(block.intensities, [0.25; 4]);
        let warnings = read.warnings.join("\n");
        assert!(warnings.contains("1 of 7 points are marked invalid"), "{warnings}");
        assert!(warnings.contains("2 of 7 points are at the scanner itself"), "{warnings}");

        let grid = scans.read_grid(0).unwrap().unwrap();
        assert_eq!((grid.offsets_m.width(), grid.offsets_m.height()), (3, 2));
        assert!(grid.offsets_m.at(2, 1).abs_diff_eq([0.0, 5.0, 0.0].into(), 1e-6));
        assert!(grid.offsets_m.at(0, 1).is_nan() && grid.offsets_m.at(1, 0).is_nan());
        assert_eq!(grid.colors.unwrap().at(1, 1), [11, 200, 100]);
        assert_eq!(grid.intensities.unwrap().at(0, 0), 0.25);
    }

    #[test]
    fn ranges_and_angles_are_measured_from_the_scanner() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("hall.e57");
        let names =
            [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation];
        let prototype = names
            .map(|name| Record { name, data_type: RecordDataType::F64 })
            .to_vec();
        let points = vec![
            [2.0, 0.0, std::f64::consts::FRAC_PI_2]
                .map(RecordValue::Double)
                .to_vec(),
        ];
        write(&path, &[(prototype, None, points)]);
        let scans = open(&path, &RawOptions::default()).unwrap();
        assert_eq!(scans.scans()[0].origin_m, Some(DVec3::ZERO));
        assert_eq!(places(&all(&scans, 0).unwrap().0), [[0.0, 0.0, 2.0]]);
        assert_eq!(scans.read_grid(0).unwrap(), None);
    }

    #[test]
    fn scans_without_a_place_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("hall.e57");
        let points = vec![[2.0, 0.0, 0.0].map(RecordValue::Double).to_vec()];
        let scan = |pose| (XYZ.to_vec(), pose, points.clone());
        write(&path, &[scan(None), scan(Some(pose())), scan(None)]);
        let scans = open(&path, &RawOptions::default()).unwrap();
        assert!(scans.warnings[0].contains("2 of 3 scans have no pose"), "{:?}", scans.warnings);
        let message = scans.require_origins().unwrap_err().to_string();
        assert!(message.contains("is one of 2 scans that do not tell where the scanner stood"), "{message}");
        assert_eq!(places(&all(&scans, 1).unwrap().0), [[1.0, 4.0, 3.0]]);
        open(&path, &at(0.0, 0.0, 1.0)).unwrap().require_origins().unwrap();

        write(&path, &[scan(Some(pose())), scan(Some(pose()))]);
        let scans = open(&path, &RawOptions::default()).unwrap();
        assert!(scans.warnings[0].contains("all 2 scans are told to be taken at one place"));
        let gone = all(&scans, 2).unwrap_err().to_string();
        assert!(gone.contains("there is no scan 2: there are 2"), "{gone}");
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(RawScan::open(&path, &RawOptions::default()).is_err());
    }
}

/// A scan of 2 rows and 2 columns. The matrix shifts it by (10, 20, 1).
const PTX: &str = "2\n2\n10 20 1\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 1 1\n\
                   1 0 0 0.5 9 8 7\n0 0 0 0.5 0 0 0\n0 2 0 0.25 6 5 4\n0 3 0 0.125 3 2 1\n";

#[test]
fn scans_of_a_ptx_file_are_read_one_by_one() {
    let dir = tempfile::tempdir().unwrap();
    // The content tells the form.
    let path = dir.path().join("hall.txt");
    let second = "1\n1\n5 6 7\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5 6 9 0.5 1 1 1\n";
    fs::write(&path, format!("{PTX}{second}")).unwrap();
    assert_eq!(RawScan::form_of(&path).unwrap(), Some(RawForm::Ptx));
    let scans = open(&path, &RawOptions::default()).unwrap();
    let [first, last] = scans.scans() else { panic!() };
    assert_eq!((first.origin_m, first.grid), (Some(dvec3(10.0, 20.0, 1.0)), Some([2, 2])));
    // A matrix that moves nothing: the points are in the frame of the file.
    assert_eq!((last.origin_m, last.grid, last.points), (Some(dvec3(5.0, 6.0, 7.0)), None, Some(1)));
    assert!(first.has_colors && first.has_intensity);

    let (block, read) = all(&scans, 1).unwrap();
    assert_eq!((places(&block), read.warnings.len()), (vec![[5.0, 6.0, 9.0]], 0));
    let (block, read) = all(&scans, 0).unwrap();
    assert_eq!(places(&block), [[11.0, 20.0, 1.0], [10.0, 22.0, 1.0], [10.0, 23.0, 1.0]]);
    assert_eq!(block.cells, [[0, 0], [0, 1], [1, 1]]);
    assert_eq!((block.colors[1], block.intensities[2]), ([6, 5, 4], 0.125));
    assert!(read.warnings[0].contains("1 of 4 points are 0 0 0, rays without a return"));
    let grid = scans.read_grid(0).unwrap().unwrap();
    assert!(grid.offsets_m.at(0, 1).is_nan());
    assert_eq!(grid.offsets_m.at(1, 1).to_array(), [0.0, 3.0, 0.0]);
}

#[test]
fn faults_of_a_ptx_file_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.ptx");
    let of = |text: &str| {
        fs::write(&path, text).unwrap();
        refused(&path, &RawOptions::default())
    };
    assert!(of(&PTX[..PTX.len() - 20]).contains("ends after 3 of 4 points of a scan: it is cut short"));
    assert!(of("").contains("holds no scan with points"));
    assert!(of(&format!("\u{feff}{PTX}")).contains("begins with a byte order mark"));
    // The places of the header and of the matrix differ.
    fs::write(&path, PTX.replacen("10 20 1\n", "11 20 1\n", 1)).unwrap();
    let scans = open(&path, &RawOptions::default()).unwrap();
    assert!(scans.warnings[0].contains("scanner at [11, 20, 1], and its matrix at [10, 20, 1]"));
}

#[test]
fn points_without_a_grid_need_a_place() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.xyz");
    fs::write(&path, "0 0 1 7\n0 0 1.5 9\n1 0 1 8\n").unwrap();
    let scans = open(&path, &RawOptions::default()).unwrap();
    let message = scans.require_origins().unwrap_err().to_string();
    assert!(message.contains("hall.xyz: does not tell where the scanner stood: give its place"), "{message}");

    let scans = open(&path, &at(0.0, 0.0, 1.5)).unwrap();
    scans.require_origins().unwrap();
    let (block, read) = all(&scans, 0).unwrap();
    assert_eq!((places(&block), read.without_range), (vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]], 1));
    assert_eq!((block.intensities, block.colors), (vec![7.0, 8.0], vec![]));
    assert!(read.warnings[0].contains("1 points are at the scanner itself, left out"));

    // The transform moves points and places.
    let world_from_file = DAffine3::from_translation(dvec3(0.0, 0.0, 100.0));
    let scans = open(&path, &RawOptions { world_from_file, ..at(0.0, 0.0, 1.5) }).unwrap();
    assert_eq!(scans.scans()[0].origin_m, Some(dvec3(0.0, 0.0, 101.5)));
    assert_eq!(places(&all(&scans, 0).unwrap().0), [[0.0, 0.0, 101.0], [1.0, 0.0, 101.0]]);

    // The columns may be named.
    let columns = ["intensity", "x", "y", "z"].map(str::to_owned).to_vec();
    let scans = open(&path, &RawOptions { columns, ..RawOptions::default() }).unwrap();
    assert_eq!(places(&all(&scans, 0).unwrap().0)[2], [0.0, 1.0, 8.0]);
    fs::write(&path, "1 2 3 4 5\n").unwrap();
    let message = refused(&path, &RawOptions::default());
    assert!(
        message.contains("without names of columns: it has 5") && message.contains("intensity"),
        "{message}"
    );
}

#[test]
fn ranges_that_cannot_be_are_told_with_the_scale_that_fits() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.xyz");
    fs::write(&path, "2000 0 1000\n0 3000 1000\n0 2500 1000\n").unwrap();
    let message = refused(&path, &at(0.0, 0.0, 1500.0));
    assert!(message.contains("half of the first points are farther than 2549.5098 m"), "{message}");
    assert!(message.ends_with("With a scale of 0.001, it would be 2.55 m"), "{message}");
    fs::write(&path, "0.002 0 0\n0 0.003 0\n").unwrap();
    assert!(refused(&path, &at(0.0, 0.0, 0.0)).contains("are nearer than 0.0030 m"));
}

#[test]
fn faulty_lines_are_told_or_counted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.xyz");
    fs::write(&path, "1 0 1\nnan 0 1\n2 0 1\n").unwrap();
    assert!(refused(&path, &at(0.0, 0.0, 1.0)).contains("line 2: the coordinates NaN 0 1 are not finite"));
    let lenient = RawOptions { on_fault: OnFault::Skip, ..at(0.0, 0.0, 1.0) };
    let (block, read) = all(&open(&path, &lenient).unwrap(), 0).unwrap();
    assert_eq!((block.len(), read.faulty), (2, 1));
    assert!(read.warnings[0].contains("1 points are faulty, left out"));
    fs::write(&path, "1 0 1\n1 0\n").unwrap();
    assert!(refused(&path, &at(0.0, 0.0, 1.0)).contains("line 2: 2 columns where 3 are due"));
    assert_eq!(all(&open(&path, &lenient).unwrap(), 0).unwrap().1.faulty, 1);
}

#[test]
fn a_late_wide_colour_scales_all_colours() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.xyz");
    let mut text = "1 0 0 0 0 0\n".repeat(70_000);
    text += "2 0 0 65280 256 255\n";
    fs::write(&path, text).unwrap();
    let scans = open(&path, &at(0.0, 0.0, 0.0)).unwrap();
    for _ in 0..2 {
        let (block, _) = all(&scans, 0).unwrap();
        assert_eq!((block.len(), block.colors[70_000]), (70_001, [255, 1, 0]));
    }
    assert_eq!(scans.scans()[0].points, None);
}

#[test]
fn errors_of_the_caller_end_the_reading() {
    #[derive(Debug)]
    struct Stopped;
    impl From<Error> for Stopped {
        fn from(e: Error) -> Self {
            panic!("{e}")
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("hall.xyz");
    fs::write(&path, "1 0 1\n").unwrap();
    let scans = open(&path, &at(0.0, 0.0, 1.0)).unwrap();
    assert!(matches!(scans.read(0, |_| Err(Stopped)), Err(Stopped)));
}

#[test]
fn lists_and_folders_are_several_scans() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(dir.path().join(name), text).unwrap();
    write("b.ptx", PTX);
    write("a.pts", "2\n1 0 1 7 1 2 3\n2 0 1 7 1 2 3\n");
    write("notes.txt", "3 scans\n");
    let scans = open(dir.path(), &RawOptions::default()).unwrap();
    assert_eq!((scans.form, scans.scans().len()), (RawForm::ScanFolder, 2));
    assert!(
        scans
            .require_origins()
            .unwrap_err()
            .to_string()
            .contains("a.pts: does not tell")
    );
    assert_eq!(all(&scans, 0).unwrap().0.colors, [[1, 2, 3]; 2]);

    write("origins.csv", "file,x,y,z\na.pts,0,0,1.5\n");
    for path in [dir.path().to_owned(), dir.path().join("origins.csv")] {
        let scans = open(&path, &RawOptions::default()).unwrap();
        assert_eq!((scans.form, scans.scans().len()), (RawForm::OriginList, 1));
        assert_eq!(scans.scans()[0].origin_m, Some(dvec3(0.0, 0.0, 1.5)));
        assert_eq!(scans.files, [dir.path().join("origins.csv")]);
    }
}

#[cfg(feature = "ply")]
#[test]
fn a_mesh_is_no_raw_scan() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ply");
    let head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let points = "0 0 0\n1 0 0\n0 1 0\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    fs::write(&path, format!("{head}{face}{points}3 0 1 2\n")).unwrap();
    assert_eq!(RawScan::form_of(&path).unwrap(), None);
    assert!(refused(&path, &RawOptions::default()).contains("a.ply: is a mesh, not a raw scan"));
    fs::write(&path, format!("{head}end_header\n{points}")).unwrap();
    let scans = open(&path, &at(0.0, 0.0, 1.0)).unwrap();
    assert_eq!((scans.form, scans.scans()[0].points), (RawForm::Points, Some(3)));
    assert_eq!(all(&scans, 0).unwrap().0.len(), 3);

    fs::write(dir.path().join("b.bin"), b"\0\0").unwrap();
    assert!(refused(&dir.path().join("b.bin"), &RawOptions::default()).contains("is no raw scan"));
    assert!(matches!(RawScan::open(&dir.path().join("gone"), &RawOptions::default()), Err(Error::Io { .. })));
}

/// Writes a LAS file with points at x = 1, 2, 3…, of these times and 16-bit colours.
#[cfg(feature = "las")]
fn las(dir: &Path, times: &[f64]) -> PathBuf {
    let path = dir.join("walk.las");
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(7).unwrap();
    let mut writer = las::Writer::from_path(&path, builder.into_header().unwrap()).unwrap();
    for (x, time) in (1u16..).zip(times) {
        let point = las::Point {
            x: f64::from(x),
            intensity: x,
            gps_time: Some(*time),
            color: Some(las::Color { red: 65_280, green: 256, blue: 0 }),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    path
}

#[cfg(feature = "las")]
#[test]
fn points_of_a_mobile_scanner_have_places_of_their_own() {
    let dir = tempfile::tempdir().unwrap();
    let path = las(dir.path(), &[10.0, 10.5, 99.0]);
    let trajectory = dir.path().join("path.csv");
    fs::write(&trajectory, "t,x,y,z\n10,0,0,1\n11,2,0,1\n").unwrap();
    let options = RawOptions { trajectory: Some(trajectory.clone()), ..RawOptions::default() };
    let scans = open(&path, &options).unwrap();
    scans.require_origins().unwrap();
    let info = &scans.scans()[0];
    assert_eq!((info.points, info.has_times, info.origin_m), (Some(3), true, None));

    let (block, read) = all(&scans, 0).unwrap();
    assert_eq!((read.points, read.without_place), (2, 1));
    assert_eq!(block.origins_m, [dvec3(0.0, 0.0, 1.0), dvec3(1.0, 0.0, 1.0)]);
    assert_eq!((block.times_s, block.colors[0]), (vec![10.0, 10.5], [255, 1, 0]));
    assert_eq!((places_x(&block.positions_m), block.intensities), (vec![1.0, 2.0], vec![1.0, 2.0]));

    fs::write(&trajectory, "t,x,y,z\n500,0,0,1\n501,2,0,1\n").unwrap();
    let message = all(&open(&path, &options).unwrap(), 0).unwrap_err().to_string();
    assert!(message.contains("from 10 s to 99 s, and the trajectory goes from 500 s to 501 s"), "{message}");

    let text = dir.path().join("hall.xyz");
    fs::write(&text, "1 0 1\n").unwrap();
    assert!(refused(&text, &options).contains("hall.xyz: has no times"));
}

#[cfg(feature = "las")]
fn places_x(positions: &[DVec3]) -> Vec<f64> {
    positions.iter().map(|p| p.x).collect()
}
