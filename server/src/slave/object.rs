//! Pose and parameters of the object, as the slave finds them.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Pose};
use mmt_shared::model::params::{ModelParams, inertia_of_square};
use mmt_shared::model::settings::Mode;
use mmt_shared::time::Time;

use super::config::{SlaveConfig, SlaveError};
use crate::contact::Contact;
use crate::estimator::{Estimate, Estimator, EstimatorConfig, Measured, OBSTACLE_N, Seen};
use crate::pose_observer::{ObserverConfig, PoseObserver};

/// The pose observer and the estimator, which need each other.
pub(super) struct ObjectEstimate {
    pub(super) observer: PoseObserver,
    pub(super) estimator: Estimator,
    /// The last parameters that were accepted.
    pub(super) params: ModelParams,
    /// Estimates whose numbers were not accepted as parameters.
    pub(super) refused: u64,
    coupling: Coupling,
}

impl ObjectEstimate {
    /// Starts from the configured parameters, and from the pose that vision has averaged before the session.
    pub(super) fn try_new(
        config: &SlaveConfig,
        coupling: Coupling,
        pose: Pose,
    ) -> Result<Self, SlaveError> {
        let sensing = &config.sensing;
        let observer = ObserverConfig {
            coupling,
            force_noise_n: sensing.force_noise_n,
            vision_noise_m: sensing.vision.position_noise_m,
            vision_noise_rad: sensing.vision.angle_noise_rad,
            learn: config.mode == Mode::Recommended,
        };
        let start = config.start;
        let [m, b, c] = [start.mass_kg, start.damping_ns_per_m, start.friction_n];
        let estimator = config
            .estimator
            .unwrap_or_else(|| EstimatorConfig::of_mode(config.mode, coupling))
            .starting_at([m, b, c]);
        estimator.check()?;
        Ok(Self {
            observer: PoseObserver::new(observer, pose, BoxFootprint::square(start.side_m)),
            estimator: Estimator::new(&estimator, coupling),
            params: ModelParams::of_square(m, b, c, start.side_m, &coupling)?,
            refused: 0,
            coupling,
        })
    }

    /// One tick. `held_back` says whether the limit of the tool's force keeps the tool from the HIP.
    pub(super) fn step(&mut self, now: Time, contact: &Contact, held_back: bool) {
        let observer = &mut self.observer;
        observer.step(
            now,
            contact.tool,
            contact.force,
            contact.in_contact,
            &self.params,
        );
        if let Some(vision) = contact.vision {
            observer.see(&vision);
        }
        // as wide as the learned faces; the paper's never change
        let side = observer.footprint().mean_side();
        let estimate = self.estimator.step(&Measured {
            tool: contact.tool,
            force: contact.force,
            normal: observer.contact().map(|frame| frame.inward),
            seen: Some(Seen {
                centre: observer.pose().position,
                turning: observer.twist().angular,
                body_turning: observer.body_rate(),
                side,
            }),
        });
        match self.accept(&estimate, side, held_back) {
            Some(params) => self.params = params,
            None => self.refused += 1,
        }
    }

    /// The parameters of an estimate; none if they are not accepted.
    fn accept(&self, estimate: &Estimate, side: f64, held_back: bool) -> Option<ModelParams> {
        let Estimate { m, b, .. } = *estimate;
        let c = match estimate.holding {
            // a tool that may press no harder does not find out how hard the object is held
            Some(_) if estimate.sticking && held_back => OBSTACLE_N,
            Some(holding) => holding,
            None => estimate.c,
        };
        let e = c * self.observer.friction_radius();
        ModelParams::try_new(m, b, c, inertia_of_square(m, side), e, &self.coupling).ok()
    }
}
