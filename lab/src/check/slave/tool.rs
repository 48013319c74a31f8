//! Where the tool goes: its bounds, and when it has to stand.

use std::time::Duration;

use mmt_server::slave::SlaveTick;
use mmt_server::tool::force::ToolForce;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, TICK_S, Time};

use super::{SlaveChecks, SlaveTicked};
use crate::check::Invariant;

/// Rounding of places, m.
const HAIR_M: f64 = 1e-9;
/// From the end of the ramp to where the tool must stand: an overrun, and clocks that drift.
const SLACK: Duration = Duration::from_millis(12);
/// Clocks that drift make a tick longer or shorter by far less than this share.
const CLOCKS: f64 = 0.01;
/// By this share a tick of a clock that drifts may be shorter.
const DRIFT: f64 = 3e-4;
/// A force above is no error of the sensor's, N.
const FREE_N: f64 = 1.0;
/// The force may be above the limit by this share: the body moves on within a tick.
const FORCE_SHARE: f64 = 0.02;

impl SlaveChecks {
    /// Speed and reach. What a compliant tool gives by is not its way.
    pub(super) fn judge_tool(
        &mut self,
        tick: &SlaveTicked<'_>,
        done: &SlaveTick,
        elapsed: Duration,
    ) {
        if self.about.config.tool_compliance.is_some() {
            return;
        }
        let (now, period) = (tick.now, elapsed.max(TICK));
        let way = (done.tool - self.tool).norm();
        let most = self.speed() * period.as_secs_f64();
        self.verdict
            .judge(Invariant::ToolSpeed, now, way <= most + HAIR_M, || {
                format!("{way} m in {period:?}, {most} m are allowed")
            });
        // where the hand feels the tool, it goes only as far as the energy allows
        if !tick.end.architecture().feels_tool() {
            self.judge_acceleration(now, done, elapsed);
        }
        let (before, far) = (self.tool.norm(), done.tool.norm());
        let most = self.about.config.playout.reach_m.max(before);
        self.verdict
            .judge(Invariant::ToolReach, now, far <= most + HAIR_M, || {
                format!("{far} m from the origin, {most} m are allowed")
            });
    }

    /// Acceleration in free space. What the limit of its force does to a tool that touches something is not its own motion, nor
    /// is the end of its reach.
    fn judge_acceleration(&mut self, now: Time, done: &SlaveTick, elapsed: Duration) {
        let playout = &self.about.config.playout;
        let free = done.true_force == Vec2::zeros() && done.f_s.norm() < FREE_N;
        let inside = done.tool.norm() < playout.reach_m - HAIR_M;
        // in a shorter tick a tool that catches up goes as far as in a whole one
        let missed = elapsed > TICK.mul_f64(1.5) || elapsed < TICK.mul_f64(1.0 - DRIFT);
        let period_s = elapsed.max(TICK).as_secs_f64();
        let velocity = (done.tool - self.tool) / period_s;
        let velocity = Some(velocity).filter(|_| !missed && free && inside);
        let (Some(velocity), Some(before)) =
            (velocity, std::mem::replace(&mut self.velocity, velocity))
        else {
            return;
        };
        let change = (velocity - before).norm() / period_s;
        let most = playout.acceleration_max_m_per_s2;
        // a tick that is longer than others is not known before: at the speed at which a touch just costs the limit of the force,
        // the tool goes no farther than that allows
        let slows =
            elapsed > TICK && velocity.norm() >= self.touch_speed(period_s) * (1.0 - CLOCKS);
        let holds = change <= most * (1.0 + CLOCKS) + HAIR_M / (TICK_S * TICK_S) || slows;
        self.verdict
            .judge(Invariant::ToolAcceleration, now, holds, || {
                format!("{change} m/s², {most} m/s² are allowed")
            });
    }

    /// The greatest speed, m/s: the configured one, and that at which a first touch costs the limit of the force.
    fn speed(&self) -> f64 {
        let most = self.about.config.playout.speed_max_m_per_s;
        most.min(self.touch_speed(TICK_S))
    }

    /// The speed (m/s) in a tick of `period_s` (s) at which a touch costs the limit of the force: the tool stops a tick later.
    fn touch_speed(&self, period_s: f64) -> f64 {
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.about.coupling;
        ToolForce::aim_n(self.about.config.tool_force_max_n) / (k_d + k_p * (period_s + TICK_S))
    }

