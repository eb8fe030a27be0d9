//! Names from files in lines for a terminal: they neither control it nor turn the rest of a line around.

use std::borrow::Cow;

/// Whether a character is a mark of Unicode that turns the direction of the text around it.
fn turns(c: char) -> bool {
    matches!(
        c,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    )
}

/// Returns a line of the log with escapes in place of marks that turn text around: `\u{202e}`. The log has
/// colours, whose control characters stay; those of a message are escaped before.
pub(crate) fn upright_line(line: &str) -> Cow<'_, str> {
    escaped(line, turns, |c| c.escape_unicode().to_string())
}

/// Returns the text of an answer with escapes in place of control characters, except tabs and line feeds,
/// and of marks that turn text around.
pub(crate) fn upright_text(text: &str) -> Cow<'_, str> {
    let is_odd = |c: char| turns(c) || c.is_control() && !matches!(c, '\t' | '\n');
    escaped(text, is_odd, |c| c.escape_unicode().to_string())
}

/// Returns JSON with escapes in place of marks that turn text around. It means the same.
pub(crate) fn upright_json(json: &str) -> Cow<'_, str> {
    escaped(json, turns, |c| format!("\\u{:04x}", u32::from(c)))
}

fn escaped(text: &str, is_odd: impl Fn(char) -> bool, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(&is_odd) {
        return Cow::Borrowed(text);
    }
    let mut upright = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_odd(c) {
            upright.push_str(&escape(c));
        } else {
            upright.push(c);
        }
    }
    Cow::Owned(upright)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_that_turn_text_around_are_escaped() {
        let marks = "\u{61c}\u{200e}\u{200f}\u{202a}\u{202e}\u{2066}\u{2069}";
        let line = format!("\u{1b}[31mroom\u{1b}[0m {marks} of É 房\n");
        let expected = r"\u{61c}\u{200e}\u{200f}\u{202a}\u{202e}\u{2066}\u{2069}";
        assert_eq!(upright_line(&line), format!("\u{1b}[31mroom\u{1b}[0m {expected} of É 房\n"));
        assert_eq!(upright_text("a\u{1b}[31m\tb\u{202e}\n"), "a\\u{1b}[31m\tb\\u{202e}\n");
        assert_eq!(upright_text("plain é 房\n"), "plain é 房\n");
    }

    #[test]
    fn escapes_in_json_mean_the_same_text() {
        let name = "a\u{202e}b\u{61c}\"c";
        let json = serde_json::to_string(name).unwrap();
        let safe = upright_json(&json);
        assert!(safe.is_ascii(), "{safe}");
        assert_eq!(serde_json::from_str::<String>(&safe).unwrap(), name);
    }
}
