//! How settings change as time goes by: the walk from one set to the next.

use std::time::Duration;

use super::delay::between;
use super::{Delay, LinkConfig, Loss, Probability, Profile, Service, Shape};

/// The equal parts in which a ramp is walked.
const RAMP_PARTS: u32 = 32;

impl Profile {
    /// Every stretch of constant settings with its beginning, from `base` at zero on.
    #[must_use]
    pub(crate) fn stretches(&self, base: &LinkConfig) -> Vec<(Duration, LinkConfig)> {
        let base = LinkConfig {
            profile: Self::default(),
            then: None,
            ..base.clone()
        };
        let mut stretches = vec![(Duration::ZERO, base.clone())];
        let mut from = base;
        for step in &self.steps {
            if !step.ramp.is_zero() {
                for part in 0..RAMP_PARTS {
                    // the middle of each part, so that the mean over the ramp is right
                    let share = (f64::from(part) + 0.5) / f64::from(RAMP_PARTS);
                    let begins = step.at.saturating_add(step.ramp * part / RAMP_PARTS);
                    stretches.push((begins, on_the_way(&from, &step.settings, share)));
                }
            }
            let arrived = step.at.saturating_add(step.ramp);
            stretches.push((arrived, step.settings.clone()));
            from = step.settings.clone();
        }
        stretches
    }
}

/// `share` of the way from one set of settings to another.
fn on_the_way(from: &LinkConfig, to: &LinkConfig, share: f64) -> LinkConfig {
    let mut now = from.clone();
    now.delay = delay_on_the_way(&from.delay, &to.delay, share);
    if let (Some(a), Some(b)) = (plain(&from.loss), plain(&to.loss)) {
        let percent = 100.0 * (a + (b - a) * share);
        let probability = Probability::from_percent(percent).unwrap_or_default();
        now.loss = Loss::Independent { probability };
    }
    let target = to.rate.as_ref().map(|rate| &rate.service);
    if let (Some(rate), Some(Service::Constant { bits_per_second: b })) = (&mut now.rate, target)
        && let Service::Constant { bits_per_second: a } = &mut rate.service
    {
        *a = (*a as f64 + (*b as f64 - *a as f64) * share) as u64;
    }
    now
}

/// The loss of a kind that can be walked evenly.
fn plain(loss: &Loss) -> Option<f64> {
    match loss {
        Loss::None => Some(0.0),
        Loss::Independent { probability } => Some(probability.get()),
        _ => None,
    }
}

fn delay_on_the_way(from: &Delay, to: &Delay, share: f64) -> Delay {
    // a constant delay is any distribution without jitter
    let shape = match (&from.shape, &to.shape) {
        (Shape::Empirical(_), _) | (_, Shape::Empirical(_)) => return from.clone(),
        (Shape::Constant, other) | (other, Shape::Constant) => other,
        (a, b) if std::mem::discriminant(a) == std::mem::discriminant(b) => a,
        _ => return from.clone(),
    };
    Delay {
        mean: between(from.mean, to.mean, share),
        jitter: between(from.jitter, to.jitter, share),
        shape: shape.clone(),
    }
}
