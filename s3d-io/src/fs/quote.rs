//! Pieces of input in messages.

/// The length of the longest quotation, in characters.
const LONGEST: usize = 60;

/// Returns `text` between backticks, for a message. Control characters are replaced, and text is cut after 60
/// characters.
pub(crate) fn quote(text: &[u8]) -> String {
    // A line may be megabytes long. Characters take up to four bytes, so this much fills the quotation.
    let head = String::from_utf8_lossy(text.get(..4 * LONGEST + 4).unwrap_or(text));
    let mut quoted: String = head
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();

    if head.chars().count() > LONGEST || text.len() > 4 * LONGEST + 4 {
        quoted.push('…');
    }
    format!("`{quoted}`")
}

/// Returns a number with its noun: "1 face", "2 faces", "2 meshes", "2 vertices".
pub(crate) fn count(n: usize, noun: &str) -> String {
    match noun.strip_suffix("ex") {
        _ if n == 1 => format!("1 {noun}"),
        Some(stem) => format!("{n} {stem}ices"),
        None if noun.ends_with("sh") => format!("{n} {noun}es"),
        None => format!("{n} {noun}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_and_odd_text_is_tamed() {
        assert_eq!(quote(b"v 1 2"), "`v 1 2`");
        assert_eq!(quote(b"v\t1\0\xff"), "`v\u{fffd}1\u{fffd}\u{fffd}`");
        let long = quote(&vec![b'x'; 5_000_000]);
        assert_eq!(long.chars().count(), 63);
        assert!(long.ends_with("…`"));
    }

    #[test]
    fn nouns_are_counted() {
        let counted = [count(1, "vertex"), count(0, "vertex"), count(2, "mesh"), count(3, "face")];
        assert_eq!(counted, ["1 vertex", "0 vertices", "2 meshes", "3 faces"]);
    }
}
