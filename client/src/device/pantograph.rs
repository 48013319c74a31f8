//! The planar pantograph of a Haply 2DIY: angles of its two motors to the place of its tool, and a force there to torques.
//!
//! Five bars. The axes of the motors stand at (0, 0) and (d, 0); on each turns an upper arm of length l, and from the ends A and
//! B of those, the elbows, two forearms of length L meet at the tool P, on the side of larger y. Lengths and the sense of the
//! angles are those of the vendor's published client (PyPI `HaplyHAPI` 1.0.1, class `Pantograph`); the formulas are our own:
//!
//! ```text
//! |P - A| = |P - B| = L                                  P: where two circles meet
//! (P - A)·dP = (P - A)·dA,  (P - B)·dP = (P - B)·dB      both forearms keep their length
//! dP = J dθ = U⁻¹ D dθ,     τ = Jᵀ f                     U: rows P - A, P - B;  D: diagonal
//! ```
//!
//! J breaks down where the forearms lie on one line (det U = 0: torques without end), and loses a direction where an arm is
//! stretched or folded (an element of D = 0: no torque makes the force). The least sine of these three angles is the margin; the
//! force fades to nothing before it vanishes. Pure.

use mmt_shared::model::geometry::Vec2;

use super::link::Version;

/// l, m.
const UPPER_ARM_M: f64 = 0.07;
/// L, m.
const FOREARM_M: f64 = 0.09;
/// d of version 3, m; of version 2 it is 0.
const BASE_M: f64 = 0.038;
/// At a margin of no more than this (3°) the tool is nowhere.
const MARGIN_NONE: f64 = 0.05;
/// From this margin on (17°) all of the force acts.
const MARGIN_WHOLE: f64 = 0.3;

/// The bars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pantograph {
    base_m: f64,
}

/// The bars in one posture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// The tool, m.
    pub tool: Vec2,
    /// The columns of J: the tool's way for a radian of each motor, m.
    ways: [Vec2; 2],
    /// The least sine of an angle that must not vanish.
    margin: f64,
}

impl Pantograph {
    /// The bars of this version.
    pub fn new(version: Version) -> Self {
        Self {
            base_m: match version {
                Version::Two => 0.0,
                Version::Three => BASE_M,
            },
        }
    }

    /// The posture at these angles of the motors, rad; none where the forearms do not reach each other, or lie nearly on a line.
    pub fn posture(&self, angles: [f64; 2]) -> Option<Posture> {
        let [first, second] = angles.map(|angle| {
            let (sin, cos) = libm::sincos(angle);
            (Vec2::new(cos, sin), Vec2::new(-sin, cos))
        });
        let a = first.0 * UPPER_ARM_M;
        let b = Vec2::new(self.base_m, 0.0) + second.0 * UPPER_ARM_M;
        let half = (b - a) / 2.0;
        let height_squared = FOREARM_M * FOREARM_M - half.norm_squared();
        let length = half.norm();
        if !(height_squared > 0.0 && length > 0.0) {
            return None;
        }
        let across = Vec2::new(-half.y, half.x) / length;
        let tool = a + half + across * height_squared.sqrt();
        let (u, v) = (tool - a, tool - b);
        let determinant = cross(u, v);
        // D: how far each forearm is pushed along itself for a radian of its motor
        let pushed = [
            u.dot(&first.1) * UPPER_ARM_M,
            v.dot(&second.1) * UPPER_ARM_M,
        ];
        let sines = [
            determinant / (FOREARM_M * FOREARM_M),
            pushed[0] / (UPPER_ARM_M * FOREARM_M),
            pushed[1] / (UPPER_ARM_M * FOREARM_M),
        ];
        let margin = sines.into_iter().map(f64::abs).fold(1.0, f64::min);
        // U⁻¹ by its adjugate
        let ways = [
            Vec2::new(v.y, -v.x) * (pushed[0] / determinant),
            Vec2::new(-u.y, u.x) * (pushed[1] / determinant),
        ];
        (margin > MARGIN_NONE).then_some(Posture { tool, ways, margin })
    }

