//! The card of a data set: `README.md`, whose head in YAML says which files belong to what.

use super::HuggingfaceSet;
use super::features::{Feature, Kind, features};
use crate::error::Result;
use crate::fs::atomic::write_bytes;
use std::fmt::Write as _;
use std::path::Path;

/// Writes the card. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_huggingface_card(path: &Path, set: &HuggingfaceSet<'_>) -> Result<u64> {
    write_bytes(path, card(set).as_bytes())
}

fn card(set: &HuggingfaceSet<'_>) -> String {
    let features = features(set);
    let images: usize = set
        .configs
        .iter()
        .flat_map(|config| &config.splits)
        .map(|(_, n)| n)
        .sum();
    let size = match images {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        _ => "1M<n<10M",
    };

    // The head.
    let mut text = format!(
        "---\npretty_name: \"{}\"\nlicense: unknown\nsize_categories:\n- {size}\ntask_categories:\n\
         - depth-estimation\n- image-segmentation\ntags:\n- 3d\n- indoor\n- rgb-d\nconfigs:\n",
        yaml(&set.name)
    );
    for (i, config) in set.configs.iter().enumerate() {
        let default = if i == 0 { "  default: true\n" } else { "" };
        let _ = write!(text, "- config_name: {}\n{default}  data_files:\n", config.name);
        for (split, _) in &config.splits {
            let files = HuggingfaceSet::files_of(config.name, split);
            let _ = write!(text, "  - split: {split}\n    path: {files}\n");
        }
    }
    text.push_str("dataset_info:\n");
    for config in &set.configs {
        let _ = write!(text, "- config_name: {}\n  features:\n", config.name);
        for Feature { name, kind, .. } in &features {
            let kind = match kind {
                Kind::Int => "dtype: int32",
                Kind::Float => "dtype: float64",
                Kind::Text => "dtype: string",
                Kind::Floats => "sequence: float64",
                Kind::Image => "dtype: image",
                Kind::Depth => "dtype:\n      image:\n        mode: F",
            };
            let _ = write!(text, "  - name: {name}\n    {kind}\n");
        }
    }

    // The page.
    let _ = write!(text, "---\n\n# {}\n\n", set.name);
    text.push_str(
        "Images of indoor scans that are registered to each other and to the scans: a row an image. \
         `s3d pack` wrote them. The licence is the one of the scans: name it in the head of this card.\n\n\
         | configuration | split | images |\n|---|---|---|\n",
    );
    for config in &set.configs {
        for (split, images) in &config.splits {
            let _ = writeln!(text, "| `{}` | `{split}` | {images} |", config.name);
        }
    }
    if let Some(config) = set.configs.first()
        && let Some((split, _)) = config.splits.first()
    {
        let _ = write!(
            text,
            "\n```python\nfrom datasets import load_dataset\nimages = load_dataset(\"FOLDER\", \"{}\", \
             split=\"{split}\")\nimage = images[0]\n```\n",
            config.name
        );
    }
    text.push_str("\n| column | meaning |\n|---|---|\n");
    for Feature { name, meaning, .. } in &features {
        let _ = writeln!(text, "| `{name}` | {meaning} |");
    }
    let tables: Vec<String> = set.tables.iter().map(|name| format!("`{name}`")).collect();
    let _ = write!(text, "\nWhat the numbers of images mean is in {}.\n", tables.join(", "));
    text
}

/// Returns a text as it stands between double quotes in YAML.
fn yaml(text: &str) -> String {
    let plain = text.chars().filter(|c| !c.is_control()).collect::<String>();
    plain.replace('\\', "\\\\").replace('"', "\\\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_end_no_text_of_the_head() {
        assert_eq!(yaml("a \"b\" \\ c\n"), "a \\\"b\\\" \\\\ c");
    }
}
