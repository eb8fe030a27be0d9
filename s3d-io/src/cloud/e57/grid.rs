//! The attributes of a scan's points, and the scanner's grid. Source: ASTM E2807, "indexBounds".

use e57::{PointCloud, Record, RecordDataType, RecordName};

/// The place of an attribute among the values of a point.
pub(super) fn attribute_index(prototype: &[Record], name: &RecordName) -> Option<usize> {
    prototype.iter().position(|r| r.name == *name)
}

/// Returns the places of the row and the column of a point's grid among its values, and the least number of
/// each. Returns `None` if the scan does not state how large its grid is.
pub(super) fn grid_columns(cloud: &PointCloud) -> Option<[(usize, i64); 2]> {
    let row = attribute_index(&cloud.prototype, &RecordName::RowIndex)?;
    let column = attribute_index(&cloud.prototype, &RecordName::ColumnIndex)?;
    let [rows, columns] = index_ranges(cloud, [row, column])?;
    Some([(row, rows.0), (column, columns.0)])
}

/// Returns the least and the largest row and column of a scan's grid: as the scan states them, or else as
/// their types allow, if the points can fill such a grid.
fn index_ranges(cloud: &PointCloud, [row, column]: [usize; 2]) -> Option<[(i64, i64); 2]> {
    /// The most cells that a grid has for each point, if only its types tell how large it is.
    const MOST_CELLS_A_POINT: u64 = 16;
    let stated = cloud.index_bounds.as_ref().and_then(|bounds| {
        Some([(bounds.row_min?, bounds.row_max?), (bounds.column_min?, bounds.column_max?)])
    });
    let of_type = |i: usize| match cloud.prototype.get(i)?.data_type {
        RecordDataType::Integer { min, max } => Some((min, max)),
        _ => None,
    };
    stated.or_else(|| {
        let ranges = [of_type(row)?, of_type(column)?];
        let sides = ranges.map(|(min, max)| max.abs_diff(min).saturating_add(1));
        let cells = sides[0].saturating_mul(sides[1]);
        (cells <= cloud.records.saturating_mul(MOST_CELLS_A_POINT)).then_some(ranges)
    })
}

/// Returns the rows and columns of a scan's grid, if its points have indices of one.
pub(crate) fn grid_of(cloud: &PointCloud) -> Option<[u32; 2]> {
    let [(row, _), (column, _)] = grid_columns(cloud)?;
    let [rows, columns] = index_ranges(cloud, [row, column])?;
    let side = |(least, most): (i64, i64)| u32::try_from(most.checked_sub(least)?.checked_add(1)?).ok();
    let rows = side(rows)?;
    let columns = side(columns)?;
    (rows > 1 && columns > 1).then_some([rows, columns])
}

/// Returns whether the points of a scan have colours, and whether they have intensities.
pub(crate) fn has_color_and_intensity(cloud: &PointCloud) -> [bool; 2] {
    [RecordName::ColorRed, RecordName::Intensity]
        .map(|name| attribute_index(&cloud.prototype, &name).is_some())
}
