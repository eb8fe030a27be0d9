//! How much of a mesh's surface is seen by scan locations.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How much surface is seen, m². A surface is seen if its front is seen from at most 10 m, and not edge-on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SurfaceSeen {
    /// The whole surface.
    pub(crate) surface_m2: f64,
    /// The surface that is seen from any possible location.
    pub(crate) visible_m2: f64,
    /// The surface that is seen by at least one, two and three locations.
    pub(crate) seen_m2: [f64; 3],
}

impl fmt::Display for SurfaceSeen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { surface_m2, visible_m2, seen_m2 } = self;
        let [one, two, three] = seen_m2.map(|m2| 100.0 * m2 / visible_m2);
        write!(
            f,
            "of {visible_m2:.1} m² that can be seen from somewhere ({surface_m2:.1} m² in all), {one:.0} % \
             is seen by one or more, {two:.0} % by two or more, {three:.0} % by three or more"
        )
    }
}
