//! The distances from the object's centre to its faces, as they are learned, guessed and retracted.
//!
//! An offset that is guessed or retracted never leaves the range that the model accepts.

use mmt_shared::model::geometry::{BoxFootprint, Face, PerFace, Vec2};
use mmt_shared::model::params::FACE_OFFSET_M;

use super::tangent_tracker::TangentTracker;
use super::tracker::Tracker;

/// A retracted face lies this far behind the tool that did not touch it, m; twice as far each time that the
/// tool still touches nothing, up to the most: the real face is found in a few steps, not in a hundred.
const MARGIN_M: (f64, f64) = (1e-3, 8e-3);
/// The next contact with a body that is no box is expected this much nearer than any so far, m.
const GUESS_MARGIN_M: f64 = 0.01;
/// Variance of the offset of a face that nothing is known of, m².
const UNKNOWN_M2: f64 = 0.1 * 0.1;

/// Footprint and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceMap {
    pub(super) footprint: BoxFootprint,
    /// Variance of each face's offset, m²; none of a face that nothing is known of.
    variances: PerFace<Option<f64>>,
    /// How far behind the tool the next retracted face will lie, m.
    margin: f64,
}

impl FaceMap {
    /// A footprint of which each face is known to `error` (m r.m.s.), or none is.
    pub(super) fn new(footprint: BoxFootprint, error: Option<f64>) -> Self {
        let variance = error.map(|error| error * error);
        Self {
            footprint,
            variances: PerFace {
                east: variance,
                north: variance,
                west: variance,
                south: variance,
            },
            margin: MARGIN_M.0,
        }
    }

    /// The tool touches the object: the search for the face is over.
    pub(super) fn touched(&mut self) {
        self.margin = MARGIN_M.0;
    }

    /// Whether the face has been learned.
    pub(super) fn is_known(&self, face: Face) -> bool {
        self.variances.get(face).is_some()
    }

    /// How far a point of the object's frame is outside, m, and the variance of that, m²; none where nothing is known of that face.
    pub(super) fn outside(&self, point: Vec2) -> Option<(f64, f64)> {
        let (face, distance) = self.footprint.nearest(point);
        Some((distance, self.variances.get(face)?))
    }

    /// Sets an offset (m), or the least one that is accepted.
    pub(super) fn set_accepted(&mut self, face: Face, offset: f64) {
        self.footprint.set_offset(face, offset.max(FACE_OFFSET_M.0));
    }

    /// Learns an offset (m) that is known to `variance` (m²): from an image, or from touch where the centre is known.
    pub(super) fn learn(&mut self, tracker: &mut Tracker, face: Face, offset: f64, variance: f64) {
        let known = self.footprint.offset(face);
        match tracker {
            Tracker::Box(_) => self.learn_box(face, known, offset, variance),
            // no face is known of a body that is pushed slowly
            Tracker::Slow(_) => {}
            Tracker::Tangent(tangent) if tangent.is_settling() => {}
            Tracker::Tangent(tangent) => {
                let mean = known + (offset - known) * tangent.offset_weight();
                self.set_accepted(face, mean);
            }
        }
    }

    /// Kalman filter of a constant. As long as one face only has been learned, its offset is the best guess for the others
    /// (a square is assumed).
    fn learn_box(&mut self, face: Face, known: f64, offset: f64, variance: f64) {
        let before = self.variances.get(face).unwrap_or(UNKNOWN_M2);
        let total = before + variance;
        let gain = if total > 0.0 { before / total } else { 0.0 };
        *self.variances.get_mut(face) = Some(before * (1.0 - gain));
        let mean = known + (offset - known) * gain;
        self.set_accepted(face, mean);
        let others = Face::ALL.into_iter().filter(|other| *other != face);
        if others.clone().any(|other| self.is_known(other)) {
            return;
        }
        for other in others {
            self.set_accepted(other, mean);
        }
    }

    /// Of a body that is no box the next contact will be another: its face is guessed to be nearer than any
    /// so far. A face that the tool meets too early is brought up to it at once; one that is met too late
    /// may recede from the hand only slowly.
    pub(super) fn guess(&mut self, tangent: &mut TangentTracker, touched: Face) {
        let least = tangent.least_offset(self.footprint.offset(touched));
        for face in Face::ALL {
            self.set_accepted(face, least - GUESS_MARGIN_M);
        }
    }

    /// The tool is `depth` (m) behind a face and touches nothing. Retracts the face if it `may_retract`; else returns how
    /// far the whole box is to be moved along the face's inward normal, m.
    pub(super) fn retract(&mut self, face: Face, depth: f64, may_retract: bool) -> Option<f64> {
        let depth = depth + self.margin;
        if depth <= 0.0 {
            return None;
        }
        if !may_retract {
            return Some(depth - self.margin + MARGIN_M.0);
        }
        self.margin = (self.margin * 2.0).min(MARGIN_M.1);
        // a tool past the centre has not found a face; the offset stays in its accepted range
        self.set_accepted(face, self.footprint.offset(face) - depth);
        None
    }
}
