//! Whether a claim holds here, from the interval of what it speaks of.
//!
//! A claim is tested against the bound that it expects, two-sided, with Holm's correction over all claims: of many tests
//! at 5 % one finds what is not there. A ratio whose test finds nothing may still be shown to be one within 5 %.

use std::fmt;

use crate::statistics::{Interval, holm};

/// Where a claim expects a quantity.
#[derive(Clone, Copy, Debug)]
pub(super) enum Bound {
    Above(f64),
    Below(f64),
    Within(f64, f64),
    /// A ratio above one.
    MoreThanEqual,
    /// A ratio below one.
    LessThanEqual,
    /// A rate of whole periods: a run of some of them and a rest has one packet less than its length over the period,
    /// which half of a per cent allows for.
    AtLeast(f64),
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(bound) => write!(f, "> {bound}"),
            Self::Below(bound) => write!(f, "< {bound}"),
            Self::Within(least, most) => write!(f, "{least} to {most}"),
            Self::MoreThanEqual => f.write_str("> 1"),
            Self::LessThanEqual => f.write_str("< 1"),
            Self::AtLeast(bound) => write!(f, ">= {bound:.1}"),
        }
    }
}

/// The greatest p at which a claim is taken to hold or to fail.
const SIGNIFICANT: f64 = 0.05;
/// Ratios between this and its inverse are as good as one.
const EQUAL: f64 = 0.95;

/// Whether a claim holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::experiments) enum Verdict {
    /// What was measured lies where the claim expects it, and that is no chance.
    Holds,
    /// It is a ratio, and one to within 5 % (two one-sided tests).
    Tie,
    /// The runs leave it open.
    Undecided,
    /// It lies elsewhere, and that is no chance.
    Fails,
}

impl Verdict {
    /// Every verdict.
    pub(in crate::experiments) const ALL: [Self; 4] =
        [Self::Holds, Self::Tie, Self::Undecided, Self::Fails];

    /// The word of files and tables.
    pub(in crate::experiments) fn word(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Tie => "tie",
            Self::Undecided => "undecided",
            Self::Fails => "fails",
        }
    }
}

impl Bound {
    /// Whether a mean lies where the bound expects it.
    fn agrees(self, mean: f64) -> bool {
        match self {
            Self::Above(bound) => mean > bound,
            // a run of whole periods and a rest has one packet less than its length over the period
            Self::AtLeast(bound) => mean > bound * 0.995,
            Self::Below(bound) => mean < bound,
            Self::Within(least, most) => (least..=most).contains(&mean),
            Self::MoreThanEqual => mean > 1.0,
            Self::LessThanEqual => mean < 1.0,
        }
    }

    /// How probable it is to measure this if the truth stood at the bound; none of a single run.
    fn p_value(self, measured: &Interval) -> Option<f64> {
        let p = |bound| measured.p_against(bound);
        match self {
            Self::Above(bound) | Self::AtLeast(bound) | Self::Below(bound) => p(bound),
            // inside, both ends must be away; outside, the nearer one
            Self::Within(least, most) => Some(p(least)?.max(p(most)?)),
            Self::MoreThanEqual | Self::LessThanEqual => measured.logarithms().p_against(0.0),
        }
    }

    /// Whether it is a ratio that is shown to be one.
    fn is_equal(self, measured: &Interval) -> bool {
        let is_ratio = matches!(self, Self::MoreThanEqual | Self::LessThanEqual);
        let logarithms = measured.logarithms();
        let limit = -libm::log(EQUAL);
        // a one-sided test at 5 % is a two-sided one at 10 %
        let beyond = |end: f64| {
            logarithms
                .p_against(end)
                .is_some_and(|p| p < 2.0 * SIGNIFICANT)
        };
        is_ratio && logarithms.mean.abs() < limit && beyond(limit) && beyond(-limit)
    }

    /// Whether a quantity that every run keeps is kept: no test, because it cannot fail by chance.
    pub(super) fn is_kept(self, measured: Option<Interval>) -> bool {
        measured.is_some_and(|measured| self.agrees(measured.mean))
    }
}

