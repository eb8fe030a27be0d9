//! The common part of all fuzz targets: a folder in memory, a limit on allocations, and the feeds of the
//! crate's tests. s3d-dataset reads the manifest of a data set; its feed is here.

#[path = "../../tests/feed/mod.rs"]
mod feed;

use feed::{FEEDS, Feed};
use s3d_dataset::{Context, statistics, verify};
use s3d_dataset::verify::VerifyOptions;
use s3d_io::fs::Checksum;
use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Counts allocated bytes, and ends the process when there are more than an input of this size warrants.
/// libFuzzer's own limits do not see pages that were never touched, nor single allocations without a
/// sanitizer.
struct Limited;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

fn grow(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Relaxed).saturating_add(bytes);
    let limit = LIMIT.load(Relaxed);
    if live > limit {
        LIMIT.store(usize::MAX, Relaxed);
        eprintln!("{bytes} bytes more make {live}; the input warrants {limit}");
        eprintln!("{}", std::backtrace::Backtrace::force_capture());
        std::process::abort();
    }
}

unsafe impl GlobalAlloc for Limited {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grow(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // The old and the new block may both be live while the content moves.
        grow(size);
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Limited = Limited;

struct Target {
    feed: Feed,
    dir: PathBuf,
    /// The allocations allowed: a base, and more for each byte of the input.
    base: usize,
    per_byte: usize,
}

static TARGET: OnceLock<Target> = OnceLock::new();

/// Chooses the reader, and makes its folder.
pub fn start(name: &str) {
    let mut feeds = FEEDS.iter().copied().chain([("manifest", manifest as Feed)]);
    let (_, feed) = feeds.find(|(n, _)| *n == name).expect("a feed has this name");

    // No threads: a run must depend on its input alone.
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global()
        .expect("the first pool");

    // Decoders that are not ours may panic on damaged input. Such panics are caught by their callers, but
    // libfuzzer-sys ends the process at any panic.
    let aborts = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !s3d_io::panic_is_caught() {
            aborts(panic);
        }
    }));

    let root = std::env::var_os("S3D_FUZZ_DIR").map_or_else(|| "/dev/shm".into(), PathBuf::from);
    let dir = root.join(format!("s3d-fuzz-{name}-{}", std::process::id()));
    fs::create_dir_all(&dir).expect("the folder can be made");

    // A pixel of a compressed image may take an eighth of a bit. A byte of deflated numbers inflates to a
    // thousand.
    let per_byte = if matches!(name, "texture" | "gltf" | "png" | "exr" | "depth") {
        32 << 10
    } else {
        4 << 10
    };
    let target = Target { feed, dir, base: 256 << 20, per_byte };
    assert!(TARGET.set(target).is_ok(), "started twice");
}

/// Reads `data`.
pub fn run(data: &[u8]) {
    let Some(target) = TARGET.get() else { return };
    LIMIT.store(LIVE.load(Relaxed) + target.base + target.per_byte * data.len(), Relaxed);
    (target.feed)(&target.dir, data);
    LIMIT.store(usize::MAX, Relaxed);
}

/// A manifest, and after a zero byte the list of files beside it. Zeros in place of the list's checksum in
/// the manifest are replaced by the checksum, so that readers get past it.
fn manifest(dir: &Path, data: &[u8]) {
    let end = data.iter().position(|b| *b == 0).unwrap_or(data.len());
    let (manifest, list) = data.split_at(end);
    let list = list.get(1..).unwrap_or_default();
    let manifest =
        String::from_utf8_lossy(manifest).replace(&"0".repeat(32), &Checksum::of(list).to_string());

    for (name, content) in [("manifest.json", manifest.as_bytes()), ("files.csv", list)] {
        fs::write(dir.join(name), content).expect("the folder can be written");
    }

    let report = verify(dir, &VerifyOptions::default(), &Context::default()).expect("faults are no error");
    assert!(report.fault_count() > 0, "a data set of two files is no whole one");
    statistics(dir).expect_err("a data set of two files is no whole one");
}
