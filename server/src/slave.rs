//! The slave's core: one tick from the HIP sample to the update.
//!
//! Play-out, environment, sensing, pose and parameters, shadow, trigger. Pure: the time is an argument,
//! the seed comes with the configuration, and what it returns is all that it does.

use mmt_shared::metrics::ForceMetrics;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::correction::{IN_CONTACT, IN_CONTACT_REPLAYED};
use mmt_shared::model::geometry::{BoxFootprint, Pose, Twist, Vec2, wrap_angle};
use mmt_shared::model::params::{ModelParams, ModelState, inertia_of_square};
use mmt_shared::model::sample::{ForceCounts, HipSample};
use mmt_shared::model::settings::{Mode, ModelSettings, PoseCorrection};
use mmt_shared::model::tool::{HandPort, Scene, Tool};
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::Time;

use crate::bilateral::ToolPort;
use crate::environment::{Environment, EnvironmentConfig};
use crate::estimator::{Estimate, Estimator, EstimatorConfig, Measured, OBSTACLE_N, Seen};
use crate::playout::PlayoutBuffer;
use crate::pose_observer::{ObserverConfig, PoseObserver};
use crate::sensing::Sensing;
use crate::shadow::{Shadow, TriggerReference};
use crate::tool_force::ToolForce;
use crate::trigger::{ContactDetector, Scheme, Trigger, TriggerInput};

mod config;
mod drive;

pub use config::{SlaveConfig, SlaveError, StartModel};

use drive::ToolDrive;

/// What one tick of the slave gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveTick {
    /// Stamp of the HIP sample, by the master's clock.
    pub stamp: Time,
    /// The tool, m.
    pub tool: Vec2,
    /// f_s as measured, N, on the object.
    pub f_s: Vec2,
    /// Contact force as it is, N: for reports.
    pub true_force: Vec2,
    /// The shadow's force, N: f_m as the trigger sees it.
    pub f_shadow: Vec2,
    /// f_m as the master rendered it for this sample, N; none if the sample was lost or the tool is held back from it.
    pub f_m: Option<Vec2>,
    /// Whether the slave is in contact.
    pub in_contact: bool,
    /// The object's true pose.
    pub truth: Pose,
    /// What goes to the master.
    pub update: Option<Update>,
}

/// The slave between the link and the object.
pub struct Slave {
    settings: ModelSettings,
    playout: PlayoutBuffer,
    environment: Environment,
    sensing: Sensing,
    contact: ContactDetector,
    observer: PoseObserver,
    estimator: Estimator,
    shadow: Shadow,
    reference: TriggerReference,
    /// f_m as the newest sample said it, N.
    echo: Vec2,
    /// f_s at the last update, N.
    f_s_told: Vec2,
    drive: ToolDrive,
    trigger: Trigger,
    timer_carries_pose: bool,
    /// The last parameters that were accepted.
    params: ModelParams,
    refused_estimates: u64,
    sequence: u32,
    force: ForceMetrics,
}

impl Slave {
    /// A slave for a master whose device renders `coupling`.
    ///
    /// # Errors
    /// When the configuration's numbers are not accepted.
    pub fn try_new(config: &SlaveConfig, coupling: Coupling) -> Result<Self, SlaveError> {
        Self::with_settings(config, config.mode.model_settings(coupling))
    }

