//! How the options of a call are named in messages.

/// How the users of a program write the options of a call.
///
/// An error holds the name of an option as the field of the options struct has it, such as `overwrite` or
/// `points_per_m2`. A command line writes it as a flag, a Python module as an argument.
///
/// ```
/// use s3d_dataset::error::{OptionNames, UsageError};
///
/// struct Flags;
///
/// impl OptionNames for Flags {
///     fn option(&self, name: &str, value: Option<&str>) -> String {
///         let flag = format!("--{}", name.replace('_', "-"));
///         value.map_or(flag.clone(), |value| format!("{flag} {value}"))
///     }
/// }
///
/// let error = UsageError::Exists { path: "points.ply".into(), note: None };
/// assert_eq!(error.to_string(), "points.ply is there already: replace it with `overwrite`");
/// assert_eq!(error.message(&Flags), "points.ply is there already: replace it with --overwrite");
/// ```
pub trait OptionNames {
    /// Returns the option `name`, set to `value` if there is one, as a user writes it.
    fn option(&self, name: &str, value: Option<&str>) -> String;
}

/// The names of the fields of the options structs: `` `overwrite` ``, `` `fill = 0.1` ``.
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldNames;

impl OptionNames for FieldNames {
    fn option(&self, name: &str, value: Option<&str>) -> String {
        match value {
            Some(value) => format!("`{name} = {value}`"),
            None => format!("`{name}`"),
        }
    }
}
