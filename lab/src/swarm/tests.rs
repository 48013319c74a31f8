//! The swarm is a function of its seed, its faults are there, and nothing that is promised breaks.

use super::*;
use crate::check::Invariant;
use crate::io::swarm_of;

const MINUTE: Duration = Duration::from_secs(60);
#[test]
fn a_run_is_a_function_of_its_seed() {
    let short = Duration::from_secs(10);
    let first = swarm(3, short).unwrap();
    assert_eq!(first, swarm(3, short).unwrap());
    assert_ne!(first.digest, swarm(4, short).unwrap().digest);
}

#[test]
fn every_fault_comes_in_a_hundred_runs() {
    let drawn = |seed| draw(seed, MINUTE, &Fault::ALL);
    let drawn: Vec<_> = (1..=100).flat_map(drawn).collect();
    for fault in Fault::ALL {
        assert!(drawn.iter().any(|of| of.fault == fault), "{fault:?}");
    }
}

#[test]
fn whatever_goes_wrong_what_is_promised_holds() {
    let seeds: Vec<u64> = (1..=100).collect();
    let ran = swarm_of(&seeds, MINUTE, None, &|_, _, _| {}).unwrap();
    let broken = ran.iter().filter(|one| !one.swarmed.verdict.holds());
    let broken: Vec<String> = broken
        .map(|one| {
            format!(
                "mmt swarm --seed {}\n{}",
                one.swarmed.seed, one.swarmed.verdict
            )
        })
        .collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    assert!(ran.iter().all(|one| one.same != Some(false)));
    let sessions: u64 = ran.iter().map(|one| one.swarmed.sessions).sum();
    assert!(sessions > 200, "{sessions}");
}

#[test]
fn a_tool_that_a_broken_sensor_deceives_is_judged_again_once_it_has_come_back() {
    // the force is above the limit while it lies; and the tool gives way to it during an emergency stop
    for seed in [218, 852] {
        let verdict = swarm(seed, MINUTE).unwrap().verdict;
        assert!(verdict.holds(), "seed {seed}: {verdict}");
        let checked = |of: Invariant| {
            let mut judged = verdict.judged();
            judged
                .find(|(name, _)| *name == of)
                .map_or(0, |(_, judged)| judged.checked)
        };
        let (force, all) = (checked(Invariant::ToolForce), checked(Invariant::ToolSpeed));
        println!("seed {seed}: {force} of {all}");
        assert!(
            force < all && force * 10 > all * 8,
            "seed {seed}: {force} of {all}"
        );
    }
}
