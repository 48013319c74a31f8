//! What the trigger compares the measured force with, and all that it is given in a tick.

use std::collections::VecDeque;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::local_model::LocalModel;

use super::object::ObjectEstimate;
use crate::conditioning::JUDGED_MAX;
use crate::contact::Contact;
use crate::shadow::{Shadow, TriggerReference};
use crate::trigger::TriggerInput;

/// One of the three references.
#[derive(Clone, Debug)]
pub(super) struct ForceReference {
    kind: TriggerReference,
    /// f_m of the newest sample that was played, N.
    echo: Vec2,
    /// f_s at the last update, N.
    at_update: Vec2,
    /// f_s and f_m of the newest ticks, N.
    recent: VecDeque<[Vec2; 2]>,
}

impl ForceReference {
    pub(super) fn new(kind: TriggerReference) -> Self {
        Self {
            kind,
            echo: Vec2::zeros(),
            at_update: Vec2::zeros(),
            recent: VecDeque::with_capacity(JUDGED_MAX),
        }
    }

    /// Takes f_m of the sample that is played, N; none where the HIP is not the master's.
    pub(super) fn take_echo(&mut self, f_m: Option<Vec2>) {
        self.echo = f_m.unwrap_or(self.echo);
    }

    /// Takes f_s at an update, N.
    pub(super) fn take_update(&mut self, f_s: Vec2) {
        self.at_update = f_s;
    }

    /// The copy of the master's model that a contact of the master alone is judged by.
    pub(super) fn model<'a>(&self, shadow: &'a Shadow) -> &'a LocalModel {
        match self.kind {
            TriggerReference::Echo => shadow.confirmed(),
            TriggerReference::Shadow | TriggerReference::None => shadow.ahead(),
        }
    }

    /// The trigger's input. `held_back`: whether the limit of the tool's force keeps the tool from the HIP, `hip_stands`
    /// whether the HIP is where it was a sample before.
    pub(super) fn input(
        &mut self,
        contact: &Contact,
        object: &ObjectEstimate,
        shadow: &Shadow,
        held_back: bool,
        hip_stands: bool,
    ) -> TriggerInput {
        let (f_m, shadow_in_contact) = self.model_force(contact, shadow, held_back);
        // the surface may be some tenths of a second away
        let shadow_in_contact =
            shadow_in_contact && (contact.in_contact || object.expected().is_none());
        let [f_s, f_m] = self.average([contact.force, f_m], contact.averaged);
        let estimate = object.estimator.estimate();
        let model = shadow.ahead().state();
        // what was sent is brought in over some ticks, and need not be sent again
        let (shift, turn) = object.observer.off(&shadow.ahead().pose_to_come());
        TriggerInput {
            f_s,
            f_m,
            noise_n: contact.noise_n / (contact.averaged as f64).sqrt(),
            slave_in_contact: contact.in_contact,
            shadow_in_contact,
            hip_stands,
            // a model that does not stand where the object does is a mismatch although the object sticks
            sticking: estimate.sticking
                && estimate.holding.is_none_or(|c| model.params.c() > 0.5 * c),
            speed: estimate.speed,
            acceleration: estimate.acceleration,
            force_deviation: match estimate.holding {
                // what is known is the force that the object stood, and that is as noisy as a sample
                Some(_) => contact.noise_n,
                _ => estimate.force_deviation(),
            },
            params: object.params,
            only_friction_holds: object.only_friction_holds(contact.tool),
            shift,
            shift_deviation: object.observer.deviation(),
            turn,
            turn_deviation: object.observer.angle_deviation(),
        }
    }

    /// Both forces (N) over the newest `n` ticks: the same average of both, so that neither is late.
    fn average(&mut self, forces: [Vec2; 2], n: usize) -> [Vec2; 2] {
        if self.recent.len() >= JUDGED_MAX {
            self.recent.pop_front();
        }
        self.recent.push_back(forces);
        if n == 1 {
            return forces;
        }
        let newest = self.recent.iter().rev().take(n);
        let all = newest.len() as f64;
        newest
            .fold([Vec2::zeros(); 2], |sum, tick| {
                [sum[0] + tick[0], sum[1] + tick[1]]
            })
            .map(|sum| sum / all)
    }

    /// f_m (N), and whether the model is in contact.
    ///
    /// Where the tool is held back, tool and model are at different places. A larger force of the model at the HIP is
    /// then no error, nor is none at all; a smaller one is.
    fn model_force(&self, contact: &Contact, shadow: &Shadow, held_back: bool) -> (Vec2, bool) {
        let rendered = shadow.rendered();
        let (f_m, in_contact) = match self.kind {
            TriggerReference::Shadow => (rendered.force, rendered.in_contact()),
            TriggerReference::Echo => (self.echo, self.echo != Vec2::zeros()),
            TriggerReference::None => (self.at_update, contact.in_contact),
        };
        if !held_back {
            return (f_m, in_contact);
        }
        let f_s = contact.force;
        let smaller = in_contact && f_m.dot(&f_s) < f_s.norm_squared();
        (if smaller { f_m } else { f_s }, contact.in_contact)
    }
}
