//! What is wanted of the rows of a table: labels, or what a scanner measured.

use crate::cloud::annotations::AnnotationOptions;

/// What a reader of tables looks for beside positions and colours.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wanted<'a> {
    /// Classes, and perhaps instances and rooms.
    Annotations(&'a AnnotationOptions),
    /// Intensities, times and cells of the scanner's grid, as far as there are some. The names are those of
    /// the columns, in order, of a table that does not name them; there may be none.
    Measurements(&'a [String]),
}

impl<'a> From<&'a AnnotationOptions> for Wanted<'a> {
    fn from(options: &'a AnnotationOptions) -> Self {
        Self::Annotations(options)
    }
}

impl<'a> Wanted<'a> {
    /// Returns the options of annotations, if these are wanted.
    pub(crate) fn annotations(self) -> Option<&'a AnnotationOptions> {
        match self {
            Self::Annotations(options) => Some(options),
            Self::Measurements(_) => None,
        }
    }

    /// Returns the names of the columns that the user gives.
    pub(crate) fn columns(self) -> &'a [String] {
        match self {
            Self::Annotations(options) => &options.columns,
            Self::Measurements(columns) => columns,
        }
    }

    /// Returns where the user writes the names of columns, for messages.
    pub(crate) fn place_of_columns(self) -> &'static str {
        match self {
            Self::Annotations(_) => " in [annotations]",
            Self::Measurements(_) => "",
        }
    }
}

/// Returns names of columns as a user would write them, for messages.
pub(crate) fn columns_like(wanted: Wanted<'_>) -> &'static str {
    match wanted {
        Wanted::Annotations(_) => r#""x", "y", "z", "r", "g", "b", "class", "instance""#,
        Wanted::Measurements(_) => r#""x", "y", "z", "intensity", "r", "g", "b""#,
    }
}

/// Returns the usual names of columns that a table of measurements does not name, by their number.
pub(crate) fn usual_names(width: usize) -> Option<Vec<String>> {
    let names = match width {
        3 => "x y z",
        4 => "x y z intensity",
        6 => "x y z r g b",
        7 => "x y z intensity r g b",
        _ => return None,
    };
    Some(names.split(' ').map(str::to_owned).collect())
}
