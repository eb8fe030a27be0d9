//! Files of data as scripts: a page that was opened from the disk may run them, and fetch nothing. In a
//! report of one file they are in the page.

use crate::packed::packed;
use s3d_dataset::{Error, Result};
use s3d_io::Error as FileError;
use s3d_io::fs::write_bytes;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of data in a page at most: browsers read all of it before they show anything.
const MOST_BYTES: u64 = 150_000_000;

/// Longer texts are packed where they are not images, which are as small as they can be.
const LONG: usize = 1 << 20;

/// Where the data of a report goes.
pub(crate) enum Scripts {
    /// Files `data/KEY.js` in this folder: calls that hand over the key and the value as text of JSON. The
    /// page parses the text, so that no name in it can be anything but text.
    Files(PathBuf),
    /// Elements of the page, by key.
    Page(Mutex<Elements>),
}

/// The elements of a page.
#[derive(Default)]
pub(crate) struct Elements {
    by_key: BTreeMap<String, String>,
    bytes: u64,
}

impl Scripts {
    /// Writes a value, and returns the bytes written.
    pub(crate) fn write<T: Serialize>(&self, key: &str, value: &T) -> Result<u64> {
        self.write_text(key, value, usize::MAX)
    }

    /// The same of a value that may be a long list of words and numbers, and is packed if it is.
    pub(crate) fn write_list<T: Serialize>(&self, key: &str, value: &T) -> Result<u64> {
        self.write_text(key, value, LONG)
    }

    /// Writes a value; its text is packed if it is longer than `long`.
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
                // Nothing in the text can end the element: in JSON, < stands in strings alone.
                let text = text.replace('<', "\\u003c");
                let element =
                    format!("<script type=\"application/json\" data-key=\"{key}\">{text}</script>\n");
                let bytes = element.len() as u64;
                let mut elements = elements.lock().unwrap_or_else(PoisonError::into_inner);
                elements.bytes += bytes;
                if elements.bytes > MOST_BYTES {
                    return Err(Error::Usage(format!(
                        "one file of more than {} MB would open slowly or not at all: make a folder (without \
                         --single), or smaller images (--pano-width, --thumbs)",
                        MOST_BYTES / 1_000_000
                    )));
                }
                elements.by_key.insert(key.to_owned(), element);
                Ok(bytes)
            }
        }
    }

    /// The elements of a page, in the order of their keys.
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
    fn one_file_has_an_end() {
        let page = Scripts::Page(Mutex::default());
        let large = "x".repeat(60_000_000);
        page.write("a", &large).unwrap();
        page.write("b", &large).unwrap();
        let e = page.write("c", &large).unwrap_err().to_string();
        assert!(e.contains("150 MB") && e.contains("--single"), "{e}");
    }
}