    /// The angles of the motors, rad, with the tool there (m) and the elbows outwards; none where it does not reach.
    pub fn angles(&self, tool: Vec2) -> Option<[f64; 2]> {
        let arm = |from: Vec2, side: f64| {
            let way = tool - from;
            let reach = way.norm();
            let cos = (UPPER_ARM_M * UPPER_ARM_M + reach * reach - FOREARM_M * FOREARM_M)
                / (2.0 * UPPER_ARM_M * reach);
            let within = (-1.0..=1.0).contains(&cos);
            within.then(|| libm::atan2(way.y, way.x) + side * libm::acos(cos))
        };
        let first = arm(Vec2::zeros(), 1.0)?;
        Some([first, arm(Vec2::new(self.base_m, 0.0), -1.0)?])
    }
}

impl Posture {
    /// The torques of the motors, Nm, that make this force at the tool, N: all of it where the posture is far from singular, and
    /// none at its rim. No torque above `most`, Nm: both are made smaller alike.
    pub fn torques(&self, force: Vec2, most: f64) -> [f64; 2] {
        let share = (self.margin - MARGIN_NONE) / (MARGIN_WHOLE - MARGIN_NONE);
        let force = force * share.clamp(0.0, 1.0);
        let torques = self.ways.map(|way| way.dot(&force));
        let largest = torques.into_iter().map(f64::abs).fold(0.0, f64::max);
        let shrink = if largest > most { most / largest } else { 1.0 };
        torques.map(|torque| torque * shrink)
    }

