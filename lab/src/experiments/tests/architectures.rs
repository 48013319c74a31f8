//! What delay does to each architecture, and each at its best.

use super::*;

#[test]
fn delay_by_replay_injects_no_energy() {
    let done = Done::of(&delay::DELAY, 2500);
    let replay = done.rows("delay.csv", &[("architecture", "mmt-replay")]);
    assert!(
        replay
            .iter()
            .all(|row| number(row, "energy_injected_j") == 0.0)
    );
    let snap = done.rows("delay.csv", &[("architecture", "mmt-snap")]);
    assert!(
        snap.iter()
            .any(|row| number(row, "energy_injected_j") > 0.0)
    );
}

/// Equal budgets, the choice by the tuning seeds alone, and seeds that judge and tuned nothing.
#[test]
fn tuned_chooses_the_least_error_of_those_that_keep_contact_and_judges_on_other_seeds() {
    let done = Done::of(&delay::TUNED, 2000);
    let tried = done.rows("tuned-choices.csv", &[]);
    assert_eq!(tried.len(), 9 * 9 * 6);
    for chosen in tried.iter().filter(|row| row["is_chosen"] == "1") {
        let here = |row: &&Row| {
            ["architecture", "one_way_ms"]
                .iter()
                .all(|key| row[*key] == chosen[*key])
        };
        let kept = |row: &&Row| {
            row["breaks_per_push"]
                .parse()
                .is_ok_and(|breaks: f64| breaks <= 2.0)
        };
        let errors = |row: &Row| row["relative_error"].parse().unwrap_or(f64::MAX);
        let rows: Vec<&Row> = tried.iter().filter(here).collect();
        let any_kept = rows.iter().any(&kept);
        let allowed = rows.iter().filter(|row| !any_kept || kept(row));
        let least = allowed.map(|row| errors(row)).fold(f64::MAX, f64::min);
        assert_eq!(errors(chosen), least, "{chosen:?}");
    }
    let judged = done.rows("tuned.csv", &[]);
    assert!(judged.iter().all(|row| row["seed"] == "20001"));
    let tuned = judged.iter().filter(|row| row["is_tuned"] == "1");
    assert_eq!(tuned.count(), 9 * 9);
}
