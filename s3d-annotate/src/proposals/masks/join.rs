//! Joins the instances of single images to instances of the scene: each image numbers its own.
//!
//! Images come one after another. A mask of an image is joined to each instance of its class of whose faces
//! that the image sees, by area, more than half lie in the mask. Instances that are joined by a mask become
//! one, but for instances that an earlier image shows as two: then the mask goes to the one with which it
//! shares the larger area. A mask without an instance is a new one. What an image does not see says nothing,
//! so an instance grows from image to image. Each face belongs to the instance with most pixels on it.

use super::super::Key;
use s3d_geom::TriMesh;
use s3d_label::Class;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Stands for "no instance".
const NONE: u32 = u32::MAX;

/// The instances of the images so far.
pub(super) struct Instances<'m> {
    mesh: &'m TriMesh,
    class_of: Vec<Class>,
    /// The instance that each one is joined to, or itself: the first of those that are one.
    joined: Vec<u32>,
    /// For each face the instance with most pixels; [`NONE`] without one. Empty before the first image.
    of_face: Vec<u32>,
    pixels: HashMap<(u32, u32), u32>,
    /// Pairs that an image shows as two, the lower number first.
    apart: BTreeSet<(u32, u32)>,
}

impl<'m> Instances<'m> {
    pub(super) fn new(mesh: &'m TriMesh) -> Self {
        let (class_of, joined, of_face) = Default::default();
        Self { mesh, class_of, joined, of_face, pixels: HashMap::new(), apart: BTreeSet::new() }
    }

    /// Adds the masks of an image, by class and number: their faces and the pixels on them. `visible` are all
    /// faces that the image sees, ascending.
    pub(super) fn add(&mut self, visible: &[u32], masks: BTreeMap<(Class, u32), Vec<(u32, u32)>>) {
        self.of_face.resize(self.mesh.faces().len(), NONE);
        let mut seen_m2: BTreeMap<u32, f64> = BTreeMap::new();
        for face in visible {
            if let Some(instance) = self.instance_of(*face) {
                *seen_m2.entry(instance).or_insert(0.0) += self.mesh.area(*face);
            }
        }

        // All masks are held against the instances before this image.
        let masks: Vec<(Class, Vec<(u32, u32)>)> =
            masks.into_iter().map(|((class, _), faces)| (class, faces)).collect();
        let found: Vec<Vec<u32>> = masks
            .iter()
            .map(|(class, faces)| self.alike(*class, faces, &seen_m2))
            .collect();
        let mut shown: Vec<u32> = Vec::new();
        for ((class, faces), alike) in masks.iter().zip(found) {
            let instance = self.join(&alike, &shown).unwrap_or_else(|| {
                self.class_of.push(*class);
                self.joined.push(self.joined.len() as u32);
                self.joined.len() as u32 - 1
            });
            shown.push(instance);
            for (face, pixels) in faces {
                *self.pixels.entry((*face, instance)).or_insert(0) += pixels;
            }
        }
        let shown: BTreeSet<u32> = shown.into_iter().map(|instance| self.first(instance)).collect();
        for (place, a) in shown.iter().enumerate() {
            self.apart.extend(shown.iter().skip(place + 1).map(|b| (*a, *b)));
        }
        for (_, faces) in &masks {
            faces.iter().for_each(|(face, _)| self.settle(*face, &shown));
        }
    }

    /// Returns the instances of a class that lie in a mask, as far as the image sees them: the largest shared
    /// area first.
    fn alike(&self, class: Class, faces: &[(u32, u32)], seen_m2: &BTreeMap<u32, f64>) -> Vec<u32> {
        let mut shared_m2: BTreeMap<u32, f64> = BTreeMap::new();
        for (face, _) in faces {
            if let Some(instance) = self.instance_of(*face) {
                *shared_m2.entry(instance).or_insert(0.0) += self.mesh.area(*face);
            }
        }
        let is_alike = |(instance, shared): &(u32, f64)| {
            self.class_of.get(*instance as usize) == Some(&class)
                && seen_m2.get(instance).is_some_and(|seen| 2.0 * shared > *seen)
        };
        let mut alike: Vec<(u32, f64)> = shared_m2.into_iter().filter(is_alike).collect();
        alike.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        alike.into_iter().map(|(instance, _)| instance).collect()
    }

    /// Makes one instance of those that may be one, in their order, and returns it. `shown` are those of
    /// other masks of the same image.
    fn join(&mut self, alike: &[u32], shown: &[u32]) -> Option<u32> {
        let mut whole: Option<u32> = None;
        for &instance in alike {
            let instance = self.first(instance);
            let Some(other) = whole else {
                whole = (!shown.contains(&instance)).then_some(instance);
                continue;
            };
            let [low, high] = [other.min(instance), other.max(instance)];
            if low == high || shown.contains(&instance) || self.apart.contains(&(low, high)) {
                continue;
            }
            if let Some(joined) = self.joined.get_mut(high as usize) {
                *joined = low;
            }
            // What is apart from one of them is apart from both.
            let other = |&(a, b): &(u32, u32)| [(a, b), (b, a)].iter().find(|p| p.0 == high).map(|p| p.1);
            let others: Vec<u32> = self.apart.iter().filter_map(other).collect();
            self.apart
                .extend(others.into_iter().map(|other| (low.min(other), low.max(other))));
            whole = Some(low);
        }
        whole
    }

    /// Returns the instance that an instance has become.
    fn first(&self, mut instance: u32) -> u32 {
        while let Some(&joined) = self.joined.get(instance as usize)
            && joined != instance
        {
            instance = joined;
        }
        instance
    }

    fn instance_of(&self, face: u32) -> Option<u32> {
        let instance = self
            .of_face
            .get(face as usize)
            .copied()
            .filter(|instance| *instance != NONE)?;
        Some(self.first(instance))
    }

    /// Gives a face to the instance with most pixels: the one it has, or one of those in the last image.
    fn settle(&mut self, face: u32, shown: &BTreeSet<u32>) {
        let pixels = |instance: u32| self.pixels.get(&(face, instance)).copied().unwrap_or(0);
        let now = self
            .of_face
            .get(face as usize)
            .copied()
            .filter(|instance| *instance != NONE);
        let mut best = now.map(|instance| (pixels(instance), instance));
        for instance in shown {
            let count = pixels(*instance);
            if count > 0 && best.is_none_or(|(most, _)| count > most) {
                best = Some((count, *instance));
            }
        }
        if let Some(place) = self.of_face.get_mut(face as usize) {
            *place = best.map_or(NONE, |(_, instance)| instance);
        }
    }

    /// Returns the pixels of each face and instance, in any order. Instances are counted from 1.
    pub(super) fn finish(self) -> Vec<(u32, Key, u32)> {
        let mut sums: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for ((face, instance), pixels) in &self.pixels {
            *sums.entry((*face, self.first(*instance))).or_insert(0) += pixels;
        }
        let key = |instance: u32| {
            let class = self.class_of.get(instance as usize).copied();
            class.map(|class| (class, Some(i64::from(instance) + 1)))
        };
        let votes = sums.into_iter();
        votes
            .filter_map(|((face, instance), pixels)| Some((face, key(instance)?, pixels)))
            .collect()
    }
}