    /// How fast the tool is, m/s, at these speeds of the motors, rad/s.
    pub fn velocity(&self, speeds: [f64; 2]) -> Vec2 {
        let [first, second] = self.ways;
        first * speeds[0] + second * speeds[1]
    }
}

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Version; 2] = [Version::Two, Version::Three];

    /// Places of the default workspace, m.
    fn places(version: Version) -> impl Iterator<Item = Vec2> {
        let x = match version {
            Version::Two => 0.0,
            Version::Three => 0.019,
        };
        let steps = (-5..=5).flat_map(|n| (-5..=5).map(move |m| (f64::from(n), f64::from(m))));
        steps.map(move |(n, m)| Vec2::new(x + n * 0.01, 0.09 + m * 0.01))
    }

    #[test]
    fn the_tool_is_where_the_angles_put_it_all_over_the_workspace() {
        for version in BOTH {
            let bars = Pantograph::new(version);
            for place in places(version) {
                let angles = bars.angles(place).unwrap();
                let posture = bars.posture(angles).unwrap();
                assert!((posture.tool - place).norm() < 1e-12, "{place}");
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_difference_quotient_of_the_place() {
        const STEP: f64 = 1e-6;
        for version in BOTH {
            let bars = Pantograph::new(version);
            for place in places(version) {
                let [a, b] = bars.angles(place).unwrap();
                let posture = bars.posture([a, b]).unwrap();
                let at = |a, b| bars.posture([a, b]).unwrap().tool;
                let quotients = [
                    (at(a + STEP, b) - at(a - STEP, b)) / (2.0 * STEP),
                    (at(a, b + STEP) - at(a, b - STEP)) / (2.0 * STEP),
                ];
                for (way, quotient) in posture.ways.into_iter().zip(quotients) {
                    assert!((way - quotient).norm() < 1e-7, "{way} {quotient}");
                }
                let velocity = posture.velocity([0.5, -0.25]);
                let expected = quotients[0] * 0.5 - quotients[1] * 0.25;
                assert!((velocity - expected).norm() < 1e-7);
            }
        }
    }

    #[test]
    fn torques_do_the_work_of_the_force() {
        // virtual work: tau · dθ = f · dP for every small turn
        let bars = Pantograph::new(Version::Three);
        let force = Vec2::new(1.5, -0.75);
        let angles = bars.angles(Vec2::new(0.03, 0.1)).unwrap();
        let posture = bars.posture(angles).unwrap();
        let torques = posture.torques(force, 10.0);
        for turn in [[1e-6, 0.0], [0.0, 1e-6], [1e-6, -2e-6]] {
            let moved = bars.posture([angles[0] + turn[0], angles[1] + turn[1]]);
            let way = moved.unwrap().tool - posture.tool;
            let work = torques[0] * turn[0] + torques[1] * turn[1];
            assert!((work - force.dot(&way)).abs() < 1e-11);
        }
    }

    #[test]
    fn places_and_torques_are_those_of_the_vendors_own_client() {
        // printed by HaplyHAPI 1.0.1: the place, and the torques for 1.5 N and -0.75 N; the first two are its start
        for (version, degrees, tool, torques) in [
            (
                Version::Three,
                [168.0_f64, 12.0],
                [0.019, 0.035_742_046_476],
                [0.024_852_347_129, -0.071_561_767_489],
            ),
            (
                Version::Two,
                [241.0, -61.0],
                [0.0, 0.022_133_097_137],
                [-0.013_220_704_699, -0.019_978_941_007],
            ),
            (
                Version::Three,
                [150.0, 20.0],
                [0.024_009_870_117, 0.065_618_362_010],
                [-0.002_170_358_174, -0.085_240_495_008],
            ),
            (
                Version::Two,
                [130.0, 40.0],
                [0.010_865_179_729, 0.124_189_572_583],
                [-0.071_915_422_850, -0.122_517_820_821],
            ),
        ] {
            let posture = Pantograph::new(version).posture(degrees.map(f64::to_radians));
            let posture = posture.unwrap();
            assert!((posture.tool - Vec2::new(tool[0], tool[1])).norm() < 1e-11);
            let force = Vec2::new(1.5, -0.75);
            for (way, torque) in posture.ways.into_iter().zip(torques) {
                assert!((way.dot(&force) - torque).abs() < 1e-11, "{version:?}");
            }
        }
    }

    #[test]
    fn the_force_fades_to_nothing_before_the_rim_and_is_whole_in_the_workspace() {
        let force = Vec2::new(0.0, 3.0);
        for version in BOTH {
            let bars = Pantograph::new(version);
            for place in places(version) {
                let posture = bars.posture(bars.angles(place).unwrap()).unwrap();
                assert!(posture.margin > MARGIN_WHOLE, "{place}: {}", posture.margin);
            }
            // straight out until the arms are stretched: never a jump, and none at the end
            let x = places(version).map(|place| place.x).sum::<f64>() / 121.0;
            let (mut last, mut most, mut end) = (f64::NAN, 0.0_f64, f64::NAN);
            for step in 0..20_000 {
                let place = Vec2::new(x, 0.09 + f64::from(step) * 1e-5);
                let Some(angles) = bars.angles(place) else {
                    break;
                };
                let Some(posture) = bars.posture(angles) else {
                    break;
                };
                let torques = posture.torques(force, 10.0);
                let size = torques[0].abs().max(torques[1].abs());
                most = most.max(size);
                assert!(last.is_nan() || (size - last).abs() < 0.01, "{place}");
                (last, end) = (size, size);
            }
            assert!(most > 0.05 && end < 0.02 * most, "{version:?} {most} {end}");
        }
    }

    #[test]
    fn forearms_on_a_line_and_numbers_that_are_none_are_no_posture() {
        let bars = Pantograph::new(Version::Three);
        let apart = [180.0_f64, 0.0].map(f64::to_radians);
        assert!(Pantograph::new(Version::Two).posture([1.0, 1.0]).is_none());
        assert!(bars.posture([f64::NAN, 0.0]).is_none());
        assert!(bars.posture([0.0, f64::INFINITY]).is_none());
        // 178 mm between the elbows, and two forearms of 90 mm: nearly on a line
        let posture = bars.posture(apart);
        assert!(posture.is_none_or(|posture| posture.margin < 0.3));
        // elbows further apart than both forearms are long
        let wide = Pantograph { base_m: 0.1 };
        assert!(wide.posture(apart).is_none());
    }

    #[test]
    fn no_torque_is_above_the_greatest_and_both_shrink_alike() {
        let bars = Pantograph::new(Version::Three);
        let posture = bars.posture(bars.angles(Vec2::new(0.0, 0.1)).unwrap());
        let posture = posture.unwrap();
        let free = posture.torques(Vec2::new(6.0, 8.0), f64::MAX);
        let held = posture.torques(Vec2::new(6.0, 8.0), 0.1);
        let largest = held[0].abs().max(held[1].abs());
        assert!((largest - 0.1).abs() < 1e-12, "{held:?}");
        assert!((free[0] * held[1] - free[1] * held[0]).abs() < 1e-12);
    }
}
