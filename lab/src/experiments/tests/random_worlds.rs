//! Random worlds: the promises hold in each, and a world is a function of its number.

use super::*;

#[test]
fn each_random_world_is_a_row_keeps_the_promises_and_is_the_same_by_its_number() {
    let done = Done::of_seeds(&worlds::EXPERIMENT, 4, 5000);
    let rows = done.rows("worlds.csv", &[]);
    let numbers: Vec<f64> = rows.iter().map(|row| number(row, "world")).collect();
    let first = numbers[0];
    assert_eq!(numbers, [0.0, 1.0, 2.0, 3.0].map(|n| first + n));
    for row in &rows {
        assert_eq!(row["broken"], "", "{row:?}");
        assert!(number(row, "work_excess_j") <= 1e-6, "{row:?}");
        assert!(number(row, "injected_j") <= 1e-6, "{row:?}");
    }
    let touched = rows.iter().filter(|row| number(row, "contact_s") > 0.5);
    assert!(touched.count() >= 2, "without contact nothing is promised");
    let one = BTreeMap::from([("world", first + 2.0)]);
    let again = Done::given(&worlds::EXPERIMENT, 1000, 5000, one);
    assert_eq!(again.rows("worlds.csv", &[]), [rows[2].clone()]);
    let stiff = BTreeMap::from([("world", first + 2.0), ("stiff-tool", 0.0)]);
    let stiff = Done::given(&worlds::EXPERIMENT, 1000, 5000, stiff);
    assert_ne!(stiff.findings.digest, again.findings.digest);
}