    /// A slave whose local model is run by other settings than its mode's.
    ///
    /// # Errors
    /// As [`Slave::try_new`].
    pub fn with_settings(
        config: &SlaveConfig,
        settings: ModelSettings,
    ) -> Result<Self, SlaveError> {
        let coupling = settings.coupling;
        let environment = Environment::try_new(EnvironmentConfig {
            coupling,
            ..config.environment
        })?;
        let StartModel {
            mass_kg: m,
            damping_ns_per_m: b,
            friction_n: c,
            side_m,
        } = config.start;
        let params = ModelParams::of_square(m, b, c, side_m, &coupling)?;
        let footprint = BoxFootprint::square(side_m);
        // Vision has looked at the resting box for a while before the session: its noise has averaged out.
        let pose = environment.pose();
        let start = ModelState::try_new(params, footprint, pose, Twist::default())?;
        let learn = config.mode == Mode::Recommended;
        let sensing = config.sensing;
        let observer = ObserverConfig {
            coupling,
            force_noise_n: sensing.force_noise_n,
            vision_noise_m: sensing.vision.position_noise_m,
            vision_noise_rad: sensing.vision.angle_noise_rad,
            learn,
        };
        let estimator = config
            .estimator
            .unwrap_or_else(|| EstimatorConfig::of_mode(config.mode, coupling))
            .starting_at([m, b, c]);
        estimator.check()?;
        Ok(Self {
            settings,
            playout: PlayoutBuffer::try_new(config.playout)?,
            environment,
            sensing: Sensing::try_new(sensing, config.seed)?,
            contact: ContactDetector::new(config.trigger.contact),
            observer: PoseObserver::new(observer, pose, footprint),
            estimator: Estimator::new(&estimator),
            shadow: Shadow::new(settings, start),
            reference: config.trigger_reference,
            echo: Vec2::zeros(),
            f_s_told: Vec2::zeros(),
            drive: ToolDrive::new(
                ToolPort::new(sensing.force_noise_n, config.playout.speed_max_m_per_s),
                ToolForce::try_new(config.tool_force_max_n, coupling)?,
            ),
            trigger: Trigger::new(config.trigger),
            timer_carries_pose: config.trigger.timer_carries_pose,
            params,
            refused_estimates: 0,
            sequence: 0,
            force: ForceMetrics::default(),
        })
    }

    /// How both sides run the local model.
    #[must_use]
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    /// The state that the master starts from.
    #[must_use]
    pub fn state(&self) -> &ModelState {
        self.shadow.ahead().state()
    }

    /// The real object. What it says is the truth: for reports, never for the estimate.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// The real object, to be changed in mid-run: scenarios do, sessions never.
    pub fn environment_mut(&mut self) -> &mut Environment {
        &mut self.environment
    }

