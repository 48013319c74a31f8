//! Whether a claim holds here, from the interval of what it speaks of.

use std::fmt;

use crate::statistics::Interval;

/// Where a claim expects a quantity.
#[derive(Clone, Copy, Debug)]
pub(super) enum Bound {
    Above(f64),
    Below(f64),
    Within(f64, f64),
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
            Self::AtLeast(bound) => write!(f, ">= {bound:.1}"),
        }
    }
}

/// Whether a claim holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The whole 95 % interval agrees with the claim.
    Holds,
    /// The whole interval contradicts it.
    DoesNotHold,
    /// The interval leaves it open, or there is none.
    Tie,
}

impl Verdict {
    /// The words of files and tables.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::DoesNotHold => "does not hold",
            Self::Tie => "tie",
        }
    }
}

impl Bound {
    /// Of a claim whose quantity has this interval.
    pub(super) fn verdict(self, measured: Option<Interval>) -> Verdict {
        let Some(Interval { low, high, .. }) = measured else {
            return Verdict::Tie;
        };
        let (agrees, contradicts) = match self {
            Self::Above(bound) => (low > bound, high < bound),
            Self::AtLeast(bound) => (low > bound * 0.995, high < bound * 0.995),
            Self::Below(bound) => (high < bound, low > bound),
            Self::Within(least, most) => (low >= least && high <= most, low > most || high < least),
        };
        if agrees {
            Verdict::Holds
        } else if contradicts {
            Verdict::DoesNotHold
        } else {
            Verdict::Tie
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_needs_the_whole_interval() {
        let verdict = |bound: Bound, low, high| {
            bound.verdict(Some(Interval {
                n: 9,
                mean: f64::midpoint(low, high),
                low,
                high,
            }))
        };
        let (below, above, within) = (
            Bound::Below(1.0),
            Bound::Above(1.0),
            Bound::Within(1.0, 2.0),
        );
        assert_eq!(verdict(below, 0.8, 0.9), Verdict::Holds);
        assert_eq!(verdict(below, 0.8, 1.1), Verdict::Tie);
        assert_eq!(verdict(below, 1.01, 1.1), Verdict::DoesNotHold);
        assert_eq!(verdict(above, 1.01, 1.1), Verdict::Holds);
        assert_eq!(verdict(above, 0.9, 1.1), Verdict::Tie);
        assert_eq!(verdict(above, 0.8, 0.9), Verdict::DoesNotHold);
        assert_eq!(verdict(within, 1.1, 1.9), Verdict::Holds);
        assert_eq!(verdict(within, 0.9, 1.9), Verdict::Tie);
        assert_eq!(verdict(within, 2.1, 2.2), Verdict::DoesNotHold);
        assert_eq!(below.verdict(None), Verdict::Tie);
    }
}
