//! The yardstick: (12) without a model. The slave sends the measured force, the master renders the last one that came.
//!
//! It has the network's delay both ways and none of its own: no play-out, no packing. It judges in contact only, and the end
//! of a contact is sent as no force.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, TICK_S};

use super::course::Course;
use super::measures::Run;
use crate::replay::config::ReplayConfig;
use crate::replay::trigger::Contact;

/// Holds the last force.
#[derive(Clone, Debug)]
pub(super) struct Hold {
    delta: f64,
    t_update_s: Option<f64>,
    contact: Contact,
    touched: bool,
    /// The last force that was sent, N, and when, s.
    sent: (Vec2, f64),
}

impl Hold {
    /// With the deadband `delta`, and a timer in contact if there is one.
    pub(super) fn new(delta: f64, t_update: Option<Duration>) -> Self {
        Self {
            delta,
            t_update_s: t_update.map(|period| period.as_secs_f64()),
            contact: Contact::default(),
            touched: false,
            sent: (Vec2::zeros(), 0.0),
        }
    }

    /// Over a course and a network with this one-way delay. What is sent at a sample is rendered from one tick and the round
    /// trip later on.
    pub(super) fn run(mut self, course: &Course, delay: Duration) -> Run {
        let mut run = Run::default();
        let lag = (2 * delay.as_millis() / TICK.as_millis()) as usize + 1;
        let mut on_the_way = VecDeque::from(vec![Vec2::zeros(); lag]);
        for tick in 0..(course.duration_s() / TICK_S) as u64 {
            let t_s = tick as f64 * TICK_S;
            run.push(course, t_s, on_the_way.pop_front());
            run.sent += u64::from(self.step(t_s, course.force_at(t_s)));
            on_the_way.push_back(self.sent.0);
        }
        run
    }

    /// One tick with the measured force (N); whether it is sent.
    fn step(&mut self, t_s: f64, f_s: Vec2) -> bool {
        let config = ReplayConfig::default();
        let touches = self.contact.follow(&config, f_s);
        let lost = std::mem::replace(&mut self.touched, touches) && !touches;
        let (held, since_s) = self.sent;
        // (12)
        let violated = (f_s - held).norm() > self.delta * f_s.norm().max(config.force_floor_n);
        let timed = self
            .t_update_s
            .is_some_and(|period| t_s - since_s >= period);
        let sends = lost || (touches && (violated || timed));
        if sends {
            self.sent = (if touches { f_s } else { Vec2::zeros() }, t_s);
        }
        sends
    }
}
