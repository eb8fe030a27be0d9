//! Pairs of images that see the same surface, as files of the report.

use super::{Content, VIEWS_PER_FILE, Written, key_of};
use crate::faults::Faults;
use crate::relations::{Graph, Member, Pairs, Partner, Place, check};
use crate::script::Scripts;
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, Result};
use s3d_io::dataset::PairColumns;
use s3d_render::Scene;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

impl Content<'_> {
    /// Reads the pairs of an area. `None` if there are none, or if their file is wrong, which becomes a
    /// fault.
    pub(super) fn pairs(&self, area: u32, faults: &mut Faults) -> Result<Option<PairColumns>> {
        let layout = self.data.layout();
        let read = self.data.pairs(area).and_then(|columns| {
            let images = self.data.images(area);
            let names: BTreeSet<String> = images.iter().map(|image| image.pair_name()).collect();
            if let Some(columns) = &columns {
                check(&layout.pairs_npz(area), columns, |name| names.contains(name))?;
            }
            Ok(columns)
        });
        Ok(faults.keep(layout.root(), read)?.flatten())
    }

    /// Returns the places of the views of an area in `views`.
    pub(super) fn views_of(&self, area: u32) -> Range<usize> {
        let first = self.views.partition_point(|view| view.area < area);
        let of_area = self.views.get(first..).unwrap_or_default();
        first..first + of_area.partition_point(|view| view.area == area)
    }

    /// Writes the partners of the views of an area, and its graph. The area's pictures are written: they have
    /// the cameras.
    pub(super) fn write_pairs(
        &self,
        ctx: &Context,
        (area, scene): (u32, Option<&Scene<'_>>),
        columns: &PairColumns,
        scripts: &Scripts,
        written: &mut Written,
    ) -> Result<()> {
        let members = self.members(area, written);
        let pairs = Pairs::new(columns, &members);

        // An image that is not shown has no partners.
        let shown = self.shown();
        let of_area = self.views_of(area);
        let of_area = self.views.get(of_area).unwrap_or_default();
        let chunks: Vec<_> = of_area.chunks(VIEWS_PER_FILE).collect();
        let files = map_in_order(
            ctx,
            &chunks,
            || (),
            |(), images| {
                let places: Vec<_> = images.iter().filter_map(|image| shown.get(&key_of(image))).collect();
                let mut partners: Vec<Vec<Partner>> = Vec::with_capacity(places.len());
                for place in &places {
                    ctx.check()?;
                    partners.push(pairs.partners(**place, scene));
                }
                let file = places.first().map_or(0, |place| place.number() / VIEWS_PER_FILE);
                scripts.write(&format!("pairs_{file}"), &partners)
            },
        )?;

        let graph = scripts.write_list(&format!("graph_{area}"), &Graph::new(&pairs))?;
        written.bytes += files.into_iter().sum::<u64>() + graph;
        written.pairs.push(area);
        Ok(())
    }

    /// Returns the images of an area that are shown, by their names in the file of pairs.
    fn members<'w>(&self, area: u32, written: &'w Written) -> BTreeMap<String, Member<'w>> {
        let shown = self.shown();
        let panoramas = self.panoramas.iter().map(|(_, image)| image).zip(&written.panoramas);
        let images = panoramas.chain(self.views.iter().zip(&written.views));
        let members = images.filter(|(image, made)| image.area == area && made.seen.is_some());
        let members = members.filter_map(|(image, made)| {
            let shown = *shown.get(&key_of(image))?;
            // A photograph that is no panorama has no location.
            let place = match self.location_of(area, &image.uuid) {
                Some(location) => Place::Location(location),
                None => Place::Picture(shown.number()),
            };
            Some((image.pair_name(), Member { shown, place, camera: made.camera.as_ref() }))
        });
        members.collect()
    }
}
