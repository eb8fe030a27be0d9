//! A scan for a test to spoil. An export of it must end by itself, say why, and write into OUT alone.

use super::{s3d_fails, s3d_ok, text, write_scan};
use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The longest time that a refusal may take. On an idle machine it takes a fraction of a second.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);
pub(crate) const SMALL: [&str; 8] =
    ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "50"];
pub(crate) const ALL_CONDITIONS: &str = "colour,coverage,frame,inside-out,labels,locations,scale,size,up";

/// A small scan in a folder of its own.
pub(crate) struct Scan {
    pub(crate) dir: tempfile::TempDir,
    pub(crate) scene: PathBuf,
}

impl Scan {
    pub(crate) fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let scene = write_scan(&dir.path().join("scan"), 1);
        Self { dir, scene }
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join("scan").join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.file(name), content).unwrap();
    }

    pub(crate) fn out(&self) -> PathBuf {
        self.dir.path().join("out")
    }

    pub(crate) fn replace(&self, name: &str, from: &str, to: &str) {
        let content = fs::read_to_string(self.file(name)).unwrap();
        assert!(content.contains(from), "{name} holds {from:?}");
        self.write(name, content.replacen(from, to, 1));
    }

    /// Makes `name` the mesh, the annotations or the list of cameras. A cloud becomes the room `office_1`.
    pub(crate) fn use_mesh(&self, name: &str) {
        self.replace("scene.toml", "path = \"room.obj\"", &format!("path = \"{name}\""));
    }

    pub(crate) fn use_annotations(&self, name: &str) {
        self.replace("scene.toml", "path = \"Area_1\"", &format!("path = \"{name}\""));
    }

    pub(crate) fn use_cameras(&self, name: &str) {
        self.replace("scene.toml", "path = \"cameras.csv\"", &format!("path = \"{name}\""));
    }

    /// The export must fail with exit code 1 and these words. It must leave everything beside OUT as it was,
    /// and no OUT that looks complete.
    pub(crate) fn refused(&self, parts: &[&str]) {
        let before = listing(self.dir.path());
        let out = self.out();
        let mut args = vec!["export", text(&self.scene), "-o", text(&out)];
        args.extend(SMALL);
        let (code, log) = run(&args);
        assert_eq!(code, Some(1), "{parts:?}: {log}");
        for part in parts {
            assert!(log.contains(part), "{part:?} is not in the message: {log}");
        }
        let mut after = listing(self.dir.path());
        after.retain(|path, _| !path.starts_with(&out));
        assert_eq!(after, before, "a refused export left something beside OUT: {log}");
        // Points are read late, so OUT may exist by then; its manifest must say that the export is not
        // complete.
        let manifest = fs::read_to_string(out.join("manifest.json")).unwrap_or_default();
        assert!(!out.exists() || manifest.contains("\"running\""), "OUT looks complete: {manifest}");
    }

    /// The export must succeed, even if the data set is of little use. Returns its log.
    pub(crate) fn exported(&self) -> String {
        let out = self.out();
        let mut args = vec!["export", text(&self.scene), "-o", text(&out), "--allow", ALL_CONDITIONS];
        args.extend(SMALL);
        s3d_ok(&args)
    }

    pub(crate) fn annotation(&self, name: &str) -> PathBuf {
        self.file("Area_1/office_1/Annotations").join(name)
    }

    pub(crate) fn args<'a>(&'a self, out: &'a Path) -> Vec<&'a str> {
        let mut args = vec!["export", text(&self.scene), "-o", text(out)];
        args.extend(SMALL);
        args
    }

    /// The export must fail with exit code 1 and these words, and leave no OUT.
    pub(crate) fn fails(&self, parts: &[&str]) {
        let out = self.out();
        s3d_fails(&self.args(&out), 1, parts);
        assert!(!out.exists(), "a failed export of bad input wrote something");
    }

    /// The export must succeed and log each of these parts.
    pub(crate) fn warns(&self, parts: &[&str]) {
        let log = s3d_ok(&self.args(&self.out()));
        for part in parts {
            assert!(log.contains(part), "{part:?} is not in the log: {log}");
        }
    }
}

/// Runs `s3d`, which must end by itself, soon, and without a panic. Returns its exit code and its log.
pub(crate) fn run(args: &[&str]) -> (Option<i32>, String) {
    wait(Command::new(env!("CARGO_BIN_EXE_s3d")).args(args))
}

pub(crate) fn wait(command: &mut Command) -> (Option<i32>, String) {
    let mut log = tempfile::tempfile().unwrap();
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(log.try_clone().unwrap());
    let started = Instant::now();
    let mut child = loop {
        match command.spawn() {
            // The binary was just copied, and a process that another test started still had the copy open.
            Err(e) if e.kind() == ErrorKind::ExecutableFileBusy && started.elapsed() < LIMIT => {
                std::thread::sleep(Duration::from_millis(10));
            }
            child => break child.expect("the binary starts"),
        }
    };
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if started.elapsed() > LIMIT => {
                child.kill().unwrap();
                panic!("{command:?} does not end");
            }
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    };
    let mut text = Vec::new();
    log.rewind().unwrap();
    log.read_to_end(&mut text).unwrap();
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(!text.contains("panicked") && !text.contains("memory allocation"), "{command:?}: {text}");
    assert!(status.code().is_some_and(|code| code <= 2), "{command:?}: {status}: {text}");
    (status.code(), text)
}

/// Every path below `dir` with its kind and size. Opens nothing and follows no link.
pub(crate) fn listing(dir: &Path) -> BTreeMap<PathBuf, (String, u64)> {
    let mut all = BTreeMap::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            let what = fs::symlink_metadata(&path).unwrap();
            if what.is_dir() {
                folders.push(path.clone());
            }
            let size = if what.is_file() { what.len() } else { 0 };
            all.insert(path, (format!("{:?}", what.file_type()), size));
        }
    }
    all
}

/// A PNG file of one gray pixel. Its header claims another size, with a correct checksum.
pub(crate) fn png_that_claims(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([1, 0, 0, 0, 0]);
    let crc = !header.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    });
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\r".to_vec();
    png.extend(header);
    png.extend(crc.to_be_bytes());
    // One data chunk of two bytes, and the end chunk.
    png.extend(b"\0\0\0\x0aIDAT\x78\x9c\x63\x60\0\0\0\x02\0\x01\x48\xaf\xa4\x71\0\0\0\0IEND\xae\x42\x60\x82");
    png
}
