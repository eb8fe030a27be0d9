//! How a scene is labelled, in options.

use crate::outputs::{OutputFormat, OutputOptions};
use crate::segments::SegmentOptions;
use std::path::PathBuf;

/// How a scene is labelled. With the feature `clap` it is a group of arguments of a command line.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct LabelOptions {
    /// The folder of the labels [default: beside the scene, NAME.labels]
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "scan.labels"))]
    pub output: Option<PathBuf>,
    /// Labels of a network or of somebody else, as proposals: NPY, NPZ or TXT with a class for each face or
    /// vertex, points with labels, or a folder of masks of photographs. May be given several times.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub proposals: Vec<PathBuf>,
    /// Begin with the labels of an earlier mesh of the same place, which are carried over by votes.
    #[cfg_attr(feature = "clap", arg(long, num_args = 2, value_names = ["OLD_SCENE", "OLD.labels"]))]
    pub carry_over: Vec<PathBuf>,
    /// Print the address of the page, and open no browser.
    #[cfg_attr(feature = "clap", arg(long))]
    pub no_open: bool,
    /// The port of the page on 127.0.0.1; 0: any that is free.
    #[cfg_attr(feature = "clap", arg(long, default_value_t = 0))]
    pub port: u16,
    /// Write the labels for other programs instead of opening the page.
    #[cfg_attr(feature = "clap", arg(long, value_enum, value_name = "FORMAT"))]
    pub write: Option<OutputFormat>,
    /// Where they are written [default: beside the labels]
    #[cfg_attr(feature = "clap", arg(long, value_name = "PATH", requires = "write"))]
    pub to: Option<PathBuf>,
    /// How they are written.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub outputs: OutputOptions,
    /// How the mesh is cut into patches.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub segments: SegmentOptions,
}