    /// Hold, disengaged and emergency stop: the tool stands, or brakes as hard as it may. One that is pressed on may give way.
    pub(super) fn judge_standing(
        &mut self,
        tick: &SlaveTicked<'_>,
        done: &SlaveTick,
        elapsed: Duration,
    ) {
        let (now, way) = (tick.now, done.tool - self.tool);
        let stands = way.norm() <= HAIR_M
            || self.f_s.dot(&way) < 0.0
            || self.about.config.tool_compliance.is_some();
        let playout = &self.about.config.playout;
        let period = elapsed.max(TICK).as_secs_f64();
        let velocity = way / period;
        let slower = playout.acceleration_max_m_per_s2 * period * (1.0 - CLOCKS);
        let (before, change) = (self.velocity_before, velocity - self.velocity_before);
        let speed = before.norm();
        let against = slower * least_share(speed / slower);
        let brakes = change.norm() >= slower && -change.dot(&before) >= against * speed;
        let stands = stands || brakes;
        // after ticks that were missed the way may have been gone in the last of them
        self.velocity_before = way / TICK_S;
        let ramp =
            playout.extrapolation_ms * 1e-3 + self.speed() / playout.acceleration_max_m_per_s2;
        let ramp = Duration::from_secs_f64(ramp) + SLACK;
        let beyond = done.stamp.saturating_since(self.newest.unwrap_or_default());
        // the rest of a ramp that the process stood through is gone in the first tick after
        let missed = elapsed.saturating_sub(TICK);
        if beyond.min(self.quiet).saturating_sub(missed) > ramp {
            self.verdict.judge(Invariant::ToolHolds, now, stands, || {
                format!("the tool goes {way:?} m at a stamp {beyond:?} after the newest sample's")
            });
        }
        if self.disengaged {
            self.verdict
                .judge(Invariant::ToolDisengaged, now, stands, || {
                    format!("the tool goes {way:?} m in a session that is disengaged")
                });
        }
        let stops = tick.given.stops || self.channel.other_stops();
        if stops && self.stopped {
            self.verdict.judge(Invariant::ToolStops, now, stands, || {
                format!("the tool goes {way:?} m during an emergency stop")
            });
        }
        self.stopped = stops;
    }

    pub(super) fn judge_force(&mut self, now: Time, done: &SlaveTick) {
        let config = &self.about.config;
        let known = config.environment.contact.is_none_or(|contact| {
            contact.stiffness_n_per_m <= self.about.coupling.stiffness_n_per_m
                && contact.damping_ns_per_m <= self.about.coupling.damping_ns_per_m
        });
        let sensor = &config.sensing;
        let scene = &config.scene;
        // what stops the object at once costs the damping of its speed for a tick: nobody can know before
        let meets = scene.bodies.len() > 1 || !scene.walls.is_empty();
        let stop = if meets || config.environment.wall.is_some() {
            self.about.coupling.damping_ns_per_m * self.speed()
        } else {
            0.0
        };
        // a sensor that lags is no judge of the last milliseconds
        if !known || sensor.force_lag_ms > 0.0 {
            return;
        }
        let drift =
            sensor.force_drift_n_per_s * now.saturating_since(self.about.began).as_secs_f64();
        let errors = sensor.force_bias_n + drift + 6.0 * sensor.force_noise_n;
        let gain = sensor.force_gain.min(1.0);
        let most = (config.tool_force_max_n * (1.0 + FORCE_SHARE) + errors) / gain + stop;
        let force = done.true_force.norm();
        // a tool that was deceived has to come back first
        self.unmeasured = self.sensor_broken || (self.unmeasured && force > most);
        if !self.unmeasured {
            self.verdict
                .judge(Invariant::ToolForce, now, force <= most, || {
                    format!("{force} N, {most} N are allowed")
                });
        }
    }
}

/// The least share of its greatest acceleration that is against the velocity of a tool that brakes as hard as it may. A limit of the
/// tool's may have it brake against a face before it brakes along it: the change of its velocity is then along −v̂ − r (n̂·v̂) n̂ at the
/// most, n̂ pointing into the face, r (`speed`) being its speed over what it may lose in a tick. With x = r (n̂·v̂)² the part of that
/// along −v̂ is (1 + x)/√(1 + (r + 2) x), which is least at x = r/(r + 2).
fn least_share(speed: f64) -> f64 {
    2.0 * (1.0 + speed).sqrt() / (2.0 + speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_share_is_the_least_over_all_directions_of_the_face() {
        for speed in [0.0, 0.5, 13.7, 30.0] {
            let shares = (0..=10_000).map(|k| {
                let angle = f64::from(k) * 1e-4 * std::f64::consts::FRAC_PI_2;
                let (velocity, n) = (
                    Vec2::new(1.0, 0.0),
                    Vec2::new(libm::cos(angle), libm::sin(angle)),
                );
                let change = -velocity - n * (speed * n.dot(&velocity));
                -change.dot(&velocity) / change.norm()
            });
            let least = shares.fold(f64::INFINITY, f64::min);
            assert!(
                (least_share(speed) - least).abs() < 1e-6,
                "{speed}: {least}"
            );
        }
    }
}
