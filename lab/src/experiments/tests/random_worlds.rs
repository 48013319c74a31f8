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
        // the tool goes where the hand is, and is held back by what does not move only
        if number(row, "contact_s") > 0.5 && row["obstacle"] == "none" {
            let moves = number(row, "friction_n") < 8.0;
            let held_back = number(row, "unpaired_share") > 0.1;
            assert_ne!(held_back, moves, "{row:?}");
        }
    }
    let touched = rows.iter().filter(|row| number(row, "contact_s") > 0.5);
    assert!(touched.count() >= 2, "without contact nothing is promised");
    let from = BTreeMap::from([("first", first + 1.0)]);
    let from = Done::given(&worlds::EXPERIMENT, 2, 5000, from);
    assert_eq!(from.rows("worlds.csv", &[]), rows[1..3]);
    let stiff = BTreeMap::from([("stiff-tool", 1.0)]);
    let stiff = Done::given(&worlds::EXPERIMENT, 2, 5000, stiff);
    let worst = stiff.findings.tables.last().unwrap().to_string();
    let again = format!("mmt reproduce worlds --world {first} --stiff-tool --duration 5000ms");
    assert!(worst.contains(&again), "{worst}");
    let one = BTreeMap::from([("world", first + 2.0)]);
    let again = Done::given(&worlds::EXPERIMENT, 1000, 5000, one);
    assert_eq!(again.rows("worlds.csv", &[]), [rows[2].clone()]);
    let stiff = BTreeMap::from([("world", first + 2.0), ("stiff-tool", 0.0)]);
    let stiff = Done::given(&worlds::EXPERIMENT, 1000, 5000, stiff);
    assert_ne!(stiff.findings.digest, again.findings.digest);
}

#[test]
fn with_one_thing_ideal_the_worlds_are_the_same_ones_and_the_whole_truth_is_best() {
    let given = BTreeMap::from([("ideal", 0.0)]);
    let done = Done::given(&worlds::EXPERIMENT, 8, 8000, given);
    let rows = done.rows("worlds-ideal.csv", &[]);
    let errors: Vec<f64> = rows.iter().map(|row| number(row, "median")).collect();
    let drawn = Done::of_seeds(&worlds::EXPERIMENT, 8, 8000);
    let drawn = drawn.rows("worlds.csv", &[]);
    let mut errors_drawn: Vec<f64> = drawn
        .iter()
        .filter(|row| number(row, "friction_n") < 8.0)
        .filter_map(|row| row["relative_error_true"].parse().ok())
        .collect();
    errors_drawn.sort_by(f64::total_cmp);
    assert_eq!(errors_drawn.len() as f64, number(&rows[0], "worlds"));
    assert_eq!(errors[0], errors_drawn[(errors_drawn.len() - 1) / 2]);
    // the true numbers from the beginning on, in each update and in every tick
    let (others, whole_truth) = errors.split_at(errors.len() - 2);
    for best in whole_truth {
        assert!(others.iter().all(|error| error > best), "{errors:?}");
    }
}

#[test]
fn a_tool_that_trembles_at_its_limit_does_not_spend_more_than_the_budget() {
    // a contact of ten times k_p behind a sensor that lags by 5 ms: the force swung by 9 N, and took 0.5 J
    let one = BTreeMap::from([("world", 70_958.0)]);
    let rows = Done::given(&worlds::EXPERIMENT, 1, 20_000, one).rows("worlds.csv", &[]);
    println!("{:?}", rows[0]);
    assert!(number(&rows[0], "work_excess_j") <= 1e-6);
}

#[test]
fn the_sign_of_the_force_is_not_judged_for_a_round_trip_after_another_body_is_touched() {
    // the tool goes straight from one body to another, and for 0.35 s the hand feels the first
    let one = BTreeMap::from([("world", 92_907.0)]);
    let rows = Done::given(&worlds::EXPERIMENT, 1, 20_000, one).rows("worlds.csv", &[]);
    println!("{:?}", rows[0]);
    assert!(number(&rows[0], "opposed_share") < 0.01);
}

#[test]
fn a_bias_that_first_shows_after_a_contact_makes_no_contact_in_free_space_and_no_face_there() {
    let one = BTreeMap::from([("world", 94_713.0)]);
    let rows = Done::given(&worlds::EXPERIMENT, 1, 20_000, one).rows("worlds.csv", &[]);
    println!("{:?}", rows[0]);
    assert!(number(&rows[0], "breaks_per_push") < 2.0);
    assert!(number(&rows[0], "pose_max_mm") < 10.0);
}
