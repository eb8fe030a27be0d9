//! What the first lines of a text tell: the names of its columns, the number of its points, and how words are
//! separated.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::wanted::{Wanted, columns_like};
use crate::cloud::table::words::{Lines, Separator, WordTable, unquoted};
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use std::io::BufRead;
use std::path::Path;

/// The number of points that show which columns are floats.
const SHOWN: usize = 256;
/// The longest list of columns.
const MOST_COLUMNS: usize = 4096;

/// The first lines of a file.
#[derive(Debug)]
pub(super) struct Layout {
    /// The line of names, if there is one, and the names.
    names: Option<(u64, Vec<String>)>,
    /// The number of points, if a line states it.
    pub(super) count: Option<u64>,
    /// The line of the first point.
    pub(super) first: u64,
    first_text: String,
    separator: Separator,
    /// For each column, whether the first points have decimals in it.
    floats: Vec<bool>,
}

impl Layout {
    /// Reads lines until enough points have come. Without `may_begin`, the first line is a point.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if there is no point, or if it is no text.
    pub(super) fn find(path: &Path, lines: &mut Lines<impl BufRead>, may_begin: bool) -> Result<Self> {
        let mut names = None;
        let mut count = None;
        while let Some(line) = lines.next()? {
            if line.contains(&0) {
                let message = "is no text: it holds zero bytes. If it is text in UTF-16, save it with a byte \
                               order mark, or in UTF-8";
                return Err(Error::line(path, lines.number(), message));
            }
            if line.is_empty() {
                continue;
            }

            // Comments of other words come before and after the names.
            let found = names_of(line).filter(|_| may_begin);
            let is_names =
                |found: &Vec<String>| has_coordinates(found) || !is_comment(line) && names.is_none();
            if let Some(found) = found.filter(is_names) {
                names = Some((lines.number(), found));
                continue;
            }
            if may_begin && is_comment(line) {
                continue;
            }
            if may_begin
                && count.is_none()
                && let Some(points) = count_of(line)
            {
                count = Some(points);
                continue;
            }
            return Self::of_points(path, lines, names, count);
        }
        Err(Error::format(path, "holds no point that can be used: no line of it is a point"))
    }

    /// Continues at the line of the first point.
    fn of_points(
        path: &Path,
        lines: &mut Lines<impl BufRead>,
        names: Option<(u64, Vec<String>)>,
        count: Option<u64>,
    ) -> Result<Self> {
        let first = lines.number();
        let first_text = quote(lines.line());
        let separator = Separator::of(lines.line());
        let mut width = separator.words(lines.line()).count();
        let ends_empty = separator.words(lines.line()).last().is_some_and(<[u8]>::is_empty);
        if ends_empty && names.as_ref().is_none_or(|(_, names)| names.len() < width) {
            width = width.saturating_sub(1);
        }
        if width > MOST_COLUMNS {
            return Err(Error::line(path, first, format!("has {width} columns")));
        }

        let mut floats = vec![false; width];
        for _ in 0..SHOWN {
            for (word, is_float) in separator.words(lines.line()).zip(&mut floats) {
                let word = unquoted(word);
                let is_whole = std::str::from_utf8(word).is_ok_and(|w| w.parse::<i64>().is_ok());
                *is_float |= !is_whole && separator.number(word).is_some();
            }
            if lines.next()?.is_none() {
                break;
            }
        }
        Ok(Self { names, count, first, first_text, separator, floats })
    }

    /// Chooses the columns. `usual` gives the names in a kind of file that has none, by their number.
    ///
    /// # Errors
    /// [`Error::Format`] if nothing names the columns, if there are more or fewer than are named, and as in
    /// [`WordTable::new`].
    pub(super) fn table(
        &self,
        path: &Path,
        wanted: Wanted<'_>,
        usual: impl Fn(usize) -> Option<Vec<String>>,
    ) -> Result<WordTable> {
        let width = self.floats.len();
        let names = match &self.names {
            _ if !wanted.columns().is_empty() => {
                if wanted.columns().len() != width {
                    let message = format!(
                        "has {width} columns, and {} are named (columns{}): {}",
                        wanted.columns().len(),
                        wanted.place_of_columns(),
                        self.first_text
                    );
                    return Err(Error::line(path, self.first, message));
                }
                wanted.columns().to_vec()
            }
            Some((line, names)) if names.len() != width => {
                let message = format!(
                    "has {width} columns, and line {line} names {}, {}: name them with columns{}: {}",
                    names.len(),
                    names.join(" "),
                    wanted.place_of_columns(),
                    self.first_text
                );
                return Err(Error::line(path, self.first, message));
            }
            Some((_, names)) => names.clone(),
            None => usual(width).ok_or_else(|| self.unnamed(path, wanted))?,
        };

        // `Rf Gf Bf` are floats by their names, even if the first points are black.
        let is_float = |column: usize| {
            let by_name = names.get(column).is_some_and(|name| name.eq_ignore_ascii_case("rf"));
            by_name || self.floats.get(column).copied().unwrap_or(false)
        };
        WordTable::new(path, &names, self.separator, is_float, wanted)
    }

    fn unnamed(&self, path: &Path, wanted: Wanted<'_>) -> Error {
        let width = self.floats.len();
        let message = format!(
            "is an ASCII cloud without names of columns: it has {width}, as in {}. Say what they are, as in \
             columns = [{}]{}, or write them into its first line",
            self.first_text,
            columns_like(wanted),
            wanted.place_of_columns()
        );
        Error::line(path, self.first, message)
    }
}

/// Whether a line is a comment, in which names may stand.
pub(super) fn is_comment(line: &[u8]) -> bool {
    [&b"#"[..], b"//", b"%"].iter().any(|mark| line.starts_with(mark))
}

/// The number of points, if the line is one whole number.
pub(super) fn count_of(line: &[u8]) -> Option<u64> {
    std::str::from_utf8(line).ok()?.parse().ok()
}

/// The names in a line of names: its first word is no number.
fn names_of(line: &[u8]) -> Option<Vec<String>> {
    let marks = line
        .iter()
        .take_while(|b| matches!(b, b'#' | b'/' | b'%' | b' ' | b'\t'))
        .count();
    let line = line.get(marks..)?.trim_ascii();
    let separator = Separator::of(line);
    let mut names: Vec<String> = separator
        .words(line)
        .map(|word| String::from_utf8_lossy(unquoted(word)).into_owned())
        .collect();
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    let first = names.first()?;
    (separator.number(first.as_bytes()).is_none() && names.len() <= MOST_COLUMNS).then_some(names)
}

/// Whether names are those of columns of points.
fn has_coordinates(names: &[String]) -> bool {
    ["x", "y", "z"]
        .iter()
        .all(|name| names.iter().any(|n| n.eq_ignore_ascii_case(name)))
}

/// Whether the first bytes of a file are rows of points, or a line that names their columns.
pub(crate) fn is_rows(head: &[u8]) -> bool {
    // The last line may be cut.
    let lines = head.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    for line in lines.filter(|line| !line.is_empty()) {
        match names_of(line) {
            Some(names) if has_coordinates(&names) => return true,
            _ if is_comment(line) || count_of(line).is_some() => {}
            _ => {
                let separator = Separator::of(line);
                let mut words = separator.words(line).take(3);
                return (0..3).all(|_| words.next().is_some_and(|w| separator.number(w).is_some()));
            }
        }
    }
    false
}
