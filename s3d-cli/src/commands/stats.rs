//! `s3d stats`: the tables of statistics of a data set, counted from its files.

use super::print;
use crate::args::StatsArgs;
use crate::failure::Outcome;
use crate::pipeline::manifest::Head;
use crate::pipeline::statistics::Statistics;
use s3d_io::Layout;

pub(crate) fn run(args: &StatsArgs) -> Outcome<()> {
    let layout = Layout::new(args.output.clone());
    let head = Head::require(&layout)?;
    print(&Statistics::count(&layout, &head.area_numbers)?.to_markdown())
}
