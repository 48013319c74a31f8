//! The judge of the trigger, under the schemes that ask for nothing more than (12) and T_update.

use mmt_shared::model::settings::Mode;

use super::*;

#[test]
fn an_update_that_a_plain_scheme_asks_for_and_one_that_it_does_not_are_found_out() {
    let found = |scheme: &str, change| {
        let mut config = SlaveConfig::of_mode(Mode::Paper);
        config.trigger.scheme = scheme.parse().unwrap();
        let verdict = Shown::of(config, change).run();
        let broken = verdict.broken();
        broken.map(|(of, _)| of).collect::<Vec<_>>()
    };
    let stays = Change::Slave(|done| {
        done.f_shadow *= 0.5;
        done.update = None;
    });
    let other_cause = Change::Slave(|done| {
        done.f_shadow = done.f_s;
        if let Some(update) = &mut done.update {
            update.cause = Cause::Deadband;
        }
    });
    for scheme in [
        "deadband 1%",
        "hybrid 10% 150ms",
        "timer 20ms",
        "every-sample",
    ] {
        assert_eq!(found(scheme, Change::Nothing), [], "{scheme}");
        assert!(
            found(scheme, stays).contains(&Invariant::TriggerFires),
            "{scheme}: one stays"
        );
        let found = found(scheme, other_cause);
        assert!(
            found.contains(&Invariant::TriggerFires),
            "{scheme}: without a cause"
        );
    }
}
