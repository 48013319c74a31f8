//! Laws of outlines.

use super::*;
use mmt_shared::model::params::{friction_torque_of_square, inertia_of_square};

fn polygon(vertices: &[(f64, f64)]) -> Result<Outline, OutlineError> {
    let vertices: Vec<_> = vertices.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
    Outline::polygon(&Bounded::try_new(&vertices).unwrap(), convex)
}

fn corners(outline: &Outline) -> &[Vec2] {
    match outline {
        Outline::Corners(corners) => corners.as_slice(),
        Outline::Circle(_) => &[],
    }
}

/// Means of |r| and |r|² over an outline by the midpoint rule.
fn by_quadrature(outline: &Outline) -> (f64, f64) {
    let (n, mut sums) = (600, (0.0, 0.0, 0.0));
    for k in 0..n * n {
        let place = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
        let point = Vec2::new(place(k % n), place(k / n)) * 0.8;
        if outline.holds(point) {
            sums.0 += 1.0;
            sums.1 += point.norm();
            sums.2 += point.norm_squared();
        }
    }
    (sums.1 / sums.0, sums.2 / sums.0)
}

#[test]
fn arms_equal_their_integrals() {
    let square = Outline::rectangle(0.36, 0.36);
    assert!((square.mean_arm() / friction_torque_of_square(1.0, 0.36) - 1.0).abs() < 1e-14);
    assert!((square.mean_square_arm() / inertia_of_square(1.0, 0.36) - 1.0).abs() < 1e-14);
    for outline in [
        square,
        Outline::rectangle(0.6, 0.1),
        Outline::Circle(0.2),
        polygon(&[(0.0, 0.0), (0.5, 0.0), (0.1, 0.4)]).unwrap(),
        polygon(&[(0.0, 0.1), (0.3, 0.0), (0.4, 0.2), (0.3, 0.4), (0.1, 0.3)]).unwrap(),
    ] {
        let (arm, square) = by_quadrature(&outline);
        assert!((outline.mean_arm() / arm - 1.0).abs() < 3e-3, "{outline:?}");
        assert!((outline.mean_square_arm() / square - 1.0).abs() < 5e-3);
    }
}

#[test]
fn a_polygon_is_moved_to_its_centroid_and_turned_counter_clockwise() {
    let one = polygon(&[(1.0, 1.0), (1.3, 1.0), (1.0, 1.3)]).unwrap();
    let other = polygon(&[(1.0, 1.3), (1.3, 1.0), (1.0, 1.0)]).unwrap();
    assert_eq!(one, other);
    assert!(centroid(corners(&one)).norm() < 1e-14 && doubled_area(corners(&one)) > 0.0);
    let bounds = one.bounding_box();
    assert!((bounds.west - 0.1).abs() < 1e-12 && (bounds.east - 0.2).abs() < 1e-12);
}

#[test]
fn what_is_no_convex_outline_is_named() {
    use OutlineError::{NotConvex, NotFinite, Reach, ShortEdge, TooFew};
    assert_eq!(polygon(&[(0.0, 0.0), (1.0, 0.0)]), Err(TooFew(2)));
    for bad in [f64::NAN, f64::INFINITY, 1e9] {
        let vertices = [(0.0, 0.0), (0.3, bad), (0.0, 0.3)];
        assert_eq!(polygon(&vertices), Err(NotFinite(1)));
    }
    let dent = [(0.0, 0.0), (0.4, 0.0), (0.1, 0.1), (0.0, 0.4)];
    assert_eq!(polygon(&dent), Err(NotConvex(2)));
    let straight = [(0.0, 0.0), (0.2, 0.0), (0.4, 0.0), (0.0, 0.4)];
    assert_eq!(polygon(&straight), Err(NotConvex(1)));
    let star: Vec<_> = (0..5)
        .map(|k| libm::sincos(f64::from(k) * std::f64::consts::TAU * 0.4))
        .map(|(y, x)| (0.3 * x, 0.3 * y))
        .collect();
    assert_eq!(polygon(&star), Err(NotConvex(0)));
    let flat = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.001), (0.0, 0.4)];
    assert!(matches!(polygon(&flat), Err(ShortEdge { index: 1, .. })));
    let wide = [(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)];
    assert!(matches!(polygon(&wide), Err(Reach { .. })));
    let too_many = vec![Vec2::zeros(); 17];
    let error = Bounded::<Vec2, VERTICES_MAX>::try_new(&too_many);
    assert_eq!(
        error.unwrap_err().to_string(),
        "a list of 17 is longer than the accepted 16"
    );
}
