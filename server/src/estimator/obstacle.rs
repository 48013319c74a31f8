//! An object that is pushed far harder than its friction explains: something else holds it.
//!
//! The local model knows no walls: one can be sent to it only as friction. A model that stands too early
//! is let go for free; one that has run ahead can be brought back only as far as its tank pays. It must never
//! take ordinary static friction, which gives way at once, for an obstacle, and never outlast the contact.

use mmt_shared::model::geometry::Vec2;

/// Force that static friction alone may hold: this share of c, and this much more, N.
const FRICTION_HOLDS: (f64, f64) = (1.25, 0.3);
/// How long a force beyond that must be held, ticks: a press rises through static friction sooner.
const HOLD_TICKS: u32 = 20;
/// A surface that is pressed beyond that and has gone no farther than so many m in so many ticks stands, however it trembles:
/// friction would have let 5 kg go farther.
const STAYS: (f64, u32) = (1.25e-3, 250);
/// An object that slides has hit something when the force exceeds what its motion needs by this share of c, and this
/// much more, N.
const PUSH_NEEDS: (f64, f64) = (3.0, 1.0);
/// How long that must last, ticks.
const IMPACT_TICKS: u32 = 5;
/// Friction that is sent for an object that stands, as a multiple of the force, where friction is known: as an obstacle it
/// gives way to nothing. Where friction is not known, it is at least the force.
const MARGIN: f64 = 2.0;
/// For so many ticks an object has slid before that is seen: it has to become as fast as the gate demands, and the speed is
/// filtered.
const UNSEEN_TICKS: usize = 20;
/// Share of the friction sent that the force may come to before more is sent.
const ENOUGH: f64 = 0.8;
/// Friction that is sent for an object that the hand does not move, N: how hard it is held cannot be seen, and a hand that
/// went on for a round trip presses its model with all that its stiffness gives.
pub const OBSTACLE_N: f64 = 150.0;

/// Stiffness k_p of a device, N/m, below which a hand that presses with all it has is far in the model. An object that nobody has moved
/// is then taken for one that the hand does not move under the share of that force which k_p is of this.
const SOFT_N_PER_M: f64 = 650.0;

/// The hand, as far as it decides what it can move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hand {
    /// It presses with no more, N.
    pub(super) force_max_n: f64,
    /// Stiffness k_p that its device renders, N/m.
    pub(super) device_n_per_m: f64,
}

impl Hand {
    /// What stands against more than this is held by something that the hand does not move, N.
    fn moves_with_n(&self, known: bool) -> f64 {
        let share = self.device_n_per_m / SOFT_N_PER_M;
        self.force_max_n * if known { 1.0 } else { share.min(1.0) }
    }
}

/// What a tick of contact is like, as [`Obstacle`] takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionState {
    /// It slides for certain, and has for so long that its acceleration is known.
    SlidesOn,
    /// It slides for certain.
    Slides,
    /// Too slow to be known.
    Slowly,
    /// It sticks.
    Sticks,
}

/// What friction is taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Friction {
    /// c, N.
    pub(super) c: f64,
    /// Whether c was seen for a while, and is not only what is believed of a body that nobody has pushed.
    pub(super) known: bool,
    /// Whether any of it was seen.
    pub(super) seen: bool,
    /// Share of c that a slow push meets where the object is pushed.
    pub(super) share: f64,
}

/// How long the surface has stayed where it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stays {
    from: Option<Vec2>,
    ticks: u32,
}

impl Stays {
    /// Takes the surface point (m) of a tick, and the inward normal; for how many ticks it has stayed there.
    pub(super) fn step(&mut self, point: Vec2, normal: Vec2) -> u32 {
        let (farthest, _) = STAYS;
        let stays = (self.from).is_some_and(|from| normal.dot(&(point - from)).abs() <= farthest);
        (self.from, self.ticks) = if stays {
            (self.from, self.ticks.saturating_add(1))
        } else {
            (Some(point), 0)
        };
        self.ticks
    }
}

/// The newest forces of a contact, N.
#[derive(Clone, Copy, Debug, Default)]
struct Forces {
    ring: [f64; UNSEEN_TICKS],
    next: usize,
}

