//! The options of calls as flags of the command line.

use s3d_dataset::error::OptionNames;

/// Names options in messages as their flags: `--points-per-m2`, `--only UUID`.
pub(crate) struct Flags;

impl OptionNames for Flags {
    fn option(&self, name: &str, value: Option<&str>) -> String {
        let flag = match (name, value) {
            ("normals", Some("smooth")) => return "--smooth-normals".to_owned(),
            ("output", None) => return "-o".to_owned(),
            ("normals", _) => "--smooth-normals".to_owned(),
            ("profiles", _) => "--profile".to_owned(),
            _ => format!("--{}", name.replace('_', "-")),
        };
        match value {
            Some(value) => format!("{flag} {value}"),
            None => flag,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_named_as_they_are_typed() {
        assert_eq!(Flags.option("points_per_m2", None), "--points-per-m2");
        assert_eq!(Flags.option("allow", Some("colour")), "--allow colour");
        assert_eq!(Flags.option("normals", Some("smooth")), "--smooth-normals");
        assert_eq!(Flags.option("profiles", Some("pointnet")), "--profile pointnet");
        assert_eq!(Flags.option("output", None), "-o");
    }
}
