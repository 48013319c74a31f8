//! The quantile of the standard normal distribution: from one uniform draw to one normal draw.
//!
//! Every delay is the quantile of one uniform number, so that a packet takes one draw whatever the
//! distribution, and two distributions under one seed see the same realisation.
//!
//! Source: M. J. Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988); relative accuracy
//! about 1e-16.

/// x with P(Z <= x) = p for a standard normal Z. Finite for every p: outside of (0, 1) the ends of the
/// 53-bit grid answer.
pub(crate) fn standard_normal(p: f64) -> f64 {
    let p = p.clamp(LOWEST, 1.0 - f64::EPSILON / 2.0);
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * polynomial(&CENTRE.0, r) / polynomial(&CENTRE.1, r);
    }
    let r = (-libm::log(p.min(1.0 - p))).sqrt();
    let (fraction, r) = if r <= 5.0 {
        (&SHOULDER, r - 1.6)
    } else {
        (&TAIL, r - 5.0)
    };
    let x = polynomial(&fraction.0, r) / polynomial(&fraction.1, r);
    if q < 0.0 { -x } else { x }
}

/// Half a step of the 53-bit grid of a uniform draw.
const LOWEST: f64 = f64::EPSILON / 4.0;

/// Coefficients of numerator and denominator, constant first.
type Fraction = ([f64; 8], [f64; 8]);

fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// |p - 0.5| <= 0.425.
const CENTRE: Fraction = (
    [
        3.387_132_872_796_366_5,
        1.331_416_678_917_843_8e2,
        1.971_590_950_306_551_3e3,
        1.373_169_376_550_946e4,
        4.592_195_393_154_987e4,
        6.726_577_092_700_87e4,
        3.343_057_558_358_813e4,
        2.509_080_928_730_122_7e3,
    ],
    [
        1.0,
        4.231_333_070_160_091e1,
        6.871_870_074_920_579e2,
        5.394_196_021_424_751e3,
        2.121_379_430_158_659_7e4,
        3.930_789_580_009_271e4,
        2.872_908_573_572_194_3e4,
        5.226_495_278_852_854e3,
    ],
);

/// sqrt(-ln min(p, 1 - p)) <= 5.
const SHOULDER: Fraction = (
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        2.417_807_251_774_506e-1,
        2.272_384_498_926_918_4e-2,
        7.745_450_142_783_414e-4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        6.897_673_349_851e-1,
        1.481_039_764_274_800_8e-1,
        1.519_866_656_361_645_7e-2,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
);

/// Beyond.
const TAIL: Fraction = (
    [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        2.965_605_718_285_048_7e-1,
        2.653_218_952_657_612_4e-2,
        1.242_660_947_388_078_4e-3,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ],
    [
        1.0,
        5.998_322_065_558_88e-1,
        1.369_298_809_227_358e-1,
        1.487_536_129_085_061_5e-2,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_8e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_939_8e-15,
    ],
);

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution(x: f64) -> f64 {
        0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
    }

    #[test]
    fn the_quantile_inverts_the_distribution() {
        for power in 0..300 {
            let p = 0.5 * libm::exp(-0.1 * f64::from(power));
            let back = distribution(standard_normal(p));
            assert!((back / p - 1.0).abs() < 1e-12, "p {p} came back as {back}");
        }
    }

    #[test]
    fn the_quantile_is_odd_about_a_half_and_finite_everywhere() {
        for p in [0.01, 0.05, 0.0751, 0.2, 0.4, 0.5] {
            assert!((standard_normal(p) + standard_normal(1.0 - p)).abs() < 1e-12);
        }
        for p in [0.0, 1.0, -3.0, 7.0, f64::INFINITY, f64::MIN_POSITIVE] {
            assert!(standard_normal(p).abs() < 9.0);
        }
    }
}
