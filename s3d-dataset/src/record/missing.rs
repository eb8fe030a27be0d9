//! The units of work that a request still lacks.

use crate::record::journal::{Finished, Unit};
use crate::record::request::Request;

/// Returns the known units that a request still lacks. The units of an area's locations are known once its
/// labels are done.
pub(crate) fn missing_units(request: &Request, finished: &Finished) -> Vec<Unit> {
    let mut missing = Vec::new();
    for area in request.numbers() {
        let Some(labels) = finished.labels(area) else {
            missing.push(Unit::Labels(area));
            continue;
        };
        for uuid in &labels.locations {
            missing.push(Unit::Scores(area, uuid.clone()));
            if is_chosen(request, uuid) {
                missing.push(Unit::Location(area, uuid.clone()));
            }
        }
        let photographs = labels.photographs.iter().filter(|uuid| is_chosen(request, uuid));
        missing.extend(photographs.map(|uuid| Unit::Photograph(area, uuid.clone())));
        missing.push(Unit::Assets(area));
    }

    missing.retain(|unit| !finished.has(unit));
    missing
}

/// Returns whether a location's images were asked for.
pub(crate) fn is_chosen(request: &Request, uuid: &str) -> bool {
    let only = &request.options.only;
    only.is_empty() || only.iter().any(|o| o == uuid)
}
