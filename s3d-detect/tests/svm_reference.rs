//! Compares machines with scikit-learn's `LinearSVC`. `reference/svm/reference.py` wrote its inputs and
//! objectives to `reference/svm/cases.json`.

use s3d_detect::svm::sparse::SparseRows;
use s3d_detect::svm::{Linear, Loss, SvmOptions, objective, train};
use serde::Deserialize;

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    x: Vec<Vec<f32>>,
    positive: Vec<bool>,
    costs: Vec<f64>,
    hinge: f64,
    squared_hinge: f64,
}

impl Case {
    fn rows(&self) -> SparseRows {
        let mut rows = SparseRows::new(self.x[0].len());
        self.x.iter().for_each(|row| rows.push(row));
        rows
    }
}

fn cases() -> Vec<Case> {
    let reference: Reference = serde_json::from_str(include_str!("reference/svm/cases.json")).unwrap();
    assert_eq!(reference.cases.len(), 3);
    reference.cases
}

#[test]
fn scikit_learn_gives_the_same_objectives_to_six_digits() {
    for (case, loss) in cases()
        .iter()
        .flat_map(|case| [Loss::Hinge, Loss::SquaredHinge].map(move |loss| (case, loss)))
    {
        let rows = case.rows();
        let options = SvmOptions { loss, tolerance: 1e-10, max_passes: 1_000_000, seed: 3 };
        let machine = train(&rows, &case.positive, &case.costs, &options);
        let ours = objective(&machine, &rows, &case.positive, &case.costs, loss);
        let theirs = if loss == Loss::Hinge {
            case.hinge
        } else {
            case.squared_hinge
        };
        assert!((ours - theirs).abs() <= 1e-6 * theirs, "{loss:?}: {ours}, scikit-learn {theirs}");

        // No machine near by is better.
        for column in 0..rows.width() {
            for step in [-1e-3, 1e-3] {
                let mut other = machine.clone();
                other.weights[column] += step;
                assert!(objective(&other, &rows, &case.positive, &case.costs, loss) > ours);
            }
        }
    }
}

#[test]
fn the_seed_decides_the_way_and_not_the_end() {
    let case = &cases()[0];
    let machine = |seed, max_passes| {
        let options = SvmOptions { tolerance: 1e-10, max_passes, seed, ..SvmOptions::default() };
        train(&case.rows(), &case.positive, &case.costs, &options)
    };
    assert_eq!(machine(1, 3), machine(1, 3));
    assert_ne!(machine(1, 3), machine(2, 3));
    let [one, other] = [1, 2].map(|seed| machine(seed, 1_000_000));
    let distance = one
        .weights
        .iter()
        .zip(&other.weights)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(distance < 1e-6, "{distance}");
}

#[test]
fn examples_without_cost_and_columns_left_out_do_not_count() {
    let case = &cases()[1];
    let all = case.rows();
    let half = case.x.len() / 2;
    let mut costs = case.costs.clone();
    costs[half..].fill(0.0);
    let options = SvmOptions { tolerance: 1e-10, max_passes: 1_000_000, ..SvmOptions::default() };
    let some = train(&all, &case.positive, &costs, &options);
    let part = all.select(0..half, &[]);
    let alone = train(&part, &case.positive[..half], &costs[..half], &options);
    assert!(
        some.weights
            .iter()
            .zip(&alone.weights)
            .all(|(a, b)| (a - b).abs() < 1e-6)
    );

    let masked = all.select(0..all.len(), std::slice::from_ref(&(2..5)));
    let without = train(&masked, &case.positive, &case.costs, &options);
    assert_eq!(without.weights[2..5], [0.0; 3]);
    assert_ne!(without, Linear::default());
}
