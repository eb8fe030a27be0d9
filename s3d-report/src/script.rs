//! Files of data as scripts: a page that was opened from the disk may run them, and fetch nothing.

use s3d_dataset::Result;
use s3d_io::Error as FileError;
use s3d_io::fs::write_bytes;
use serde::Serialize;
use std::path::Path;

/// Writes `data/KEY.js`: a call that hands over the key and the value as text of JSON. The page parses the
/// text, so that no name in it can be anything but text. Returns the bytes written.
pub(crate) fn write_script<T: Serialize>(folder: &Path, key: &str, value: &T) -> Result<u64> {
    let path = folder.join("data").join(format!("{key}.js"));
    let failed = |e: serde_json::Error| FileError::format(&path, e.to_string());
    let text = serde_json::to_string(value).map_err(failed)?;
    let [key, text] = [key, &text].map(|text| serde_json::to_string(text).map_err(failed));
    Ok(write_bytes(&path, format!("s3dReport({},{});\n", key?, text?).as_bytes())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("data")).unwrap();
        let hostile = "</script>\"'\\\n\u{2028}";
        write_script(dir.path(), "index", &hostile).unwrap();
        let script = std::fs::read_to_string(dir.path().join("data/index.js")).unwrap();
        let text = script.strip_prefix("s3dReport(\"index\",").unwrap().strip_suffix(");\n").unwrap();
        let json: String = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), hostile);
    }
}
