//! The reference motions: what the environment does in cases whose outcome is known.
//!
//! Ten rows for a square body of any accepted parameters: a push, a push at 45°, a stop, a spin-down, a
//! turning coast, an off-centre wrench, and two pushes that must not move it. The reference is a closed
//! form where there is one, else a much finer patch integrated by code of its own (`reference.rs`). It
//! must never take a number from the environment as a reference.
//!
//! The motions are the same for every body: a body whose friction holds a push or a wrench stays, and that is
//! its reference. Only where a body would become faster than the environment accepts is a push shorter.

mod body;
mod motion;
mod reference;

pub use body::{Body, PhysicsError};
use motion::{Kind, MeasuredMotion, ReferenceMotion};
pub use motion::{Source, TracePoint};

/// One row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsCase {
    /// Which motion, and of which quantity.
    pub case: &'static str,
    /// What is done to the body, in words and numbers.
    pub motion: String,
    /// Where the reference comes from.
    pub source: Source,
    /// Unit of reference and measured: `m`, `rad` or `s`.
    pub unit: &'static str,
    /// What should come out.
    pub reference: f64,
    /// What the environment did.
    pub measured: f64,
    /// |measured − reference| by max(|reference|, 1 mm, 1 mrad or 1 ms).
    pub relative_error: f64,
}

/// One quantity over the time of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsTrace {
    /// The case whose quantity it is.
    pub case: &'static str,
    /// Unit of the values: `m` or `rad`.
    pub unit: &'static str,
    /// From the start of the motion to its end in the environment.
    pub points: Vec<TracePoint>,
}

/// The rows of the table, in the order in which they are named above.
///
/// # Errors
/// When the environment does not accept the body, or it has no friction.
pub fn cases(body: &Body) -> Result<Vec<PhysicsCase>, PhysicsError> {
    let motions = ReferenceMotion::all(&body.checked()?);
    let mut cases = Vec::new();
    for motion in &motions {
        let run = MeasuredMotion::of(motion)?;
        for kind in motion.kinds() {
            cases.push(case(motion, &run, *kind));
        }
    }
    Ok(cases)
}

/// Every case of [`cases`] over the time that was measured, at most 401 points each. Spin-down shows the angle, whose end the
/// table gives as a time.
///
/// # Errors
/// As [`cases`].
pub fn traces(body: &Body) -> Result<Vec<PhysicsTrace>, PhysicsError> {
    let motions = ReferenceMotion::all(&body.checked()?);
    let mut traces = Vec::new();
    for motion in &motions {
        let run = MeasuredMotion::of(motion)?;
        for kind in motion.kinds() {
            traces.push(PhysicsTrace {
                case: kind.case,
                unit: if kind.turns { "rad" } else { "m" },
                points: run.trace(kind.turns),
            });
        }
    }
    Ok(traces)
}

fn case(motion: &ReferenceMotion, run: &MeasuredMotion, kind: Kind) -> PhysicsCase {
    let (unit, reference, measured) = if kind.timed {
        ("s", run.reference_seconds, run.measured_seconds)
    } else {
        let (reference, measured) = run.ends(kind.turns);
        (if kind.turns { "rad" } else { "m" }, reference, measured)
    };
    // 1 mm, 1 mrad or 1 ms
    let scale = reference.abs().max(1e-3);
    PhysicsCase {
        case: kind.case,
        motion: motion.words(),
        source: motion.source(),
        unit,
        reference,
        measured,
        relative_error: (measured - reference).abs() / scale,
    }
}

#[cfg(test)]
mod tests;
