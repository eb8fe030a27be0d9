//! A batch of rows of a PLY element, column by column.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

/// Rows of one element, with a column for each property. Columns that are not wanted are empty.
#[derive(Debug, Default)]
pub(crate) struct PlyBatch {
    first_row: u64,
    pub(crate) rows: usize,
    pub(crate) columns: Vec<Column>,
    /// The line of each row, in an ASCII file.
    pub(crate) lines: Vec<u64>,
}

#[derive(Debug, Default)]
pub(crate) struct Column {
    pub(crate) values: Vec<f64>,
    /// Where the list of each row ends. Empty for a property of single numbers.
    pub(crate) ends: Vec<usize>,
}

impl PlyBatch {
    /// Returns the number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows
    }

    /// Returns the number of the first row within its element, from 0.
    pub(crate) fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Returns the numbers of a property, one for each row, or the lists of all rows one after the other.
    /// Empty if the property is not wanted.
    pub(crate) fn scalars(&self, property: usize) -> &[f64] {
        self.columns.get(property).map_or(&[], |column| &column.values)
    }

    /// Returns the list of row `row`, counted from the start of the batch. Empty if the property does not
    /// exist or is not wanted.
    pub(crate) fn list(&self, property: usize, row: usize) -> &[f64] {
        let column = self.columns.get(property);
        column.and_then(|column| column.list(row)).unwrap_or_default()
    }

    pub(crate) fn clear(&mut self, first_row: u64, properties: usize) {
        self.first_row = first_row;
        self.rows = 0;
        self.lines.clear();
        self.columns.resize_with(properties, Column::default);
        for column in &mut self.columns {
            column.values.clear();
            column.ends.clear();
        }
    }
}

impl Column {
    fn list(&self, row: usize) -> Option<&[f64]> {
        let start = match row.checked_sub(1) {
            Some(before) => *self.ends.get(before)?,
            None => 0,
        };
        self.values.get(start..*self.ends.get(row)?)
    }
}

/// Returns a whole number as an integer.
pub(crate) fn integer(value: f64) -> Option<i64> {
    // `i64::MAX` as `f64` is one more than an `i64` holds.
    let fits =
        value.fract() == 0.0 && (-9_223_372_036_854_775_808.0..9_223_372_036_854_775_808.0).contains(&value);
    #[expect(clippy::cast_possible_truncation, reason = "it fits")]
    fits.then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers() {
        assert_eq!((integer(-3.0), integer(0.5), integer(f64::NAN)), (Some(-3), None, None));
        assert_eq!((integer(9_223_372_036_854_775_808.0), integer(f64::INFINITY)), (None, None));
    }
}