/// The p-value after Holm's correction, and the verdict, of each claim.
pub(super) fn judge(claims: &[(Bound, Option<Interval>)]) -> Vec<(Option<f64>, Verdict)> {
    let p_values = claims
        .iter()
        .map(|(bound, measured)| bound.p_value(measured.as_ref()?));
    let p_values: Vec<Option<f64>> = p_values.collect();
    let tested: Vec<f64> = p_values.iter().flatten().copied().collect();
    let mut corrected = holm(&tested).into_iter();
    let judged = claims.iter().zip(p_values).map(|((bound, measured), p)| {
        let p = p.and_then(|_| corrected.next());
        let verdict = match measured {
            Some(measured) if p.is_some_and(|p| p < SIGNIFICANT) => {
                if bound.agrees(measured.mean) {
                    Verdict::Holds
                } else {
                    Verdict::Fails
                }
            }
            Some(measured) if bound.is_equal(measured) => Verdict::Tie,
            _ => Verdict::Undecided,
        };
        (p, verdict)
    });
    judged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten values about a mean.
    fn about(mean: f64, spread: f64) -> Option<Interval> {
        Interval::of((0..10).map(|k| mean + spread * (f64::from(k) - 4.5)))
    }

    fn verdict(bound: Bound, measured: Option<Interval>) -> Verdict {
        judge(&[(bound, measured)])[0].1
    }

    #[test]
    fn a_verdict_needs_more_than_chance() {
        let within = Bound::Within(1.0, 2.0);
        for (bound, mean, spread, expected) in [
            (Bound::Below(1.0), 0.8, 0.01, Verdict::Holds),
            (Bound::Below(1.0), 0.98, 0.1, Verdict::Undecided),
            (Bound::Below(1.0), 1.2, 0.01, Verdict::Fails),
            (Bound::Above(1.0), 1.2, 0.01, Verdict::Holds),
            (Bound::Above(1.0), 0.8, 0.01, Verdict::Fails),
            (within, 1.5, 0.01, Verdict::Holds),
            (within, 1.05, 0.1, Verdict::Undecided),
            (within, 2.3, 0.01, Verdict::Fails),
        ] {
            let found = verdict(bound, about(mean, spread));
            assert_eq!(found, expected, "{bound} {mean} {spread}");
        }
        assert_eq!(verdict(within, None), Verdict::Undecided);
        assert_eq!(verdict(within, Interval::of([1.5])), Verdict::Undecided);
    }

    #[test]
    fn a_ratio_may_be_shown_to_be_one() {
        let ratio =
            |spread| Interval::of_ratios((0..10).map(|k| libm::exp(spread * (f64::from(k) - 4.5))));
        assert_eq!(verdict(Bound::LessThanEqual, ratio(0.01)), Verdict::Tie);
        assert_eq!(
            verdict(Bound::LessThanEqual, ratio(0.1)),
            Verdict::Undecided
        );
        // what is no ratio is never a tie
        assert_eq!(verdict(Bound::Below(1.0), ratio(0.01)), Verdict::Undecided);
    }

    /// What holds by itself need not hold among twenty.
    #[test]
    fn many_claims_make_each_harder() {
        // p is 0.02 to 0.05
        let one = (Bound::Above(0.0), about(0.1, 0.04));
        let others = vec![(Bound::Above(0.0), about(0.0, 0.04)); 19];
        assert_eq!(judge(&[one])[0].1, Verdict::Holds);
        assert_eq!(
            judge(&[vec![one], others].concat())[0].1,
            Verdict::Undecided
        );
    }

    #[test]
    fn a_bound_that_each_run_keeps_is_kept_or_not() {
        let bound = Bound::AtLeast(20.0);
        assert!(bound.is_kept(Interval::of([19.95])) && !bound.is_kept(Interval::of([19.0])));
        assert!(!bound.is_kept(None));
    }
}
