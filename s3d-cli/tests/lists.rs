//! Lists of all modalities and of all mesh formats are whole, also where no compiler reads them.

use s3d_io::dataset::Domain;
use s3d_io::mesh::MeshFormat;
use std::fs;
use std::path::Path;

/// A file of the repository.
fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Checks that a file has each of these pieces of text.
fn has_all(name: &str, pieces: impl IntoIterator<Item = String>) {
    let text = read(name);
    for piece in pieces {
        assert!(text.contains(&piece), "{name} has no {piece:?}");
    }
}

/// Returns whether Python's views and the comparison in a report have a name of their own for a modality.
/// They show others by the name of the folder, or not at all.
fn has_name(domain: &Domain) -> bool {
    Domain::PUBLISHED.contains(domain)
}

#[test]
fn modalities_are_listed() {
    let images = || Domain::ALL.into_iter().filter(|domain| domain.pixels().is_some());
    let named = || images().filter(has_name);
    let folder = |domain: Domain| domain.folder();

    for table in ["docs/output.md", "s3d-io/docs/formats.md"] {
        has_all(table, Domain::ALL.map(|domain| format!("\n| `{domain}` | ")));
    }
    let rendered = images().filter(|domain| !domain.is_semantic());
    let file = |domain: Domain| format!("`{domain}/NAME.{}`", domain.extension());
    has_all("s3d-io/docs/formats.md", rendered.map(file));
    has_all("s3d-io/src/image/mod.rs", images().map(|domain| format!("`{domain}`")));
    let words = read("s3d-py/python/s3d_py/_export.py");
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(&Domain::ALL.map(Domain::folder).join(", ")), "_export.py lists other modalities");
    has_all("s3d-py/python/s3d_py/_views.py", named().map(folder).map(|name| format!("\"{name}\"")));
    // The colours of labels are only to look at.
    let read_there = images().filter(|domain| *domain != Domain::SemanticPretty);
    has_all("s3d-dataset/assets/utils.py", read_there.map(|domain| format!("(image, \"{domain}\")")));
    has_all(
        "s3d-report/web/src/compare/picture.ts",
        named().map(folder).map(|name| format!("\n  {name}: \"")),
    );
}

#[test]
fn mesh_formats_are_listed() {
    let formats = MeshFormat::ALL;
    let sentences = [
        "README.md",
        "docs/scan.md",
        "docs/python.md",
        "s3d-io/README.md",
        "s3d-py/python/s3d_py/_mesh.py",
        "s3d-cli/src/args.rs",
    ];
    for name in sentences {
        let is_whole = |line: &str| formats.iter().all(|format| line.contains(format.name));
        assert!(read(name).lines().any(is_whole), "no line of {name} has all mesh formats");
    }

    has_all("s3d-io/docs/formats.md", formats.iter().map(|format| format!("\n| {} ", format.name)));
    let manifest = read("s3d-io/Cargo.toml");
    let (_, default) = manifest.split_once("default = [").unwrap();
    let (default, _) = default.split_once(']').unwrap();
    assert!(
        formats
            .iter()
            .all(|format| default.contains(&format!("{:?}", format.feature))),
        "{default}"
    );
    has_all("s3d-io/src/lib.rs", formats.iter().map(|format| format!("`{}`", format.feature)));
    let endings = formats.iter().flat_map(|format| format.endings);
    has_all("s3d-io/src/mesh/mod.rs", endings.map(|ending| format!("`.{ending}`")));
}
