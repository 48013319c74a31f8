//! The quantile of the gamma distribution, from one uniform number.
//!
//! It must never draw by itself: how many numbers a rejection method takes depends on the shape, and then
//! two settings of one seed would no longer share a realisation.
//!
//! Sources: the incomplete gamma function by series and continued fraction, NIST Digital Library of
//! Mathematical Functions, equations 8.7.1 and 8.9.2 (the latter by Lentz's method); its inverse by
//! Halley's method from the start of E. B. Wilson and M. M. Hilferty, PNAS 17 (1931).

use crate::quantile::standard_normal;

/// Above this shape the start is the answer: it is off by less than 0.001 standard deviations there.
const SHAPE_MAX: f64 = 1000.0;
/// Terms of the series and of the fraction; shapes up to [`SHAPE_MAX`] take fewer.
const TERMS_MAX: u32 = 500;
/// Steps of Halley's method; three are usual.
const STEPS_MAX: u32 = 12;

/// The delay that a share `p` does not exceed, for a gamma distribution with this mean and standard
/// deviation (same unit). Zero if the mean is.
pub(crate) fn gamma(mean: f64, sd: f64, p: f64) -> f64 {
    if mean <= 0.0 || sd <= 0.0 {
        return mean.max(0.0);
    }
    let ratio = mean / sd;
    let shape = ratio * ratio;
    mean * (standard_gamma(shape, p) / shape)
}

/// The quantile for scale 1.
fn standard_gamma(shape: f64, p: f64) -> f64 {
    if p <= 0.0 {
        return 0.0;
    }
    // the end of the 53-bit grid of a draw
    let p = p.min(1.0 - f64::EPSILON / 2.0);
    let start = start(shape, p);
    if shape > SHAPE_MAX {
        start
    } else {
        improved(shape, p, start)
    }
}

fn start(shape: f64, p: f64) -> f64 {
    if shape > 1.0 {
        let ninth = 1.0 / (9.0 * shape);
        let root = 1.0 - ninth + standard_normal(p) * ninth.sqrt();
        return (shape * root * root * root).max(1e-3);
    }
    // a power of x near zero, an exponential beyond
    let split = 1.0 - shape * (0.253 + shape * 0.12);
    if p < split {
        libm::pow(p / split, 1.0 / shape)
    } else {
        1.0 - libm::log1p(-(p - split) / (1.0 - split))
    }
}

fn improved(shape: f64, p: f64, mut x: f64) -> f64 {
    let log_gamma = libm::lgamma(shape);
    for _ in 0..STEPS_MAX {
        if x <= 0.0 {
            return 0.0;
        }
        let density = libm::exp((shape - 1.0) * libm::log(x) - x - log_gamma);
        let newton = excess(shape, x, p, log_gamma) / density;
        if !newton.is_finite() {
            return x;
        }
        let bend = newton * ((shape - 1.0) / x - 1.0);
        let step = newton / (1.0 - 0.5 * bend.min(1.0));
        // never past zero
        x = if step < x { x - step } else { 0.5 * x };
        if step.abs() < 1e-8 * x {
            break;
        }
    }
    x
}

/// By how much the share below `x` exceeds `p`, from the smaller tail.
fn excess(shape: f64, x: f64, p: f64, log_gamma: f64) -> f64 {
    let front = libm::exp(shape * libm::log(x) - x - log_gamma);
    if x < shape + 1.0 {
        front * series(shape, x) - p
    } else {
        (1.0 - p) - front * fraction(shape, x)
    }
}

/// DLMF 8.7.1, without its front factor.
fn series(shape: f64, x: f64) -> f64 {
    let mut term = 1.0 / shape;
    let mut sum = term;
    for n in 1..TERMS_MAX {
        term *= x / (shape + f64::from(n));
        sum += term;
        if term < sum * f64::EPSILON {
            break;
        }
    }
    sum
}

/// DLMF 8.9.2, without its front factor.
fn fraction(shape: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let not_zero = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut b = x + 1.0 - shape;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / not_zero(b);
    let mut value = d;
    for n in 1..TERMS_MAX {
        let n = f64::from(n);
        let a = n * (shape - n);
        b += 2.0;
        d = 1.0 / not_zero(a * d + b);
        c = not_zero(b + a / c);
        value *= d * c;
        if (d * c - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole shapes have a closed form: 1 - exp(-x) sum x^k / k!.
    fn erlang(shape: u32, x: f64) -> f64 {
        let mut term = 1.0;
        let mut sum = 0.0;
        for k in 0..shape {
            sum += term;
            term *= x / f64::from(k + 1);
        }
        1.0 - libm::exp(-x) * sum
    }

    #[test]
    fn whole_shapes_are_met_to_nine_digits() {
        for shape in [1, 2, 4, 25, 100, 600] {
            for p in [0.001, 0.05, 0.3, 0.5, 0.8, 0.99, 0.9999] {
                let x = standard_gamma(f64::from(shape), p);
                assert!((erlang(shape, x) - p).abs() < 1e-9, "{shape} {p} {x}");
            }
        }
    }

    #[test]
    fn a_shape_of_one_half_is_a_squared_normal() {
        for p in [0.01, 0.2, 0.6, 0.9, 0.999] {
            let z = standard_normal(0.5 + 0.5 * p);
            let x = standard_gamma(0.5, p);
            assert!((x - 0.5 * z * z).abs() < 1e-8 * (1.0 + x), "{p} {x}");
        }
    }

    #[test]
    fn the_start_answers_where_the_shape_is_large() {
        let sd = SHAPE_MAX.sqrt();
        let off = |p: f64| (start(SHAPE_MAX, p) - improved(SHAPE_MAX, p, start(SHAPE_MAX, p))) / sd;
        let worst = [1e-6, 1e-3, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-6].map(|p| off(p).abs());
        assert!(worst.iter().all(|off| *off < 1e-3), "{worst:?}");
    }

    #[test]
    fn it_rises_with_p_and_never_breaks() {
        let grid = [0.0, 1e-300, 1e-16, 1e-9, 0.1, 0.5, 0.9, 1.0 - 1e-12, 1.0];
        for (mean, sd) in [(1.0, 1e-12), (1.0, 1e3), (3.6e12, 1.0), (1.0, 3.6e12)] {
            let values = grid.map(|p| gamma(mean, sd, p));
            assert!(
                values.iter().all(|x| x.is_finite() && *x >= 0.0),
                "{values:?}"
            );
            assert!(values.is_sorted(), "{mean} {sd} {values:?}");
        }
        assert_eq!([gamma(0.0, 5.0, 0.9), gamma(7.0, 0.0, 0.9)], [0.0, 7.0]);
    }
}
