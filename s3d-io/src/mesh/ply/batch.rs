//! Some rows of an element of a PLY file, column by column.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

/// Rows of one element, a column a property. Columns that are not wanted are empty.
#[derive(Debug, Default)]
pub(crate) struct PlyBatch {
    first_row: u64,
    pub(crate) rows: usize,
    pub(crate) columns: Vec<Column>,
    /// The line of each row, in ASCII files.
    pub(crate) lines: Vec<u64>,
}

#[derive(Debug, Default)]
pub(crate) struct Column {
    pub(crate) values: Vec<f64>,
    /// Where the list of each row ends; of single numbers nothing.
    pub(crate) ends: Vec<usize>,
}

impl PlyBatch {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows
    }

    /// The number, from 0, that the first row has in its element.
    pub(crate) fn first_row(&self) -> u64 {
        self.first_row
    }

    /// The numbers of a property, one a row; of a list property, all of all rows; none of one that is not
    /// wanted.
    pub(crate) fn scalars(&self, property: usize) -> &[f64] {
        self.columns.get(property).map_or(&[], |column| &column.values)
    }

    /// The list of row `row`, counted from the first of the batch; empty for a property that is none or not
    /// wanted.
    pub(crate) fn list(&self, property: usize, row: usize) -> &[f64] {
        let list = |Column { values, ends }: &'_ Column| {
            let start = row.checked_sub(1).map_or(Some(0), |before| ends.get(before).copied())?;
            Some(start..*ends.get(row)?).filter(|range| range.end <= values.len())
        };
        let column = self.columns.get(property);
        column.and_then(|c| c.values.get(list(c)?)).unwrap_or_default()
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

/// The whole number that `value` is.
pub(crate) fn integer(value: f64) -> Option<i64> {
    // i64::MAX as f64 is one more than an i64 holds.
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
