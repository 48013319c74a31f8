//! Nonlinear least squares (Levenberg 1944, Marquardt 1963), a step at a time. Pure.

use nalgebra::{SMatrix, SVector};

/// A search for the `N` unknowns with the least cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevenbergMarquardt<const N: usize> {
    /// The best unknowns so far.
    pub(crate) at: SVector<f64, N>,
    /// Their cost.
    pub(crate) cost: f64,
    /// Share of the Hessian's diagonal that is added to it: a small one makes the step Gauss and Newton's, a large one a short step.
    lift: f64,
}

/// What a step came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// The cost fell by this share.
    Fell(f64),
    /// The cost would not have fallen. The next step is shorter.
    Stayed,
    /// The Hessian is not positive definite: there is no step.
    Stuck,
}

impl Step {
    /// Whether a search ends here that ends where the cost falls by less than this share.
    pub(crate) fn is_last(self, fall: f64) -> bool {
        match self {
            Self::Fell(share) => share < fall,
            Self::Stayed => false,
            Self::Stuck => true,
        }
    }
}

impl<const N: usize> LevenbergMarquardt<N> {
    /// Begins at `at`, whose cost is `cost`, with `lift` added to the Hessian's diagonal, as a share of it.
    pub(crate) fn new(at: SVector<f64, N>, cost: f64, lift: f64) -> Self {
        Self { at, cost, lift }
    }

    /// One step, given half of the Gauss–Newton Hessian and half of the gradient of the cost where the search is. It never goes to where the
    /// cost is no number.
    pub(crate) fn step(
        &mut self,
        hessian: &SMatrix<f64, N, N>,
        gradient: &SVector<f64, N>,
        cost_of: impl FnOnce(&SVector<f64, N>) -> f64,
    ) -> Step {
        let lifted = hessian + SMatrix::from_diagonal(&(hessian.diagonal() * self.lift));
        let Some(factor) = lifted.cholesky() else {
            return Step::Stuck;
        };
        let next = self.at - factor.solve(gradient);
        let cost = cost_of(&next);
        // written so that NaN fails
        if cost < self.cost {
            let fall = (self.cost - cost) / self.cost;
            (self.at, self.cost, self.lift) = (next, cost, self.lift * 0.2);
            Step::Fell(fall)
        } else {
            self.lift *= 8.0;
            Step::Stayed
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};

    use super::*;

    /// Rosenbrock's valley: residuals 10 (y − x²) and 1 − x, least at (1, 1).
    fn residuals(at: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(10.0 * (at.y - at.x * at.x), 1.0 - at.x)
    }

    fn cost(at: &Vector2<f64>) -> f64 {
        residuals(at).norm_squared()
    }

    fn step(search: &mut LevenbergMarquardt<2>) -> Step {
        let slopes = Matrix2::new(-20.0 * search.at.x, 10.0, -1.0, 0.0);
        let gradient = slopes.transpose() * residuals(&search.at);
        search.step(&(slopes.transpose() * slopes), &gradient, cost)
    }

    #[test]
    fn it_goes_down_rosenbrocks_valley_to_its_end_and_never_up() {
        let begin = Vector2::new(-1.2, 1.0);
        let mut search = LevenbergMarquardt::new(begin, cost(&begin), 1e-2);
        let (mut fell, mut stayed) = (0, 0);
        for _ in 0..60 {
            let before = search;
            match step(&mut search) {
                Step::Fell(share) => {
                    fell += 1;
                    assert!((share - (1.0 - search.cost / before.cost)).abs() < 1e-12);
                }
                Step::Stayed => {
                    stayed += 1;
                    assert_eq!((search.at, search.cost), (before.at, before.cost));
                    assert!(search.lift > before.lift);
                }
                Step::Stuck => panic!("the slopes are independent everywhere"),
            }
            assert_eq!(search.cost, cost(&search.at));
        }
        assert!(fell > 5 && stayed > 0, "{fell} {stayed}");
        assert!(
            (search.at - Vector2::new(1.0, 1.0)).norm() < 1e-9,
            "{search:?}"
        );
    }

    #[test]
    fn what_has_no_slope_is_stuck_and_what_is_no_number_is_not_taken() {
        let begin = Vector2::new(2.0, 3.0);
        let mut search = LevenbergMarquardt::new(begin, 1.0, 1e-2);
        assert_eq!(search.step(&Matrix2::zeros(), &begin, |_| 0.0), Step::Stuck);
        assert!(Step::Stuck.is_last(0.0));
        let nothing = search.step(&Matrix2::identity(), &begin, |_| f64::NAN);
        assert_eq!(nothing, Step::Stayed);
        assert!(!nothing.is_last(1.0));
        assert!(Step::Fell(0.1).is_last(0.2) && !Step::Fell(0.2).is_last(0.1));
        assert_eq!((search.at, search.cost), (begin, 1.0));
    }
}
