//! The names, versions and variants of the protocols.

use std::fmt;
use std::str::FromStr;
use thiserror::Error as ThisError;

/// A definition of how to compare predictions with a data set. [`crate::protocols`] describes each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Protocol {
    /// Average precision of 3D boxes, like the indoor evaluation of mmdetection3d.
    Det,
    /// Semantic segmentation of points, like Pointcept.
    Sem3d,
    /// Average precision of instances of points, like ScanNet's script in the form of Pointcept.
    InstAp,
    /// Coverage, precision and recall of instances of points, like ASIS.
    InstCov,
    /// Semantic segmentation of panoramas, like HoHoNet.
    SemPano,
    /// Semantic segmentation of views, like CMX.
    SemView,
    /// Boundaries of classes in images, like DAVIS.
    SemEdge,
    /// Depth of panoramas, like HoHoNet or UniFuse, or of any images, like Marigold.
    Depth,
    /// Boundaries in depth, like Depth Pro.
    DepthEdge,
    /// Surface normals of images, like DSINE or Omnidata.
    Normal,
    /// Panoptic quality of images, like panopticapi.
    Panoptic,
    /// Panoptic quality of points, like SuperCluster.
    Panoptic3d,
}

/// A protocol with its name, its version and its variants. The first variant is the default.
type Entry = (Protocol, &'static str, u32, &'static [&'static str]);

const DEPTH: [&str; 5] = ["hohonet", "unifuse", "marigold", "marigold-disparity", "marigold-metric"];

const PROTOCOLS: [Entry; 12] = [
    (Protocol::Det, "det", 2, &["mmdetection3d", "open3d-ml"]),
    (Protocol::Sem3d, "sem3d", 1, &["pointcept", "nanmean"]),
    (Protocol::InstAp, "inst-ap", 1, &["pointcept"]),
    (Protocol::InstCov, "inst-cov", 1, &["asis"]),
    (Protocol::SemPano, "sem-pano", 1, &["hohonet"]),
    (Protocol::SemView, "sem-view", 1, &["cmx"]),
    (Protocol::SemEdge, "sem-edge", 1, &["davis"]),
    (Protocol::Depth, "depth", 1, &DEPTH),
    (Protocol::DepthEdge, "depth-edge", 1, &["depth-pro"]),
    (Protocol::Normal, "normal", 1, &["dsine", "omnidata"]),
    (Protocol::Panoptic, "panoptic", 1, &["panopticapi"]),
    (Protocol::Panoptic3d, "panoptic3d", 1, &["supercluster"]),
];

impl Protocol {
    /// Returns all protocols.
    pub fn all() -> impl Iterator<Item = Self> {
        PROTOCOLS.into_iter().map(|(protocol, ..)| protocol)
    }

    fn entry(self) -> Entry {
        // The table has the order of the enum.
        PROTOCOLS[self as usize]
    }

    /// Returns its name, such as `sem3d`.
    pub fn name(self) -> &'static str {
        self.entry().1
    }

    /// Returns the version of its definition.
    pub fn version(self) -> u32 {
        self.entry().2
    }

    /// Returns the names of its variants, the default first.
    pub fn variants(self) -> &'static [&'static str] {
        self.entry().3
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that names no protocol.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[error("no protocol is called {:?}: {} are", .0, names())]
pub struct UnknownProtocol(String);

fn names() -> String {
    let names: Vec<&str> = Protocol::all().map(Protocol::name).collect();
    names.join(", ")
}

impl FromStr for Protocol {
    type Err = UnknownProtocol;

    fn from_str(word: &str) -> Result<Self, UnknownProtocol> {
        Self::all()
            .find(|p| p.name() == word)
            .ok_or_else(|| UnknownProtocol(word.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_protocols() {
        for protocol in Protocol::all() {
            assert_eq!(protocol.to_string().parse(), Ok(protocol));
            assert!(!protocol.variants().is_empty());
        }
        let message = "sem2d".parse::<Protocol>().unwrap_err().to_string();
        assert!(Protocol::all().all(|p| message.contains(p.name())), "{message}");
    }
}
