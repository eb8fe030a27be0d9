//! Writes data as scripts: a page that was opened from the disk may run scripts, but may not fetch files. In
//! a report of one file, the data is in the page.

pub(crate) mod packed;

use packed::packed;
use s3d_dataset::{Error, Result};
use s3d_io::Error as FileError;
use s3d_io::fs::write_bytes;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The most bytes of data in a page: browsers read all of them before they show anything.
pub(crate) const MOST_BYTES: u64 = 150_000_000;

/// Longer texts are packed, except images, which are compressed already.
const LONG: usize = 1 << 20;

/// The destination of the data of a report.
pub(crate) enum Scripts {
    /// Files `data/KEY.js` in this folder. Each calls the page with the key, and with the value as text in
    /// JSON. The page parses the text, so that names in it stay text.
    Files(PathBuf),
    /// The elements of the page, by key.
    Page(Mutex<Elements>),
}

/// The elements of a page.
#[derive(Default)]
pub(crate) struct Elements {
    by_key: BTreeMap<String, String>,
    bytes: u64,
}

impl Scripts {
    /// Writes a value, and returns the bytes written. If the page becomes too large, the call fails as if it
    /// were cancelled, and [`is_too_large`](Self::is_too_large) is true.
    pub(crate) fn write<T: Serialize>(&self, key: &str, value: &T) -> Result<u64> {
        self.write_text(key, value, usize::MAX)
    }

    /// Writes a value that may be a long list of words and numbers. A long list is packed.
    pub(crate) fn write_list<T: Serialize>(&self, key: &str, value: &T) -> Result<u64> {
        self.write_text(key, value, LONG)
    }

    /// Writes a value, and packs its text if it is longer than `long`.
    fn write_text<T: Serialize>(&self, key: &str, value: &T, long: usize) -> Result<u64> {
        let name = format!("data/{key}.js");
        let failed = |e: serde_json::Error| FileError::format(Path::new(&name), e.to_string());
        let text = serde_json::to_string(value).map_err(failed)?;

        match self {
            Self::Files(folder) => {
                let is_packed = text.len() > long;
                let text = if is_packed {
                    packed(text.into_bytes(), u8::to_le_bytes)
                } else {
                    text
                };
                let [key, text] = [key, &text].map(|text| serde_json::to_string(text).map_err(failed));
                let is_packed = if is_packed { ",true" } else { "" };
                let script = format!("s3dReport({},{}{is_packed});\n", key?, text?);
                Ok(write_bytes(&folder.join(&name), script.as_bytes())?)
            }
            Self::Page(elements) => {
                // Nothing in the text may end the element. In JSON, < occurs in strings only.
                let text = text.replace('<', "\\u003c");
                let element =
                    format!("<script type=\"application/json\" data-key=\"{key}\">{text}</script>\n");
                let bytes = element.len() as u64;

                let mut elements = elements.lock().unwrap_or_else(PoisonError::into_inner);
                elements.bytes += bytes;
                if elements.bytes > MOST_BYTES {
                    return Err(Error::Cancelled);
                }
                elements.by_key.insert(key.to_owned(), element);
                Ok(bytes)
            }
        }
    }

    /// Whether a page became too large.
    pub(crate) fn is_too_large(&self) -> bool {
        match self {
            Self::Files(_) => false,
            Self::Page(elements) => {
                elements.lock().unwrap_or_else(PoisonError::into_inner).bytes > MOST_BYTES
            }
        }
    }

    /// Returns the elements of a page, in the order of their keys.
    pub(crate) fn into_elements(self) -> impl Iterator<Item = String> {
        let elements = match self {
            Self::Files(_) => Elements::default(),
            Self::Page(elements) => elements.into_inner().unwrap_or_else(PoisonError::into_inner),
        };
        elements.by_key.into_values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;
    use flate2::read::ZlibDecoder;

    #[test]
    fn text_stays_text() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("data")).unwrap();
        let hostile = "</script><!--\"'\\\n\u{2028}";
        Scripts::Files(dir.path().to_owned()).write("index", &hostile).unwrap();
        let script = std::fs::read_to_string(dir.path().join("data/index.js")).unwrap();
        let text = script
            .strip_prefix("s3dReport(\"index\",")
            .unwrap()
            .strip_suffix(");\n")
            .unwrap();
        let json: String = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), hostile);

        let page = Scripts::Page(Mutex::default());
        page.write("index", &hostile).unwrap();
        let element = page.into_elements().next().unwrap();
        let text = element
            .strip_prefix("<script type=\"application/json\" data-key=\"index\">")
            .unwrap();
        let text = text.strip_suffix("</script>\n").unwrap();
        assert!(!text.contains('<'));
        assert_eq!(serde_json::from_str::<String>(text).unwrap(), hostile);
    }

    #[test]
    fn long_lists_are_packed() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("data")).unwrap();
        let scripts = Scripts::Files(dir.path().to_owned());
        let list = vec!["location"; 200_000];
        let plain = scripts.write("thumbs_0", &list).unwrap();
        let bytes = scripts.write_list("index", &list).unwrap();
        assert!(bytes < plain / 100, "{bytes} of {plain}");
        let script = std::fs::read_to_string(dir.path().join("data/index.js")).unwrap();
        let text = script
            .strip_prefix("s3dReport(\"index\",\"")
            .unwrap()
            .strip_suffix("\",true);\n")
            .unwrap();
        let stream = BASE64_STANDARD.decode(text).unwrap();
        let read: Vec<String> = serde_json::from_reader(ZlibDecoder::new(&*stream)).unwrap();
        assert_eq!(read, list);
    }

    #[test]
    fn a_page_has_a_greatest_size() {
        let page = Scripts::Page(Mutex::default());
        let large = "x".repeat(60_000_000);
        page.write("a", &large).unwrap();
        page.write("b", &large).unwrap();
        assert!(!page.is_too_large());
        assert!(page.write("c", &large).is_err() && page.is_too_large());
        let e = crate::Error::TooLarge(MOST_BYTES).to_string();
        assert!(e.contains("150 MB") && e.contains("make a folder"), "{e}");
    }
}
