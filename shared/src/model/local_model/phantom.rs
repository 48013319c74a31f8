//! When the box goes at once to where it should be: another object, a phantom, a box that is touched by another face, one that
//! the HIP keeps from its place.
//!
//! What the coupling holds is lost then. It must never give the hand energy.

use super::LocalModel;
use super::body::Body;
use crate::model::contact::Touch;
use crate::model::correction::{Correction, ROOM_M};
use crate::model::geometry::{Face, Vec2};
use crate::model::update::Update;

/// A box that is touched this far from its place, m, with the HIP clear of that place, is a phantom.
const PHANTOM_M: f64 = 0.1;
/// A box this far from its place, m, with the HIP in front of another face than there, is beside its place.
const BESIDE_M: f64 = 0.01;
/// No object moves faster, m/s: the tool does not, as slaves are configured by default.
const FASTEST_M_PER_S: f64 = 0.6;
/// A place within 60° of the push lies ahead: the cosine of that.
const AHEAD: f64 = 0.5;
/// Faces that lie more than 45° apart, and less than that from opposite, are next to each other: the cosine of that.
const NEXT_FACE: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl LocalModel {
    /// An update whose place the object could not have been pushed to since the last one is of another object, unless the box
    /// has run on to there by itself: then it has no way to go.
    pub(super) fn compare_with_last(&mut self, update: &Update) {
        let Some(then) = self.history.at(update.answers) else {
            return;
        };
        let place = update.state.pose().position;
        let (touched, before) = self.last_update;
        let pushed = then.touched.saturating_sub(touched);
        let way_m = PHANTOM_M + FASTEST_M_PER_S * pushed.as_secs_f64();
        self.is_another |= (place - before).norm() > way_m;
        self.last_update = (then.touched, place);
    }

    /// The box goes at once to a place that is [`PHANTOM_M`] and more away, that the HIP keeps it from, or in which another face is
    /// touched, where that costs nothing.
    pub(super) fn leave_phantom(&mut self) {
        let is_far = self.correction.remaining.shift.norm() >= PHANTOM_M;
        self.is_another &= is_far;
        let Some((_, hip)) = self.previous else {
            return;
        };
        let (touch, (face, gap)) = (self.body.touch(hip), self.body.gap(hip));
        if let Some(short) = touch.and_then(|touch| self.short_of_next_face(&touch, hip)) {
            let replay = self.replay;
            self.changing(hip, |body, correction, _| {
                replay.hand_over(body, correction);
                correction.back_off(&mut body.state.pose, short);
            });
            return;
        }
        let goes = touch.map_or_else(
            || {
                self.is_another
                    || ((is_far || self.is_beside(hip, face)) && self.is_stopped_by(hip, gap))
            },
            |touch| is_far && self.is_phantom(&touch, hip),
        );
        if goes {
            self.changing(hip, |body, correction, _| {
                arrive(body, correction, hip);
                if touch.is_none() {
                    body.keep_off(hip, gap, correction);
                }
            });
        }
    }

    /// Whether what is felt is no more there: the HIP is clear of the place, and may stand in the way of the box. What the coupling
    /// holds is lost. Another object is felt at once where it is, if the HIP is no deeper in it than in the box. A box
    /// whose place is ahead of the push is no phantom: it recedes by the bleed, so that the hand does not let go and catch it
    /// again.
    fn is_phantom(&self, touch: &Touch, hip: Vec2) -> bool {
        if self.is_another {
            let there = self.there(hip);
            return there.is_none_or(|there| there.penetration <= touch.penetration);
        }
        let way = self.correction.remaining.shift;
        let is_ahead = touch.inward.dot(&way) > AHEAD * way.norm();
        !is_ahead && self.replay.is_clear_of(hip)
    }

    /// Whether a HIP that touches nothing keeps the box, `gap` (m) away, from its place, which is on the other side of the HIP or
    /// beside it.
    fn is_stopped_by(&self, hip: Vec2, gap: f64) -> bool {
        gap < 2.0 * ROOM_M && self.replay.is_hardly_entered(hip)
    }

    /// Whether a HIP in front of this face is in front of another one of the box in its place: on its way there the box would
    /// have to come round the HIP.
    fn is_beside(&self, hip: Vec2, face: Face) -> bool {
        self.correction.remaining.shift.norm() > BESIDE_M && self.replay.face(hip) != face
    }

    /// How far short of its place a box goes (m, world) that is touched there by the face next to the one that is felt: so far that
    /// the HIP presses no deeper than it did; the rest is bled in.
    fn short_of_next_face(&self, touch: &Touch, hip: Vec2) -> Option<Vec2> {
        if self.correction.remaining.shift.norm() <= BESIDE_M {
            return None;
        }
        let there = self.replay.touch(hip)?;
        let is_next = there.inward.dot(&touch.inward).abs() < NEXT_FACE;
        let short = there.inward * (there.penetration - touch.penetration).max(0.0);
        is_next.then_some(short)
    }

    /// What the HIP (m, world) touches of the box in its place.
    fn there(&self, hip: Vec2) -> Option<Touch> {
        let (mut body, mut correction) = (self.body, self.correction);
        arrive(&mut body, &mut correction, hip);
        body.touch(hip)
    }
}

/// Sets the box to its place at once.
fn arrive(body: &mut Body, correction: &mut Correction, hip: Vec2) {
    correction.snap(&mut body.state.pose);
    let state = &body.state;
    body.god.after_jump(&state.footprint, &state.pose, hip);
}
