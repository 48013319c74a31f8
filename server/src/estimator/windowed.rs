//! Windowed ("block") least squares: (3) over a sliding window, for (2) in the plane.
//!
//! The paper writes (1)–(3) for one direction and measures in the plane, and does not state how. Two readings:
//! along the force, one row a tick, which is (1) where the tool does not slide on the object; or
//! stacked, two rows a tick, x and y, in which c·sign(v) becomes c·v/|v|. (The sign of each axis by itself
//! would make friction √2 c at 45°.) The result is the plain minimum, bounded by nothing.

use mmt_shared::model::geometry::Vec2;
use nalgebra::{Matrix3, Matrix3x2, Vector3};
use serde::{Deserialize, Serialize};

use super::quadratic::{condition, inverse_of_gram};

/// Above this condition number there is no solution and the last value is kept.
///
/// At 10⁴ a force error of 1 mN is worth 10 N of some combination of m a, b v and c.
const CONDITION_MAX: f64 = 1e4;

/// How a tick in the plane becomes rows of (3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rows {
    /// One row: force and motion along the measured force.
    #[default]
    AlongForce,
    /// Two rows: x and y. Counts sliding of the tool along the face as motion of the object.
    Stacked,
}

impl Rows {
    fn in_a_tick(self) -> f64 {
        match self {
            Self::AlongForce => 1.0,
            Self::Stacked => 2.0,
        }
    }
}

/// One tick of (1) in the plane: one column of regressors and one force for each axis, or for the direction
/// of the force and for nothing.
#[derive(Clone, Copy, Debug)]
struct PlanarRow {
    regressor: Matrix3x2<f64>,
    force: Vec2,
}

/// Sums of products over rows.
#[derive(Clone, Copy, Debug)]
struct Sums {
    gram: Matrix3<f64>,
    moment: Vector3<f64>,
    squares: f64,
}

impl Sums {
    const ZERO: Self = Self {
        gram: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 0.0),
        squares: 0.0,
    };

    fn add(&mut self, row: &PlanarRow, weight: f64) {
        self.gram += row.regressor * row.regressor.transpose() * weight;
        self.moment += row.regressor * row.force * weight;
        self.squares += row.force.norm_squared() * weight;
    }
}

/// The solution of a full window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solution {
    /// m (kg), b (N s/m), c (N), whatever their sign.
    pub estimate: Vector3<f64>,
    /// Their covariance, as if the errors of the rows were independent.
    pub covariance: Matrix3<f64>,
}

/// The window: a ring of rows and their sums.
#[derive(Clone, Debug)]
pub(super) struct WindowedLeastSquares {
    rows: Rows,
    ring: Box<[PlanarRow]>,
    next: usize,
    filled: bool,
    sums: Sums,
    /// Sums since the ring last began anew. They replace the running sums each time round, so that the
    /// rounding errors of adding and taking away do not add up, and an outlier leaves no trace.
    fresh: Sums,
}

impl WindowedLeastSquares {
    /// A window of `ticks` rows (at least 2). Allocates here and never again.
    #[must_use]
    pub(super) fn new(ticks: usize, rows: Rows) -> Self {
        let empty = PlanarRow {
            regressor: Matrix3x2::zeros(),
            force: Vec2::zeros(),
        };
        Self {
            rows,
            ring: vec![empty; ticks.max(2)].into_boxed_slice(),
            next: 0,
            filled: false,
            sums: Sums::ZERO,
            fresh: Sums::ZERO,
        }
    }

    /// Contact was lost: the window starts anew.
    pub(super) fn clear(&mut self) {
        (self.next, self.filled) = (0, false);
        (self.sums, self.fresh) = (Sums::ZERO, Sums::ZERO);
    }

    /// Takes one tick: acceleration (m/s²), velocity (m/s), force on the object (N).
    pub(super) fn push(&mut self, a: Vec2, v: Vec2, force: Vec2) {
        let row = match self.rows {
            Rows::AlongForce => along_force(a, v, force),
            Rows::Stacked => stacked(a, v, force),
        };
        let Some(slot) = self.ring.get_mut(self.next) else {
            return;
        };
        let old = std::mem::replace(slot, row);
        if self.filled {
            self.sums.add(&old, -1.0);
        }
        self.sums.add(&row, 1.0);
        self.fresh.add(&row, 1.0);
        self.next += 1;
        if self.next == self.ring.len() {
            (self.next, self.filled) = (0, true);
            self.sums = std::mem::replace(&mut self.fresh, Sums::ZERO);
        }
    }

