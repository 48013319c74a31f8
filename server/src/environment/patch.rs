//! The patch: 64 places where the ground touches the footprint, each with its share of the friction.
//!
//! Points are in the body frame about the centre of mass. A patch on plain ground under a square, a brick
//! or a disc has equal weights, and pure spin about its centre feels the footprint's e exactly. It must
//! never weigh a point below zero.

use mmt_shared::model::geometry::Vec2;
use nalgebra::{Matrix3, SVector, Vector3};

use super::outline::{centroid, doubled_area, edges};

/// Patch points along one side.
const POINTS_PER_SIDE: usize = 8;
/// Patch points in all.
pub(super) const POINTS: usize = POINTS_PER_SIDE * POINTS_PER_SIDE;
/// Patch points that are summed side by side, so that the machine may use its vector registers.
const LANES: usize = 4;
/// Terms summed over the points: potential, gradient, upper half of the curvature.
const TERMS: usize = 10;
/// One number of each of [`LANES`] points.
type Lanes = SVector<f64, LANES>;
/// The ellipse `(|F|/c)² + (M/e)² ≤ HELD²` lies inside the set of wrenches that the patch under a square
/// or a disc can hold. A test scans their support functions; the least ratio to the ellipsoid's is just
/// above this.
pub(super) const HELD: f64 = 0.93;

/// The patch of one footprint.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// x and y of the points, m, in rows of [`LANES`].
    points: [Row; POINTS / LANES],
    /// What each point weighs by its part of the area; the mean is 1.
    areas: [Lanes; POINTS / LANES],
    /// What each point weighs in all.
    weights: [Lanes; POINTS / LANES],
    /// Whether all points weigh 1.
    pub(super) even: bool,
    /// Whether the quick stick test may use the ellipse.
    pub(super) round: bool,
    /// Distance of the farthest point, m: turns a turning rate into its speed.
    pub(super) reach: f64,
    /// Sums over the weights.
    pub(super) hold: Hold,
}

/// What the weights sum up to: how the patch answers a pure push and a pure turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// Mean weight: the force of a pure push per c.
    pub(super) force: f64,
    /// Where a pure push acts, m: the centre of friction.
    pub(super) centre: Vec2,
    /// Moment of a pure turn about that centre per c, m.
    pub(super) arm: f64,
    /// Force that a pure turn about that centre leaves, per c; zero under symmetric footprints.
    pub(super) drift: Vec2,
}

/// Some patch points side by side.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    x: Lanes,
    y: Lanes,
    /// x² + y², m².
    arm_squared: Lanes,
}

/// Means over the patch at one velocity, each point with its weight.
pub(super) struct Sums {
    /// Mean of `q_i` = sqrt(|`s_i`|² + eps²).
    pub(super) potential: f64,
    /// Its gradient in u: mean friction direction and its moment.
    pub(super) gradient: Vector3<f64>,
    /// Its second derivative in u.
    pub(super) curvature: Matrix3<f64>,
}

/// One point before it is put into its row: place about the centroid and weight.
type Point = (Vec2, f64);

impl Patch {
    /// The patch under a rectangle of these extents along x and y (m) whose mean |r| is `arm` (m), about
    /// a centre of mass.
    ///
    /// The midpoints of an 8×8 grid make (9) 0.6 % too small; they are spread by as much, so that pure
    /// spin feels exactly (9).
    pub(super) fn rectangle(length: f64, width: f64, arm: f64, centre_of_mass: Vec2) -> Self {
        let pitch = (
            length / POINTS_PER_SIDE as f64,
            width / POINTS_PER_SIDE as f64,
        );
        let place = |k: usize, pitch: f64, side: f64| (k as f64 + 0.5) * pitch - side / 2.0;
        let grid = (0..POINTS).map(|k| {
            let x = place(k % POINTS_PER_SIDE, pitch.0, length);
            Vec2::new(x, place(k / POINTS_PER_SIDE, pitch.1, width))
        });
        let mut patch = Self::spread(grid, arm, centre_of_mass);
        patch.round = length.to_bits() == width.to_bits();
        patch
    }

    /// The patch under a disc (radius in m) about a centre of mass: four rings of 4, 12, 20 and 28 points,
    /// which are the 64 equal parts of its area.
    pub(super) fn disc(radius: f64, arm: f64, centre_of_mass: Vec2) -> Self {
        let rings = POINTS_PER_SIDE / 2;
        let width = radius / rings as f64;
        let ring = |k: usize| {
            let (inner, outer) = (k as f64, (k + 1) as f64);
            // mean radius of the ring's area
            let mean = 2.0 / 3.0 * (outer * outer * outer - inner * inner * inner)
                / (outer * outer - inner * inner);
            let count = 4 * (2 * k + 1);
            (0..count).map(move |j| {
                let angle = std::f64::consts::TAU * (j as f64 + 0.5) / count as f64;
                let (sin, cos) = libm::sincos(angle);
                Vec2::new(cos, sin) * (mean * width)
            })
        };
        let mut patch = Self::spread((0..rings).flat_map(ring), arm, centre_of_mass);
        patch.round = true;
        patch
    }

