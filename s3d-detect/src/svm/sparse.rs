//! Rows of numbers that are mostly zero.

use std::ops::Range;

/// A matrix by rows that holds only the entries other than zero, in six bytes each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRows {
    columns: Vec<u16>,
    values: Vec<f32>,
    /// Row `i` is `columns[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
    width: usize,
}

/// One row: the columns, ascending, and their values.
pub type SparseRow<'a> = (&'a [u16], &'a [f32]);

impl SparseRows {
    /// Makes a matrix of `width` columns without rows.
    ///
    /// # Panics
    /// If the number of a column does not fit in 16 bits.
    pub fn new(width: usize) -> Self {
        assert!(width <= 1 << 16, "{width} columns");
        Self { width, starts: vec![0], ..Self::default() }
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a row, which has a number for each column.
    ///
    /// # Panics
    /// If the row has another length.
    pub fn push(&mut self, row: &[f32]) {
        assert_eq!(row.len(), self.width, "numbers in a row");
        for (column, &value) in row.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            self.columns.push(column as u16);
            self.values.push(value);
        }
        self.starts.push(self.columns.len());
    }

    /// Returns row `i`.
    pub fn row(&self, i: usize) -> SparseRow<'_> {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Appends the rows of another matrix.
    ///
    /// # Panics
    /// If the other matrix has another number of columns.
    pub fn append(&mut self, other: &Self) {
        assert_eq!(other.width, self.width, "columns");
        let before = self.columns.len();
        self.columns.extend_from_slice(&other.columns);
        self.values.extend_from_slice(&other.values);
        self.starts.extend(other.starts[1..].iter().map(|start| before + start));
    }

    /// Copies the rows `which`, with zeros in the columns `without`. The number of columns stays.
    #[must_use]
    pub fn select(&self, which: impl IntoIterator<Item = usize>, without: &[Range<usize>]) -> Self {
        let mut out = Self::new(self.width);
        for i in which {
            let (columns, values) = self.row(i);
            for (&column, &value) in columns.iter().zip(values) {
                if !without.iter().any(|range| range.contains(&usize::from(column))) {
                    out.columns.push(column);
                    out.values.push(value);
                }
            }
            out.starts.push(out.columns.len());
        }
        out
    }
}

/// Returns the product of a row and a dense vector.
pub fn dot((columns, values): SparseRow<'_>, dense: &[f64]) -> f64 {
    columns
        .iter()
        .zip(values)
        .map(|(&c, &v)| dense[usize::from(c)] * f64::from(v))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_hold_the_numbers_that_were_pushed() {
        let mut rows = SparseRows::new(4);
        rows.push(&[0.0, 1.0, 0.0, 2.0]);
        rows.push(&[0.0; 4]);
        let mut more = SparseRows::new(4);
        more.push(&[3.0, 0.0, 4.0, 5.0]);
        rows.append(&more);
        assert_eq!((rows.len(), rows.row(1)), (3, (&[][..], &[][..])));
        assert_eq!(rows.row(2), (&[0, 2, 3][..], &[3.0, 4.0, 5.0][..]));
        assert_eq!(dot(rows.row(2), &[1.0, 10.0, 100.0, 1000.0]), 5403.0);
        let some = rows.select([2, 0], std::slice::from_ref(&(1..3)));
        assert_eq!(some.row(0), (&[0, 3][..], &[3.0, 5.0][..]));
        assert_eq!(some.row(1), (&[3][..], &[2.0][..]));
    }
}
