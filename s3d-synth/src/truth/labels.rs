//! The scores of labels of a mesh.

use super::{NEAR_M, Truth, sampled};
use s3d_geom::TriMesh;
use s3d_label::Class;
use std::collections::BTreeMap;

/// How well the labels of a mesh's faces agree with the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelScores {
    /// The intersection over union of each class of the scene that the mesh shows, by surface, 0 to 1.
    pub iou: BTreeMap<Class, f64>,
    /// The mean of `iou`; NaN if it is empty.
    pub mean_iou: f64,
    /// The share of the mesh, where it is near the scene, whose label is right, 0 to 1.
    pub accuracy: f64,
    /// The share of the mesh, where it is near the scene, that has no label.
    pub unlabelled: f64,
}

impl Truth<'_> {
    /// Compares labels of a mesh's faces with the classes of the scene. Samples of the mesh within 5 cm of
    /// the scene count, and the nearest face of the scene has the right class. A face without a label,
    /// `None`, is wrong.
    ///
    /// ```
    /// use s3d_synth::Building;
    /// use s3d_synth::device::ScanTarget;
    /// use s3d_synth::truth::{Truth, TruthOptions};
    ///
    /// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
    /// let target = ScanTarget::new(&scene);
    /// let options = TruthOptions { samples_per_m2: 20.0, ..TruthOptions::default() };
    /// let truth = Truth::new(&target, &[], &options)?;
    /// // The scene's own labels are right.
    /// let class = |instance: &u32| Some(scene.instances[*instance as usize].class);
    /// let classes: Vec<_> = scene.instance_of_face.iter().map(class).collect();
    /// let scores = truth.score_labels(&scene.mesh, &classes);
    /// assert!(scores.mean_iou > 0.99 && scores.iou.len() == 13);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    /// If there is not one class for each face.
    pub fn score_labels(&self, mesh: &TriMesh, class_of_face: &[Option<Class>]) -> LabelScores {
        assert_eq!(class_of_face.len(), mesh.faces().len(), "a class for each face");
        let drawn = sampled(mesh, &self.options);
        let mut to_truth = Vec::new();
        self.nearest.nearest_many(&drawn.positions, &mut to_truth);

        // Right, of the scene, of the mesh.
        let mut counts: BTreeMap<Class, [usize; 3]> = BTreeMap::new();
        let [mut all, mut right, mut unlabelled] = [0_usize; 3];
        for (face, nearest) in drawn.faces.iter().zip(&to_truth) {
            if nearest.distance_m > NEAR_M {
                continue;
            }
            let instance = self.scene.instance_of_face[nearest.face as usize];
            let truth = self.scene.instances[instance as usize].class;
            let found = class_of_face[*face as usize];
            all += 1;
            right += usize::from(found == Some(truth));
            unlabelled += usize::from(found.is_none());
            let of_truth = counts.entry(truth).or_default();
            of_truth[0] += usize::from(found == Some(truth));
            of_truth[1] += 1;
            if let Some(found) = found {
                counts.entry(found).or_default()[2] += 1;
            }
        }

        let shown = counts.into_iter().filter(|(_, [_, of_truth, _])| *of_truth > 0);
        let iou = |[both, of_truth, of_mesh]: [usize; 3]| both as f64 / (of_truth + of_mesh - both) as f64;
        let iou: BTreeMap<Class, f64> = shown.map(|(class, counts)| (class, iou(counts))).collect();
        LabelScores {
            mean_iou: iou.values().sum::<f64>() / iou.len() as f64,
            iou,
            accuracy: right as f64 / all.max(1) as f64,
            unlabelled: unlabelled as f64 / all.max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Building;
    use crate::device::ScanTarget;
    use crate::truth::TruthOptions;

    #[test]
    fn a_class_that_is_taken_for_another_costs_both() {
        let scene = Building { texture_scale: 0.05, ..Building::demo() }.build().unwrap();
        let target = ScanTarget::new(&scene);
        let truth = Truth::new(&target, &[], &TruthOptions::default()).unwrap();
        let class_of = |instance: &u32| match scene.instances[*instance as usize].class {
            Class::CEILING => Some(Class::FLOOR),
            Class::CHAIR => None,
            class => Some(class),
        };
        let classes: Vec<_> = scene.instance_of_face.iter().map(class_of).collect();
        let scores = truth.score_labels(&scene.mesh, &classes);
        assert!(scores.iou[&Class::CEILING] == 0.0 && scores.iou[&Class::CHAIR] == 0.0);
        // Floor and ceiling are about as large.
        assert!((0.4..0.6).contains(&scores.iou[&Class::FLOOR]), "{scores:?}");
        assert!(scores.iou[&Class::WALL] > 0.98 && scores.mean_iou < 0.85, "{scores:?}");
        assert!(scores.unlabelled > 0.005 && scores.accuracy + scores.unlabelled < 0.9, "{scores:?}");
    }
}
