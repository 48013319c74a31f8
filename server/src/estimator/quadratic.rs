//! The three-parameter quadratic under bounds: the heart of (3) when m, b and c must be physical.
//!
//! Clamping one coordinate of the free minimum is not the minimum under that bound, because m, b and c
//! share the force among them: with b held at 0, m and c must be found anew. It must never return a
//! point outside the bounds.

use nalgebra::{Matrix3, Vector3};

/// The x ≥ `least` (each coordinate) where `xᵀ M x − 2 qᵀ x` is least; M symmetric, positive definite.
///
/// Exact: all eight sets of active bounds are tried. None if M is singular or a number is not finite.
#[must_use]
pub(super) fn minimum_above(
    matrix: &Matrix3<f64>,
    q: &Vector3<f64>,
    least: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for active in 0..8_u8 {
        let Some(x) = minimum_on(matrix, q, least, active) else {
            continue;
        };
        if !x.iter().zip(least.iter()).all(|(x, least)| x >= least) {
            continue;
        }
        if active == 0 {
            return Some(x);
        }
        let cost = x.dot(&(matrix * x)) - 2.0 * q.dot(&x);
        if cost.is_finite() && best.is_none_or(|(least_cost, _)| cost < least_cost) {
            best = Some((cost, x));
        }
    }
    best.map(|(_, x)| x)
}

/// The minimum with the coordinates of the bit set `active` held at their bounds.
fn minimum_on(
    matrix: &Matrix3<f64>,
    q: &Vector3<f64>,
    least: &Vector3<f64>,
    active: u8,
) -> Option<Vector3<f64>> {
    let (mut system, mut right) = (*matrix, *q);
    let rows = system.row_iter_mut().zip(right.iter_mut());
    for (i, ((mut row, right), least)) in rows.zip(least.iter()).enumerate() {
        if active >> i & 1 == 1 {
            row.fill(0.0);
            if let Some(diagonal) = row.get_mut(i) {
                *diagonal = 1.0;
            }
            *right = *least;
        }
    }
    let mut x = system.try_inverse()? * right;
    for (i, (x, least)) in x.iter_mut().zip(least.iter()).enumerate() {
        if active >> i & 1 == 1 {
            *x = *least;
        }
    }
    Some(x)
}

/// Below this determinant, with every column scaled to length 1, an inverse is rounding noise.
const DETERMINANT_MIN: f64 = 1e-13;

/// Inverse of a Gram matrix; none if it is singular to working precision, whatever the units.
#[must_use]
pub(super) fn inverse_of_gram(gram: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let lengths = gram.m11 * gram.m22 * gram.m33;
    // written so that NaN fails
    if gram.determinant() > DETERMINANT_MIN * lengths {
        gram.try_inverse()
    } else {
        None
    }
}

/// How far a Gram matrix is from singular, whatever the units of its coordinates.
///
/// The condition number of the least-squares problem (square root of the matrix's own, Frobenius norm)
/// after every column has been scaled to length 1; √3 is perfect, infinity is singular.
#[must_use]
pub(super) fn condition(gram: &Matrix3<f64>, inverse: Option<&Matrix3<f64>>) -> f64 {
    let Some(inverse) = inverse else {
        return f64::INFINITY;
    };
    let lengths = gram.diagonal();
    let scale = lengths * lengths.transpose();
    let squared = gram.component_mul(gram).component_div(&scale).sum()
        * inverse.component_mul(inverse).component_mul(&scale).sum();
    let condition = squared.sqrt().sqrt();
    if condition.is_finite() {
        condition
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cost(m: &Matrix3<f64>, q: &Vector3<f64>, x: &Vector3<f64>) -> f64 {
        x.dot(&(m * x)) - 2.0 * q.dot(x)
    }

    #[test]
    fn clamping_is_not_the_constrained_minimum() {
        let m = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.9, 0.0, 0.9, 1.0);
        let q = m * Vector3::new(1.0, -1.0, 2.0);
        let x = minimum_above(&m, &q, &Vector3::zeros()).unwrap();
        assert!((x - Vector3::new(1.0, 0.0, 1.1)).norm() < 1e-12, "{x}");
        let clamped = Vector3::new(1.0, 0.0, 2.0);
        assert!(cost(&m, &q, &x) < cost(&m, &q, &clamped) - 0.1);
    }

    proptest! {
        #[test]
        fn no_feasible_neighbour_is_better(
            root in prop::array::uniform9(-2.0..2.0_f64),
            free in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let root = Matrix3::from_row_slice(&root);
            let m = root.transpose() * root + Matrix3::identity() * 0.01;
            let q = m * Vector3::from(free);
            let least = Vector3::new(0.05, 0.0, 0.0);
            let x = minimum_above(&m, &q, &least).unwrap();
            prop_assert!((0..3).all(|i| x[i] >= least[i]));
            for step in 0..27 {
                let d = Vector3::new(
                    f64::from(step % 3 - 1), f64::from(step / 3 % 3 - 1), f64::from(step / 9 - 1),
                );
                let near = (x + d * 1e-3).sup(&least);
                prop_assert!(cost(&m, &q, &near) >= cost(&m, &q, &x) - 1e-9);
            }
        }
    }

    #[test]
    fn condition_does_not_depend_on_units_and_a_singular_gram_is_infinite() {
        let m = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0);
        let units = Matrix3::from_diagonal(&Vector3::new(1e3, 1e-3, 1.0));
        let scaled = units * m * units;
        let plain = condition(&m, inverse_of_gram(&m).as_ref());
        let other = condition(&scaled, inverse_of_gram(&scaled).as_ref());
        assert!((plain - other).abs() < 1e-9, "{plain} {other}");
        let orthogonal = Matrix3::identity();
        assert!((condition(&orthogonal, Some(&orthogonal)) - 3.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(condition(&Matrix3::zeros(), None), f64::INFINITY);
        let one_row = Vector3::new(0.1, 0.2, 0.3);
        assert!(inverse_of_gram(&(one_row * one_row.transpose())).is_none());
        assert!(inverse_of_gram(&Matrix3::repeat(f64::NAN)).is_none());
        assert_eq!(
            condition(&Matrix3::zeros(), Some(&orthogonal)),
            f64::INFINITY
        );
    }
}
