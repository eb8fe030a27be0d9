//! Which picture belongs to which scan location, and which to none.

use super::{E57Picture, E57Pictures};
use crate::camera::table::ScanLocation;
use s3d_geom::glam::DVec3;

/// The farthest that a picture may be from the location that it belongs to by place alone, metres.
const NEAR_M: f64 = 0.5;

/// How many pictures a sentence names.
const MAX_NAMED: usize = 5;

/// The pictures of scan locations.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct E57Owners {
    /// The numbers of the pictures of each location, in the order of the file.
    pub pictures: Vec<Vec<usize>>,
    /// What was not used and why, a sentence each.
    pub warnings: Vec<String>,
}

impl E57Pictures {
    /// Returns which pictures belong to each location. A picture that names a scan of the file belongs to
    /// the scan's location. Any other belongs to the nearest location within half a metre, or to none.
    pub fn of_locations(&self, locations: &[ScanLocation]) -> E57Owners {
        let mut pictures = vec![Vec::new(); locations.len()];
        let mut unused = self.unused.clone();
        for (number, picture) in self.pictures.iter().enumerate() {
            let owner = self.location_of_scan(picture, locations);
            let owner = owner.or_else(|| nearest(picture.pose.location, locations));
            match owner.and_then(|index| pictures.get_mut(index)) {
                Some(numbers) => numbers.push(number),
                None => {
                    unused.add("is not of a scan location, nor within 0.5 m of one", picture.name.clone())
                }
            }
        }

        let path = self.path.display();
        let warnings = unused
            .sentences()
            .map(|sentence| format!("{path}: {sentence}, left out"));
        E57Owners { pictures, warnings: warnings.collect() }
    }

    /// Returns the index of the location of the scan that a picture names.
    fn location_of_scan(&self, picture: &E57Picture, locations: &[ScanLocation]) -> Option<usize> {
        let uuid = self.scans.get(picture.scan.as_ref()?)?;
        locations.iter().position(|location| location.uuid == *uuid)
    }
}

/// Returns the index of the nearest location that is near enough. The first one wins a tie.
fn nearest(place: DVec3, locations: &[ScanLocation]) -> Option<usize> {
    let mut best = None;
    let mut least = NEAR_M;
    for (index, location) in locations.iter().enumerate() {
        let distance = location.pose.location.distance(place);
        if distance < least || distance == least && best.is_none() {
            least = distance;
            best = Some(index);
        }
    }
    best
}

/// Images that are of no use, by the reason.
#[derive(Clone, Debug, Default)]
pub(super) struct Unused(Vec<Reason>);

#[derive(Clone, Debug)]
struct Reason {
    /// What is said of one image.
    why: &'static str,
    names: Vec<String>,
}

impl Unused {
    pub(super) fn add(&mut self, why: &'static str, name: String) {
        match self.0.iter_mut().find(|reason| reason.why == why) {
            Some(reason) => reason.names.push(name),
            None => self.0.push(Reason { why, names: vec![name] }),
        }
    }

    /// Returns a sentence for each reason, without a full stop.
    pub(super) fn sentences(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(Reason::sentence)
    }
}

impl Reason {
    fn sentence(&self) -> String {
        let named: Vec<&str> = self.names.iter().take(MAX_NAMED).map(String::as_str).collect();
        let mut names = named.join(", ");
        let more = self.names.len() - named.len();
        if more > 0 {
            names += &format!(" and {more} more");
        }
        match self.names.len() {
            1 => format!("{names} {}", self.why),
            count => format!("each of {count} images {}: {names}", self.why),
        }
    }
}
