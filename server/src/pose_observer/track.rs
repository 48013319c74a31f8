//! How well a coordinate and its rate are known: the covariance of a constant-velocity Kalman filter.
//!
//! The coordinate itself is part of the object's motion; whoever moves that calls [`Track::predict`], and whoever measures it
//! takes the gains of [`Track::measure`].

use mmt_shared::time::TICK_S;

/// Spread of the normal of a new contact with a body that is no box, rad.
const ANY_NORMAL_RAD: f64 = 0.5;

/// Covariance of a coordinate (m or rad) and its rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// [place², place·rate, rate²], in m or rad, and s.
    covariance: [f64; 3],
}

impl Track {
    /// The place is known with this variance, and the rate is 0.
    pub(super) fn at_rest(variance: f64) -> Self {
        Self {
            covariance: [variance, 0.0, 0.0],
        }
    }

    /// The angle of a new contact with a body that is no box.
    pub(super) fn of_any_normal() -> Self {
        Self::at_rest(ANY_NORMAL_RAD * ANY_NORMAL_RAD)
    }

    /// Variance of the place.
    pub(super) fn variance(&self) -> f64 {
        let [place, ..] = self.covariance;
        place
    }

    /// The place is less certain by this variance.
    pub(super) fn widen(&mut self, variance: f64) {
        let [place, ..] = &mut self.covariance;
        *place += variance;
    }

    /// The rate is now followed by somebody else, and the place is less certain by this variance.
    pub(super) fn hold(&mut self, variance: f64) {
        *self = Self::at_rest(self.variance() + variance);
    }

    /// From now on the rate is what it was taken for, with this variance.
    pub(super) fn let_go(&mut self, variance: f64) {
        self.covariance = [self.variance(), 0.0, variance];
    }

    /// The rate is 0.
    pub(super) fn stop(&mut self) {
        *self = Self::at_rest(self.variance());
    }

    /// One tick under an acceleration that is unknown but of this size.
    pub(super) fn predict(&mut self, acceleration: f64) {
        let [p, pc, q] = self.covariance;
        let noise = acceleration * acceleration * TICK_S;
        self.covariance = [
            p + 2.0 * pc * TICK_S + q * TICK_S * TICK_S,
            pc + q * TICK_S,
            q + noise * TICK_S,
        ];
    }

    /// Takes a measured place of this variance; the shares of the innovation by which place and rate (1/s) are to be corrected.
    pub(super) fn measure(&mut self, variance: f64) -> (f64, f64) {
        let gains = self.measure_with(&mut [0.0; 3], 0.0, variance);
        gains.map_or((1.0, 0.0), |gains| (gains.place, gains.rate))
    }

    /// Takes a measurement of this variance that contains the place once and another quantity `share` times, `other` being the
    /// covariance of that one with the place, the rate and itself. None if the measurement and all of this are exact.
    pub(super) fn measure_with(
        &mut self,
        other: &mut [f64; 3],
        share: f64,
        variance: f64,
    ) -> Option<Gains> {
        let [p, pc, q] = self.covariance;
        let [po, co, o] = *other;
        let (sp, sc, so) = (p + share * po, pc + share * co, po + share * o);
        let total = sp + share * so + variance;
        if total <= 0.0 {
            return None;
        }
        let (place, rate) = (sp / total, sc / total);
        self.covariance = [
            p * (1.0 - place) - place * share * po,
            pc * (1.0 - place) - place * share * co,
            q - rate * sc,
        ];
        let gain = so / total;
        *other = [po - place * so, co - rate * so, o - gain * so];
        Some(Gains {
            place,
            rate,
            other: gain,
        })
    }
}

/// Shares of an innovation by which a measurement corrects.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) place: f64,
    /// 1/s.
    pub(super) rate: f64,
    /// Of the other quantity in it.
    pub(super) other: f64,
}