    /// The patch under a convex polygon with these corners (m, counter-clockwise, about their centroid)
    /// and mean |r|, about a centre of mass: the cells of an 8×8 grid over its bounding box, each cut to
    /// the polygon, at its centroid and with its area.
    pub(super) fn polygon(corners: &[Vec2], arm: f64, centre_of_mass: Vec2) -> Self {
        let least = corners.iter().fold(Vec2::repeat(f64::MAX), |a, b| a.inf(b));
        let most = corners.iter().fold(Vec2::repeat(f64::MIN), |a, b| a.sup(b));
        let cell = (most - least) / POINTS_PER_SIDE as f64;
        let area = doubled_area(corners) / POINTS as f64;
        let cut = |k: usize| {
            let corner = Vec2::new((k % POINTS_PER_SIDE) as f64, (k / POINTS_PER_SIDE) as f64);
            let from = least + cell.component_mul(&corner);
            let part = clipped(corners, from, from + cell);
            let weight = doubled_area(&part) / area;
            // a sliver's centroid is lost in rounding, and weighs nothing
            if weight > 1e-6 {
                (centroid(&part), weight)
            } else {
                (Vec2::zeros(), 0.0)
            }
        };
        let cells: Vec<Point> = (0..POINTS).map(cut).collect();
        let weigh = |(place, weight): &Point| place.norm() * weight;
        let mean_arm = cells.iter().map(weigh).sum::<f64>() / POINTS as f64;
        let spread = arm / mean_arm;
        let reach = |(place, weight): &Point| if *weight > 0.0 { place.norm() } else { 0.0 };
        let reach = cells.iter().map(reach).fold(0.0, f64::max) * spread;
        let points = cells
            .iter()
            .map(|(place, weight)| (place * spread, *weight));
        let mut patch = Self::of(points, arm, reach, centre_of_mass);
        patch.even = false;
        patch.sum_up();
        patch
    }

    /// Points of equal weight, spread so that their mean |r| becomes `arm`.
    fn spread(grid: impl Iterator<Item = Vec2> + Clone, arm: f64, centre_of_mass: Vec2) -> Self {
        let length = |place: Vec2| (place.x * place.x + place.y * place.y).sqrt();
        let mean_arm = grid.clone().map(length).sum::<f64>() / POINTS as f64;
        let spread = arm / mean_arm;
        let reach = grid.clone().map(length).fold(0.0, f64::max) * spread;
        let points = grid.map(|place| (place * spread, 1.0));
        Self::of(points, arm, reach, centre_of_mass)
    }

    fn of(places: impl Iterator<Item = Point>, arm: f64, reach: f64, centre_of_mass: Vec2) -> Self {
        let mut points = [Row::default(); POINTS / LANES];
        let mut areas = [Lanes::zeros(); POINTS / LANES];
        let slots = points.iter_mut().zip(&mut areas).flat_map(|(row, areas)| {
            let places = row.x.iter_mut().zip(row.y.iter_mut());
            places.zip(row.arm_squared.iter_mut()).zip(areas.iter_mut())
        });
        for ((((x, y), arm_squared), area), (place, weight)) in slots.zip(places) {
            (*x, *y) = (place.x - centre_of_mass.x, place.y - centre_of_mass.y);
            *arm_squared = *x * *x + *y * *y;
            *area = weight;
        }
        Self {
            points,
            areas,
            weights: areas,
            even: true,
            round: false,
            reach: reach + centre_of_mass.norm(),
            hold: Hold {
                force: 1.0,
                centre: -centre_of_mass,
                arm,
                drift: Vec2::zeros(),
            },
        }
    }

    /// Weighs each point by its area and by the `weight` of its place in the body frame.
    pub(super) fn weigh(&mut self, weight: impl Fn(Vec2) -> f64) {
        for ((row, areas), weights) in self.points.iter().zip(&self.areas).zip(&mut self.weights) {
            let places = row.x.iter().zip(row.y.iter());
            for ((slot, area), (x, y)) in weights.iter_mut().zip(areas.iter()).zip(places) {
                *slot = area * weight(Vec2::new(*x, *y));
            }
        }
        self.even = false;
        self.sum_up();
    }

