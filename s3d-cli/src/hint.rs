//! The command that goes on where this one ends, to be copied into a shell.

use std::env;
use std::ffi::OsString;

/// "go on with: s3d export scan/scene.toml -o 'data set'": the command line as it was called, quoted for a
/// shell. Every failure that may pass ends with it.
pub(crate) fn resume_hint() -> String {
    format!("go on with: {}", command_line(env::args_os()))
}

fn command_line(args: impl Iterator<Item = OsString>) -> String {
    let words: Vec<String> = args.map(|arg| quoted(&arg.to_string_lossy())).collect();
    words.join(" ")
}

/// A word as a shell takes it: as it is if nothing in it means something there, else in quotes.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=,+@%".contains(c) || (cfg!(windows) && c == '\\');
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else if cfg!(windows) {
        format!("\"{}\"", word.replace('"', "\"\""))
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        let line =
            |words: &[&str]| command_line(words.iter().map(OsString::from).collect::<Vec<_>>().into_iter());
        assert_eq!(line(&["s3d", "export", "a/b.toml", "-o", "Büro-1_x"]), "s3d export a/b.toml -o Büro-1_x");
        assert_eq!(line(&["s3d", "my scan", "", "$x", "it's", "*"]), r"s3d 'my scan' '' '$x' 'it'\''s' '*'");
    }

    #[test]
    fn a_shell_reads_back_the_same_words() {
        let words = ["a b", "$HOME", "it's", "`x`", "\"", "\\", "*", "a\nb", "~", "#", "-n", "ü;&|<>"];
        let line = command_line(words.iter().map(OsString::from));
        let out = std::process::Command::new("sh")
            .arg("-c")
            .arg(format!("printf '%s\\0' {line}"))
            .output()
            .unwrap();
        let read: Vec<&str> = std::str::from_utf8(&out.stdout).unwrap().split_terminator('\0').collect();
        assert_eq!(read, words);
    }
}
