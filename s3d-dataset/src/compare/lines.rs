//! Formats lines, tables and numbers for a person.

/// Lines without characters that would control a terminal or reverse the order of text.
#[derive(Default)]
pub(crate) struct Lines(String);

impl Lines {
    pub(crate) fn add(&mut self, line: impl AsRef<str>) {
        self.0.extend(
            line.as_ref()
                .trim_end()
                .chars()
                .map(|c| if is_odd(c) { '\u{fffd}' } else { c }),
        );
        self.0.push('\n');
    }

    /// Adds a table with a line of titles, or nothing if there are no rows. The first `left` columns are
    /// aligned to the left, the others to the right.
    pub(crate) fn table<const N: usize>(&mut self, titles: [&str; N], rows: &[[String; N]], left: usize) {
        if rows.is_empty() {
            return;
        }

        let widths: [usize; N] = std::array::from_fn(|column| {
            let cells = rows.iter().map(|row| row[column].chars().count() + indent(column));
            cells.chain([titles[column].chars().count()]).max().unwrap_or(0)
        });
        let padded = |column: usize, cell: &str| match widths[column] {
            width if column < left => format!("{cell:<width$}"),
            width => format!("{cell:>width$}"),
        };

        let line = |cell: &dyn Fn(usize) -> String| {
            let cells: [String; N] = std::array::from_fn(|column| padded(column, &cell(column)));
            cells.join("  ")
        };

        self.add(line(&|column| titles[column].to_owned()));
        for row in rows {
            self.add(line(&|column| format!("{:1$}{2}", "", indent(column), row[column])));
        }
    }

    /// Adds a line on rows that are left out.
    pub(crate) fn more(&mut self, rows: usize) {
        if rows > 0 {
            self.add(format!("  … and {rows} more"));
        }
    }

    pub(crate) fn text(&self) -> &str {
        &self.0
    }
}

/// Rows are indented under the first title.
fn indent(column: usize) -> usize {
    if column == 0 { 2 } else { 0 }
}

/// Whether a character controls a terminal or the direction of text.
fn is_odd(c: char) -> bool {
    let turns = ['\u{61c}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'].contains(&c);
    c.is_control()
        || turns
        || ('\u{202a}'..='\u{202e}').contains(&c)
        || ('\u{2066}'..='\u{2069}').contains(&c)
}

/// A number with three significant digits, or with all digits before the point.
pub(crate) fn significant(value: f64) -> String {
    let decimals = match value.abs() {
        0.0 | 100.0.. => 0,
        10.0.. => 1,
        1.0.. => 2,
        0.1.. => 3,
        0.01.. => 4,
        0.001.. => 5,
        _ => return format!("{value:.2e}"),
    };
    format!("{value:.decimals$}")
}

/// A share in percent.
pub(crate) fn percent(part: u64, of: u64) -> String {
    let share = 100.0 * part as f64 / of as f64;
    if share > 0.0 && share < 0.01 {
        "<0.01 %".to_owned()
    } else {
        format!("{share:.2} %")
    }
}

/// A number with commas, such as 1,234,567.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [0, 7, 999, 1000, 123_456, 1_234_567].map(grouped);
        assert_eq!(all.join(" "), "0 7 999 1,000 123,456 1,234,567");
        let short = [0.0, 1234.56, 12.345, 1.2345, 0.25, 0.012_345, 0.000_012].map(significant);
        assert_eq!(short.join(" "), "0 1235 12.3 1.23 0.250 0.0123 1.20e-5");
        let shares = [percent(1, 100_000), percent(1, 8), percent(0, 8)];
        assert_eq!(shares, ["<0.01 %", "12.50 %", "0.00 %"]);
    }

    #[test]
    fn columns_are_aligned_and_empty_tables_left_out() {
        let mut lines = Lines::default();
        let rows = [["rgb", "1,000"], ["normal", "2"]].map(|row| row.map(str::to_owned));
        lines.table(["images", "same"], &rows, 1);
        assert_eq!(lines.text(), "images     same\n  rgb     1,000\n  normal      2\n");
        lines.table(["a", "b"], &[], 1);
        lines.more(0);
        assert_eq!(lines.text().lines().count(), 3);
    }

    #[test]
    fn what_steers_a_terminal_is_replaced() {
        let mut lines = Lines::default();
        lines.add("a\u{1b}[31m\tb\u{202e}c\nd é ");
        assert_eq!(lines.text(), "a\u{fffd}[31m\u{fffd}b\u{fffd}c\u{fffd}d é\n");
    }
}