    /// The condition number of the window and, if the window is full and can be solved, the solution.
    #[must_use]
    pub(super) fn solve(&self) -> (f64, Option<Solution>) {
        let inverse = inverse_of_gram(&self.sums.gram);
        let condition = condition(&self.sums.gram, inverse.as_ref());
        let solvable = self.filled && condition < CONDITION_MAX;
        let solution = inverse.filter(|_| solvable).map(|inverse| {
            // (3)
            let estimate = inverse * self.sums.moment;
            let rows = self.rows.in_a_tick() * self.ring.len() as f64;
            let error = (self.sums.squares - estimate.dot(&self.sums.moment)).max(0.0);
            Solution {
                estimate,
                covariance: inverse * (error / (rows - 3.0)),
            }
        });
        let finite = |s: &Solution| {
            s.estimate
                .iter()
                .chain(s.covariance.iter())
                .all(|x| x.is_finite())
        };
        (condition, solution.filter(finite))
    }
}

/// (2) along the force.
fn along_force(a: Vec2, v: Vec2, force: Vec2) -> PlanarRow {
    let size = force.norm();
    let normal = if size > 0.0 {
        force / size
    } else {
        Vec2::zeros()
    };
    let (a, v) = (a.dot(&normal), v.dot(&normal));
    let sign = if v == 0.0 { 0.0 } else { v.signum() };
    PlanarRow {
        // (2)
        regressor: Matrix3x2::new(a, 0.0, v, 0.0, sign, 0.0),
        force: Vec2::new(size, 0.0),
    }
}

/// (2) for x and for y.
fn stacked(a: Vec2, v: Vec2, force: Vec2) -> PlanarRow {
    let speed = v.norm();
    let sliding = if speed > 0.0 {
        v / speed
    } else {
        Vec2::zeros()
    };
    PlanarRow {
        // (2)
        regressor: Matrix3x2::from_rows(&[a.transpose(), v.transpose(), sliding.transpose()]),
        force,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::rotate;

    const TRUTH: Vector3<f64> = Vector3::new(0.7, 3.0, 2.06);

    /// Motion and force of (1) at 30° to the axes.
    fn exact(k: u32) -> (Vec2, Vec2, Vec2) {
        let t = f64::from(k) * 1e-3;
        let along = |x: f64| rotate(0.5, Vec2::new(x, 0.0));
        let v = 0.16 + 0.05 * libm::sin(4.0 * t) + 0.02 * libm::cos(13.0 * t);
        let a = 0.2 * libm::cos(4.0 * t) - 0.26 * libm::sin(13.0 * t);
        (along(a), along(v), along(0.7 * a + 3.0 * v + 2.06))
    }

    #[test]
    fn exact_data_of_1_give_the_parameters_by_3() {
        for rows in [Rows::AlongForce, Rows::Stacked] {
            let mut window = WindowedLeastSquares::new(200, rows);
            for k in 0..2000 {
                let (a, v, f) = exact(k);
                window.push(a, v, f);
                if k > 200 {
                    let (_, solution) = window.solve();
                    assert!((solution.unwrap().estimate - TRUTH).norm() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn an_outlier_is_forgotten_without_a_trace_after_two_windows() {
        let mut window = WindowedLeastSquares::new(200, Rows::AlongForce);
        for k in 0..1000 {
            let (a, v, f) = exact(k);
            window.push(a, v, if k == 300 { f * 1e9 } else { f });
        }
        let (_, solution) = window.solve();
        assert!((solution.unwrap().estimate - TRUTH).norm() < 1e-8);
    }

    #[test]
    fn a_window_that_is_not_full_or_is_singular_gives_nothing() {
        let mut window = WindowedLeastSquares::new(200, Rows::AlongForce);
        let (a, v, f) = exact(0);
        for k in 0..1000 {
            assert!(window.solve().1.is_none(), "constant motion, tick {k}");
            window.push(a, v, f);
        }
        window.clear();
        for k in 0..200 {
            assert!(window.solve().1.is_none(), "tick {k}");
            let (a, v, f) = exact(k);
            window.push(a, v, f);
        }
        assert!(window.solve().1.is_some());
    }

    #[test]
    fn a_tool_that_slides_along_the_face_deceives_the_stacked_rows_only() {
        let error = |rows| {
            let mut window = WindowedLeastSquares::new(200, rows);
            for k in 0..400 {
                let (a, v, f) = exact(k);
                let along_face = rotate(0.5, Vec2::new(0.0, 0.05));
                window.push(a, v + along_face, f);
            }
            (window.solve().1.unwrap().estimate - TRUTH).norm()
        };
        assert!(error(Rows::AlongForce) < 1e-8);
        assert!(error(Rows::Stacked) > 0.1);
    }
}
