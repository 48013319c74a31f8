//! The update trigger on a recorded push: (12) with a deadband, and the timer of the hybrid scheme.
//!
//! Evaluated at the recorded samples (about 100 Hz), in contact only: in free space a perfect model would
//! violate (12) on noise alone. It must see the force held by the master's model and the measured one, and
//! nothing of the samples to come.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::recording::ForceSample;
use serde::Serialize;

use super::config::ReplayConfig;

/// Packets of one push or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Packets {
    /// Sent because (12) was violated.
    pub deadband: u64,
    /// Sent because T_update had passed.
    pub timer: u64,
    /// Of all these, packets that changed the force of the master's model.
    pub with_news: u64,
}

impl Packets {
    /// All packets.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.deadband + self.timer
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.deadband += other.deadband;
        self.timer += other.timer;
        self.with_news += other.with_news;
    }
}

/// What one push cost and how far the master's force was from the measured one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TriggerTraffic {
    pub(super) packets: Packets,
    /// Contact samples.
    pub(super) samples: u64,
    /// Sum over them of |f_s − f_m| / max(|f_s|, floor).
    pub(super) error_sum: f64,
}

/// Contact as the force sensor shows it, with two thresholds so that noise does not toggle it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Contact {
    touching: bool,
}

impl Contact {
    pub(super) fn follow(&mut self, config: &ReplayConfig, force: Vec2) -> bool {
        let threshold = if self.touching {
            config.contact_off_n
        } else {
            config.contact_on_n
        };
        self.touching = force.norm() >= threshold;
        self.touching
    }
}

/// Runs the trigger over a push. The master's model holds the force `by_master` until the first packet,
/// then `by_slave`, the prediction of the newest parameters, until the push ends (world, N).
pub(super) fn run(
    config: &ReplayConfig,
    samples: &[ForceSample],
    by_master: Vec2,
    by_slave: Vec2,
) -> TriggerTraffic {
    let mut traffic = TriggerTraffic::default();
    let mut contact = Contact::default();
    let mut held = by_master;
    let mut quiet_since_s: Option<f64> = None;
    for sample in samples {
        if !contact.follow(config, sample.force) {
            quiet_since_s = None;
            continue;
        }
        let since_s = *quiet_since_s.get_or_insert(sample.t_s);
        // (12)
        let error = (sample.force - held).norm() / sample.force.norm().max(config.force_floor_n);
        traffic.samples += 1;
        traffic.error_sum += error;
        let violated = error > config.deadband;
        let elapsed = config
            .t_update_s
            .is_some_and(|period_s| sample.t_s - since_s >= period_s);
        if violated {
            traffic.packets.deadband += 1;
        } else if elapsed {
            traffic.packets.timer += 1;
        } else {
            continue;
        }
        if held != by_slave {
            traffic.packets.with_news += 1;
        }
        held = by_slave;
        quiet_since_s = Some(sample.t_s);
    }
    traffic
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 s in the air, then 2 s of contact with 4 N along x, at 100 Hz.
    fn push() -> Vec<ForceSample> {
        let sample = |k: u32| ForceSample {
            t_s: f64::from(k) * 0.01,
            force: Vec2::new(if k < 100 { 0.02 } else { 4.0 }, 0.0),
        };
        (0..300).map(sample).collect()
    }

    fn packets(t_update_s: Option<f64>, by_master: f64, by_slave: f64) -> Packets {
        let config = ReplayConfig {
            t_update_s,
            ..ReplayConfig::default()
        };
        let (by_master, by_slave) = (Vec2::new(by_master, 0.0), Vec2::new(by_slave, 0.0));
        run(&config, &push(), by_master, by_slave).packets
    }

    #[test]
    fn a_prediction_within_the_deadband_sends_nothing_and_one_outside_every_contact_sample() {
        assert_eq!(packets(None, 3.7, 3.7).sent(), 0);
        assert_eq!(packets(None, 3.5, 3.5).sent(), 200);
    }

    #[test]
    fn the_first_packet_brings_the_newest_prediction_and_ends_the_violation() {
        let sent = packets(None, 3.0, 3.9);
        assert_eq!((sent.deadband, sent.timer, sent.with_news), (1, 0, 1));
    }

    #[test]
    fn the_timer_sends_once_a_period_of_contact_and_not_in_the_air() {
        // contact from 1.00 to 2.99 s: at 1.15, 1.30 … 2.95
        let sent = packets(Some(0.145), 4.0, 4.0);
        assert_eq!((sent.deadband, sent.timer), (0, 13));
        assert_eq!(packets(Some(0.145), 3.0, 3.0).timer, 0);
    }

    #[test]
    fn contact_does_not_toggle_between_its_two_thresholds() {
        let config = ReplayConfig::default();
        let mut contact = Contact::default();
        let between = Vec2::new(0.5 * (config.contact_on_n + config.contact_off_n), 0.0);
        assert!(!contact.follow(&config, between));
        assert!(contact.follow(&config, Vec2::new(1.0, 0.0)));
        assert!(contact.follow(&config, between));
        assert!(!contact.follow(&config, Vec2::zeros()));
    }
}
