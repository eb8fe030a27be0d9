//! The command that continues the work of a failed one, to be copied into a shell.

use std::sync::OnceLock;

/// The command line as it was called.
static WORDS: OnceLock<Vec<String>> = OnceLock::new();

/// Keeps the command line for [`resume_hint`].
pub(crate) fn remember(words: Vec<String>) {
    let _ = WORDS.set(words);
}

/// Returns "go on with: s3d export scan/scene.toml -o 'data set'": the command line as it was called, quoted
/// for a shell. The message of every failure that may pass ends with it.
pub(crate) fn resume_hint() -> String {
    format!("go on with: {}", command_line(WORDS.get().into_iter().flatten()))
}

fn command_line(words: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    words
        .into_iter()
        .map(|word| quoted(word.as_ref()))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Quotes a word for a shell, unless every character of it is plain there.
fn quoted(word: &str) -> String {
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else if cfg!(windows) {
        format!("\"{}\"", word.replace('"', "\"\""))
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

fn is_plain(c: char) -> bool {
    c.is_alphanumeric() || "_-./:=,+@%".contains(c) || (cfg!(windows) && c == '\\')
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        let plain = command_line(["s3d", "export", "a/b.toml", "-o", "Büro-1_x"]);
        assert_eq!(plain, "s3d export a/b.toml -o Büro-1_x");
        let special = command_line(["s3d", "my scan", "", "$x", "it's", "*"]);
        assert_eq!(special, r"s3d 'my scan' '' '$x' 'it'\''s' '*'");
    }

    #[test]
    fn a_shell_reads_back_the_same_words() {
        let words = ["a b", "$HOME", "it's", "`x`", "\"", "\\", "*", "a\nb", "~", "#", "-n", "ü;&|<>"];
        let line = command_line(words);
        let out = std::process::Command::new("sh")
            .arg("-c")
            .arg(format!("printf '%s\\0' {line}"))
            .output()
            .unwrap();
        let read: Vec<&str> = std::str::from_utf8(&out.stdout)
            .unwrap()
            .split_terminator('\0')
            .collect();
        assert_eq!(read, words);
    }
}
