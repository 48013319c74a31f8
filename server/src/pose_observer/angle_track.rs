//! How well the angle of an object, its rate and the error of the force's direction are known.
//!
//! In touch the force shows the angle and the error of its own direction: a tool that rubs turns the force by up to the angle of
//! friction. Images show the angle alone. The error is a random walk that returns to 0 (Ornstein-Uhlenbeck), and a Kalman filter
//! divides what force and image find between the two. Of a smooth tool there is none: then it is the constant-velocity filter of
//! the angle.

use mmt_shared::time::TICK_S;

use super::track::Track;

/// Time in which the error of the direction changes, s: a push turns round where the tool slides back.
const ERROR_S: f64 = 1.0;

/// Covariance of angle, rate and error of the direction, and that error.
#[derive(Clone, Copy, Debug)]
pub(super) struct AngleTrack {
    /// Angle (rad) and rate (rad/s).
    track: Track,
    /// By how much the force is turned from the normal of the face, rad.
    error: f64,
    /// Covariance of the error with the angle, the rate and itself, rad² and rad²/s.
    with_error: [f64; 3],
}

impl AngleTrack {
    /// The angle is known with this variance, the rate is 0, and the force is normal to the face.
    pub(super) fn at_rest(variance: f64) -> Self {
        Self::of(Track::at_rest(variance))
    }

    /// The angle of a new contact with a body that is no box.
    pub(super) fn of_any_normal() -> Self {
        Self::of(Track::of_any_normal())
    }

    fn of(track: Track) -> Self {
        Self {
            track,
            error: 0.0,
            with_error: [0.0; 3],
        }
    }

    /// Variance of the angle, rad².
    pub(super) fn variance(&self) -> f64 {
        self.track.variance()
    }

    /// By how much the force is turned from the normal of the face, rad.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// A contact begins, with an error of the direction of this mean square, rad².
    pub(super) fn begin_contact(&mut self, mean_square: f64) {
        self.forget_error();
        self.with_error = [0.0, 0.0, mean_square];
    }

    /// Nobody touches the object any more: the angle is less certain by this variance.
    pub(super) fn let_go(&mut self, variance: f64) {
        self.track.hold(variance);
        self.forget_error();
    }

    /// The rate is 0.
    pub(super) fn stop(&mut self) {
        self.track.stop();
    }

    /// The force is normal to what it touches.
    pub(super) fn forget_error(&mut self) {
        *self = Self::of(self.track);
    }

    /// One tick under a turning acceleration that is unknown but of this size, with an error of the direction of this mean square.
    pub(super) fn predict(&mut self, acceleration: f64, mean_square: f64) {
        self.track.predict(acceleration);
        let keep = 1.0 - TICK_S / ERROR_S;
        let [angle, rate, own] = self.with_error;
        self.error *= keep;
        self.with_error = [
            keep * (angle + rate * TICK_S),
            keep * rate,
            keep * keep * own + 2.0 * mean_square * TICK_S / ERROR_S,
        ];
    }

    /// Takes a measured direction of the force of this variance, off by `innovation` (rad); the corrections of angle and rate.
    pub(super) fn touch(&mut self, variance: f64, innovation: f64) -> (f64, f64) {
        self.measure(1.0, variance, innovation)
    }

    /// Takes an image of this variance, off by `innovation` (rad); the corrections of angle and rate.
    pub(super) fn see(&mut self, variance: f64, innovation: f64) -> (f64, f64) {
        self.measure(0.0, variance, innovation)
    }

    /// Of a measurement that contains the error of the direction `share` times.
    fn measure(&mut self, share: f64, variance: f64, innovation: f64) -> (f64, f64) {
        let gains = self
            .track
            .measure_with(&mut self.with_error, share, variance);
        let Some(gains) = gains else {
            return (innovation, 0.0);
        };
        self.error += gains.other * innovation;
        (gains.place * innovation, gains.rate * innovation)
    }
}