    fn sum_up(&mut self) {
        let count = POINTS as f64;
        let force = self.weighed().map(|(_, weight)| weight).sum::<f64>() / count;
        if force <= 0.0 {
            self.hold = Hold {
                force: 0.0,
                centre: Vec2::zeros(),
                arm: 0.0,
                drift: Vec2::zeros(),
            };
            return;
        }
        let pull = |sum: Vec2, (place, weight): Point| sum + place * weight;
        let centre = self.weighed().fold(Vec2::zeros(), pull) / (force * count);
        let turn = |(arm, drift): (f64, Vec2), (place, weight): Point| {
            let lever = place - centre;
            let length = lever.norm();
            let across = if length > 0.0 {
                Vec2::new(-lever.y, lever.x) / length
            } else {
                Vec2::zeros()
            };
            (arm + weight * length, drift + across * weight)
        };
        let (arm, drift) = self.weighed().fold((0.0, Vec2::zeros()), turn);
        self.hold = Hold {
            force,
            centre,
            arm: arm / count,
            drift: drift / count,
        };
    }

    /// The points with their weights.
    pub(super) fn weighed(&self) -> impl Iterator<Item = Point> + '_ {
        self.points
            .iter()
            .zip(&self.weights)
            .flat_map(|(row, weights)| {
                let places = row.x.iter().zip(row.y.iter());
                places
                    .zip(weights.iter())
                    .map(|((x, y), weight)| (Vec2::new(*x, *y), *weight))
            })
    }

    /// The sums at u = (v, omega), smoothed by eps (m/s).
    pub(super) fn sums(&self, u: &Vector3<f64>, eps: f64) -> Sums {
        if self.even {
            self.sums_of::<false>(u, eps)
        } else {
            self.sums_of::<true>(u, eps)
        }
    }

    fn sums_of<const WEIGHED: bool>(&self, u: &Vector3<f64>, eps: f64) -> Sums {
        let eps_squared = eps * eps;
        let mut sums = [Lanes::zeros(); TERMS];
        for (row, weights) in self.points.iter().zip(&self.weights) {
            for (sum, term) in sums.iter_mut().zip(row.terms(u, eps_squared)) {
                *sum += if WEIGHED {
                    term.component_mul(weights)
                } else {
                    term
                };
            }
        }
        let [q, gx, gy, gz, hxx, hxy, hyy, hxz, hyz, hzz] =
            sums.map(|lanes| lanes.sum() / POINTS as f64);
        Sums {
            potential: q,
            gradient: Vector3::new(gx, gy, gz),
            curvature: Matrix3::new(hxx, hxy, hxz, hxy, hyy, hyz, hxz, hyz, hzz),
        }
    }
}

impl Row {
    /// Each point's potential, its gradient in u and the upper half of its second derivative.
    #[inline]
    fn terms(&self, u: &Vector3<f64>, eps_squared: f64) -> [Lanes; TERMS] {
        let (x, y) = (&self.x, &self.y);
        // s = v + omega × r
        let sx = (y * -u.z).add_scalar(u.x);
        let sy = (x * u.z).add_scalar(u.y);
        let squared = sx.component_mul(&sx) + sy.component_mul(&sy);
        let q = squared.add_scalar(eps_squared).map(f64::sqrt);
        let a = q.map(|q| 1.0 / q);
        // d = s/q, seen from u by the columns (1, 0), (0, 1), (−y, x)
        let (dx, dy) = (sx.component_mul(&a), sy.component_mul(&a));
        let dz = x.component_mul(&dy) - y.component_mul(&dx);
        // (1 − d dᵀ)/q, seen likewise
        let (ax, ay) = (a.component_mul(&dx), a.component_mul(&dy));
        let az = a.component_mul(&dz);
        [
            q,
            dx,
            dy,
            dz,
            a - ax.component_mul(&dx),
            -ax.component_mul(&dy),
            a - ay.component_mul(&dy),
            -a.component_mul(y) - ax.component_mul(&dz),
            a.component_mul(x) - ay.component_mul(&dz),
            a.component_mul(&self.arm_squared) - az.component_mul(&dz),
        ]
    }
}

/// The part of a convex outline inside a rectangle: Sutherland and Hodgman, one side after the other.
fn clipped(corners: &[Vec2], from: Vec2, to: Vec2) -> Vec<Vec2> {
    let sides = [
        (Vec2::x(), from.x),
        (-Vec2::x(), -to.x),
        (Vec2::y(), from.y),
        (-Vec2::y(), -to.y),
    ];
    sides
        .iter()
        .fold(corners.to_vec(), |corners, (inward, at)| {
            let mut kept = Vec::new();
            for (p, q) in edges(&corners) {
                let (before, after) = (inward.dot(&p) - at, inward.dot(&q) - at);
                if before >= 0.0 {
                    kept.push(p);
                }
                if (before >= 0.0) != (after >= 0.0) {
                    kept.push(p + (q - p) * (before / (before - after)));
                }
            }
            kept
        })
}