    /// What the estimator found so far.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        self.estimator.estimate()
    }

    /// Estimates whose numbers were not accepted as parameters.
    #[must_use]
    pub fn refused_estimates(&self) -> u64 {
        self.refused_estimates
    }

    /// The play-out buffer.
    #[must_use]
    pub fn playout(&self) -> &PlayoutBuffer {
        &self.playout
    }

    /// What is known of the master's model.
    #[must_use]
    pub fn shadow(&self) -> &Shadow {
        &self.shadow
    }

    /// The pose as the slave sees it.
    #[must_use]
    pub fn observer(&self) -> &PoseObserver {
        &self.observer
    }

    /// Force metrics over all samples whose f_m is known.
    #[must_use]
    pub fn force(&self) -> &ForceMetrics {
        &self.force
    }

    /// Takes in a HIP sample that arrived at `now`, and the newest update that the master had when it
    /// sent the sample.
    pub fn handle_sample(&mut self, now: Time, sample: &HipSample, newest_update: u32) {
        self.playout.push(now, sample);
        self.shadow.acknowledge(sample, newest_update);
    }

    /// From now on the trigger's thresholds and times are `by` as large as configured: the answer to congestion.
    pub fn stretch(&mut self, by: f64) {
        self.trigger.stretch(by);
    }

    /// The update scheme as it is now, stretched or not.
    #[must_use]
    pub fn scheme_now(&self) -> Scheme {
        self.trigger.scheme_now()
    }

    /// The tool's port, as time-domain passivity control sees it.
    #[must_use]
    pub fn tool_port(&self) -> &ToolPort {
        self.drive.port()
    }

    /// The limit of the tool's force, and what came of it.
    #[must_use]
    pub fn tool_force(&self) -> &ToolForce {
        self.drive.force()
    }

    /// Takes in what the hand's port says, newer than all before: the hand feels the tool, which from now on goes only
    /// as far as the hand has paid for.
    pub fn handle_hand_port(&mut self, port: &HandPort) {
        self.drive.credit(port.in_j, self.playout.played_hip());
    }

    /// What the hand feels of the tool after a tick, where it does.
    #[must_use]
    pub fn tool_state(&self, tick: &SlaveTick) -> Option<Tool> {
        let port = self.tool_port();
        self.drive.is_passive().then(|| Tool {
            answers: tick.stamp,
            force: Some(ForceCounts::nearest(port.held())),
            in_contact: tick.in_contact,
            in_j: port.energy().in_j,
            model_error: 0.0,
        })
    }

    /// What a viewer sees after a tick: the object where the slave takes it to be.
    #[must_use]
    pub fn scene(&self, tick: &SlaveTick) -> Scene {
        Scene {
            answers: tick.stamp,
            object: self.observer.pose(),
            tool: tick.tool,
            force: tick.f_s,
        }
    }

    /// Where the tool is before the first sample, m.
    pub fn start_at(&mut self, hip: Vec2) {
        self.playout.start_at(hip);
    }

    /// One sample period. None before the first HIP sample is due.
    pub fn tick(&mut self, now: Time) -> Option<SlaveTick> {
        let before = self.playout.played_hip();
        let played = self.playout.advance(now)?;
        let played = self.drive.lead(before, played);
        // every pose of a tick is the one that the tool met, before the object moves on
        let truth = self.environment.pose();
        let contact = self.environment.step(played.hip, played.velocity);
        let sensed = self.sensing.sense(now, played.hip, contact.force, &truth);
        let in_contact = self.contact.step(sensed.force.norm());
        self.drive.measured(sensed.force);
        self.observer
            .step(now, sensed.tool, sensed.force, in_contact, &self.params);
        if let Some(vision) = sensed.vision {
            self.observer.see(&vision);
        }
        self.estimate_from(sensed.tool, sensed.force);
        self.follow_master(played.stamp);
        self.echo = played.force.unwrap_or(self.echo);
        if let Some(f_m) = played.force {
            self.force.push(sensed.force, f_m);
        }
        let mut tick = SlaveTick {
            stamp: played.stamp,
            tool: played.hip,
            f_s: sensed.force,
            true_force: contact.force,
            f_shadow: self.shadow.rendered().force,
            f_m: played.force,
            in_contact,
            truth,
            update: None,
        };
        let cause = self.trigger.decide(now, &self.trigger_input(&tick));
        tick.update = cause.map(|cause| self.send(cause, &tick));
        Some(tick)
    }

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

    fn estimate_from(&mut self, tool: Vec2, force: Vec2) {
        let normal = self.observer.contact().map(|contact| contact.inward);
        // As wide as the faces say; the paper's never change.
        let side = self.observer.footprint().mean_side();
        let seen = Some(Seen {
            centre: self.observer.pose().position,
            turning: self.observer.twist().angular,
            body_turning: self.observer.body_rate(),
            side,
        });
        let Estimate {
            m,
            b,
            c,
            holding,
            sticking,
            ..
        } = self.estimator.step(&Measured {
            tool,
            force,
            normal,
            seen,
        });
        let inertia = inertia_of_square(m, side);
        // a tool that may press no harder does not find out how hard the object is held
        let holding = holding.map(|found| match sticking && self.drive.is_held_back() {
            true => OBSTACLE_N,
            false => found,
        });
        let c = holding.unwrap_or(c);
        let e = c * self.observer.friction_radius();
        match ModelParams::try_new(m, b, c, inertia, e, &self.settings.coupling) {
            Ok(params) => self.params = params,
            Err(_) => self.refused_estimates += 1,
        }
    }

    fn trigger_input(&self, tick: &SlaveTick) -> TriggerInput {
        let estimate = self.estimator.estimate();
        let shadow = self.shadow.rendered();
        let (f_m, shadow_in_contact) = match self.reference {
            TriggerReference::Shadow => (shadow.force, shadow.in_contact()),
            TriggerReference::Echo => (self.echo, self.echo != Vec2::zeros()),
            TriggerReference::None => (self.f_s_told, tick.in_contact),
        };
        let (f_m, shadow_in_contact) = match self.drive.is_held_back() {
            true => held_back(tick, f_m, shadow_in_contact),
            false => (f_m, shadow_in_contact),
        };
        let pose = self.shadow.ahead().state().pose;
        TriggerInput {
            f_s: tick.f_s,
            f_m,
            slave_in_contact: tick.in_contact,
            shadow_in_contact,
            // a model that does not stand where the object does is a mismatch although the object sticks
            sticking: estimate.sticking
                && estimate
                    .holding
                    .is_none_or(|c| self.shadow.ahead().state().params.c() > 0.5 * c),
            speed: estimate.speed,
            acceleration: estimate.acceleration,
            force_deviation: estimate.force_deviation(),
            params: self.params,
            shift: self.observer.pose().position - pose.position,
            turn: wrap_angle(self.observer.pose().angle - pose.angle),
        }
    }

    /// Where the model is to be: ahead of the object by as much as its correction lags behind.
    fn pose_to_tell(&self) -> Pose {
        let lag_s = match self.settings.correction {
            PoseCorrection::Snap => 0.0,
            PoseCorrection::MatchedStamps => IN_CONTACT.tau_s,
            PoseCorrection::Replay => IN_CONTACT_REPLAYED.tau_s,
        };
        let omega = self.shadow.ahead().state().twist.angular;
        self.observer.pose_ahead(omega, lag_s)
    }

    /// Makes the update and applies it to the shadow, as the master will.
    fn send(&mut self, cause: Cause, tick: &SlaveTick) -> Update {
        let judged = match self.reference {
            TriggerReference::Echo => self.shadow.confirmed(),
            _ => self.shadow.ahead(),
        };
        if let (Cause::MasterOnlyContact, Some(touch)) = (cause, judged.rendered().touch) {
            self.observer.retract_face(tick.tool, touch.face);
        }
        self.f_s_told = tick.f_s;
        self.sequence = self.sequence.saturating_add(1);
        let seen = ModelState {
            params: self.params,
            footprint: self.observer.footprint(),
            pose: self.pose_to_tell(),
            twist: self.observer.twist(),
        };
        // what the model had at the stamp: nothing is left to be corrected there
        let ahead = self.shadow.ahead();
        let own = ahead.history().at(tick.stamp);
        let own = own.filter(|_| cause == Cause::Timer && !self.timer_carries_pose);
        let state = own.map_or(seen, |own| ModelState {
            footprint: ahead.state().footprint,
            pose: own.motion.pose,
            twist: own.motion.twist,
            ..seen
        });
        let update = Update {
            sequence: self.sequence,
            cause,
            answers: tick.stamp,
            newest_command: 0,
            slave_in_contact: tick.in_contact,
            state,
        };
        self.shadow.send(&update);
        update
    }
}

/// What the trigger is told of the model where the tool is held back from the HIP: f_m (N), and whether it is in contact.
/// A model that says more at the HIP than is measured on the way there is not contradicted, nor is one that says
/// nothing of where the tool is; one that says less is.
fn held_back(tick: &SlaveTick, f_m: Vec2, model_in_contact: bool) -> (Vec2, bool) {
    let contradicted = model_in_contact && f_m.dot(&tick.f_s) < tick.f_s.norm_squared();
    let f_m = if contradicted { f_m } else { tick.f_s };
    (f_m, tick.in_contact)
}