impl Forces {
    /// Takes the force of a tick; that of [`UNSEEN_TICKS`] before, 0 before the contact.
    fn push(&mut self, force: f64) -> f64 {
        let slot = self.ring.get_mut(self.next);
        self.next = (self.next + 1) % UNSEEN_TICKS;
        slot.map_or(0.0, |slot| std::mem::replace(slot, force))
    }
}

/// Watches for an obstacle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Obstacle {
    hand: Hand,
    held_ticks: u32,
    pressed_ticks: u32,
    hard_ticks: u32,
    stands: bool,
    holding: Option<f64>,
    forces: Forces,
    /// The most that the object stood before the newest [`UNSEEN_TICKS`], N.
    stood_n: f64,
}

impl Obstacle {
    /// Nothing is known.
    pub(super) fn new(hand: Hand) -> Self {
        Self {
            hand,
            held_ticks: 0,
            pressed_ticks: 0,
            hard_ticks: 0,
            stands: false,
            holding: None,
            forces: Forces::default(),
            stood_n: 0.0,
        }
    }

    /// Takes the force (N) and whether the tool is `held_back`, presses with all that it may; the share m a + b v of the force
    /// that is `needed` to move the object so (N), how it moves, for how many ticks it `stayed` where it is ([`Stays`]), and
    /// the friction as it was estimated before. True in the tick in which the object is found to stand against an obstacle.
    pub(super) fn step(
        &mut self,
        (force, held_back): (f64, bool),
        needed: f64,
        motion: MotionState,
        stayed: u32,
        friction: Friction,
    ) -> bool {
        let (_, long) = STAYS;
        let slides = matches!(motion, MotionState::Slides | MotionState::SlidesOn);
        let before = self.forces.push(force);
        let stood_n = if self.stands { self.stood_n } else { 0.0 };
        self.stood_n = stood_n.max(before);
        if self.stands && (!slides || stayed >= long) {
            self.stand(force, friction.known);
            return false;
        }
        if self.stands && !friction.known {
            // it slid before that was seen: the force since then is no measure of friction
            let most = self.stood_n / friction.share;
            self.holding = self.holding.map(|holding| holding.min(most));
        }
        self.stands = false;
        // no force of the tool would be beyond a friction that a contact which gave way was taken for
        let pressed = held_back || beyond(force, FRICTION_HOLDS, friction.c);
        let held = pressed && motion == MotionState::Sticks;
        self.held_ticks = if held { self.held_ticks + 1 } else { 0 };
        self.pressed_ticks = if pressed { self.pressed_ticks + 1 } else { 0 };
        if self.held_ticks >= HOLD_TICKS || self.pressed_ticks.min(stayed) >= long {
            self.stands = true;
            self.holding = None;
            self.stand(force, friction.known);
            return true;
        }
        if !friction.known {
            // what has broken away was held by no more, and slides with as much until more is seen
            self.holding = self.holding.filter(|_| !friction.seen);
            return false;
        }
        let hard =
            motion == MotionState::SlidesOn && beyond(force - needed, PUSH_NEEDS, friction.c);
        self.hard_ticks = if hard { self.hard_ticks + 1 } else { 0 };
        self.holding = self.is_hit().then_some(force.min(OBSTACLE_N));
        false
    }

    /// The friction that is sent for an object that stands against this force, N.
    fn stand(&mut self, force: f64, known: bool) {
        let (margin, enough) = if known { (MARGIN, ENOUGH) } else { (1.0, 1.0) };
        if self.holding.is_none_or(|holding| force > enough * holding) {
            let held = force > self.hand.moves_with_n(known);
            self.holding = Some(if held { OBSTACLE_N } else { margin * force });
        }
    }

    /// The friction (N) that holds a model as the obstacle holds the object; none without an obstacle.
    #[must_use]
    pub(super) fn holding(&self) -> Option<f64> {
        self.holding
    }

    /// Whether the object slides on against something.
    #[must_use]
    pub(super) fn is_hit(&self) -> bool {
        self.hard_ticks >= IMPACT_TICKS
    }

    /// Contact was lost.
    pub(super) fn clear(&mut self) {
        *self = Self::new(self.hand);
    }
}

fn beyond(force: f64, (share, more): (f64, f64), c: f64) -> bool {
    force > share * c + more
}

#[cfg(test)]
mod tests;
