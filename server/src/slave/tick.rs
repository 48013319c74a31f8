//! What the slave does with a HIP sample: takes it in, and in a tick plays it, its stages in their order; and those that
//! somebody outside decides in their place.

use mmt_shared::model::sample::HipSample;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::{TICK_S, Time};

use super::{Slave, SlaveTick};
use crate::contact::Contact;
use crate::estimator::Measured;
use crate::playout::Played;
use crate::sensing::SensorFaults;
use crate::trigger::TriggerInput;

/// An estimator of somebody else's: m (kg), b (N s/m) and c (N) after what was measured in a tick; none where the slave's own
/// estimate is to stand. The time is the stamp of the HIP sample.
pub type OtherEstimator<'a> = &'a mut dyn FnMut(Time, &Measured) -> Option<[f64; 3]>;

/// An update scheme of somebody else's: whether an update is to be sent, and as what. The time is the stamp of the HIP sample.
pub type OtherScheme<'a> = &'a mut dyn FnMut(Time, &TriggerInput) -> Option<Cause>;

/// Stages that somebody outside decides in a tick, each in the place of the slave's own: experiments do, sessions never.
#[derive(Default)]
pub struct Substitutes<'a> {
    /// Parameters.
    pub estimator: Option<OtherEstimator<'a>>,
    /// Updates, but for those of contact and loss ([`Trigger::step_by`](crate::trigger::Trigger::step_by)).
    pub scheme: Option<OtherScheme<'a>>,
}

impl Slave {
    /// Takes in a HIP sample that arrived at `now`, and the newest update that the master had when it
    /// sent the sample.
    pub fn handle_sample(&mut self, now: Time, sample: &HipSample, newest_update: u32) {
        self.playout.push(now, sample);
        self.shadow.acknowledge(sample, newest_update);
    }

    /// One sample period. None before the first HIP sample is due.
    pub fn tick(&mut self, now: Time) -> Option<SlaveTick> {
        self.tick_with(now, Substitutes::default())
    }

    /// The same with stages of somebody else's.
    pub fn tick_with(&mut self, now: Time, others: Substitutes<'_>) -> Option<SlaveTick> {
        let before = self.playout.played_hip();
        let played = self.playout.advance(now)?;
        let hip_stands = self.playout.played_hip() == before;
        let played = self.tool.step(before, played);
        self.tool_at = played.hip;
        let ticks = played.ticks();
        let force = self.tool.port().held();
        let (back, rate) = self.compliance.step(force, f64::from(ticks) * TICK_S);
        let tool = played.hip - back;
        let mut contact = (self.contact).step(now, ticks, tool, played.velocity - rate);
        // the spring of the tool is part of the contact that the model renders
        contact.tool += back;
        contact.back = back;
        self.tool.measured(tool, contact.force, contact.in_contact);
        let held_back = self.tool.is_held_back();
        if self.object.follow_body(&contact) {
            // the master has the body that was touched before
            self.trigger.repeat(Cause::SlaveOnlyContact);
        }
        let force_holds = self.tool.force_holds();
        let measured = self.object.step(now, ticks, &contact, force_holds);
        if !contact.in_contact {
            let believed = self.object.estimator.contact_n_per_m();
            self.compliance.suit(believed, &self.settings.coupling);
        }
        if self.object.observer.sees_clear() {
            self.contact.see_clear();
        }
        if let Some(estimator) = others.estimator
            && let Some(found) = estimator(played.stamp, &measured)
        {
            self.object.replace(found);
        }
        self.follow_master(played.stamp);
        self.tool.set_returnable(self.shadow.ahead().returnable_j());
        self.reference.take_echo(played.force);
        self.errors.push(&contact, played.force);
        let input =
            self.reference
                .input(&contact, &self.object, &self.shadow, held_back, hip_stands);
        let cause = match others.scheme {
            None => self.trigger.step(now, &input),
            Some(scheme) => {
                let asked = scheme(played.stamp, &input);
                self.trigger.step_by(now, &input, asked)
            }
        };
        let f_shadow = self.shadow.rendered().force;
        Some(SlaveTick {
            stamp: played.stamp,
            tool,
            f_s: contact.force,
            true_force: contact.true_force,
            f_shadow,
            f_m: played.force,
            in_contact: contact.in_contact,
            truth: contact.truth,
            update: cause.and_then(|cause| self.update(cause, &played, &contact)),
        })
    }

    /// From now on this of the simulated world's sensors is broken: the swarm does that, sessions never.
    pub fn set_sensor_faults(&mut self, faults: SensorFaults) {
        self.contact.plant_mut().set_sensor_faults(faults);
    }

    /// The shadow takes the samples up to the one that is played; a lost update is sent again.
    fn follow_master(&mut self, stamp: Time) {
        let playout = &self.playout;
        let on_grid = playout.sample_before(stamp).unwrap_or(stamp);
        let lost = self
            .shadow
            .step(on_grid, stamp, |stamp| playout.hip_at(stamp));
        if let Some(cause) = lost {
            self.trigger.repeat(cause);
        }
    }

    /// Makes the update and applies it to the shadow, as the master will. None where what was found is not of numbers.
    fn update(&mut self, cause: Cause, played: &Played, contact: &Contact) -> Option<Update> {
        let touch = self.reference.model(&self.shadow).rendered().touch;
        if let (Cause::MasterOnlyContact, Some(touch)) = (cause, touch) {
            self.object.observer.retract_face(played.hip, touch.face);
        }
        if cause == Cause::SlaveOnlyContact {
            self.object.observer.approach();
        }
        self.reference.take_update(contact.force);
        let model = self.shadow.ahead();
        let update = (self.updates).step(cause, played.stamp, &self.object, model)?;
        self.shadow.send(&update);
        Some(update)
    }
}
