//! The numbers of the bilateral architectures that may be tuned, one for each: `mmt reproduce tuned` chooses them.

use mmt_shared::passivity::REPAYMENT_NS_PER_M;

use super::deadband::DELTA;
use super::wave::WAVE_IMPEDANCE_NS_PER_M;

/// What an architecture is run with. Each uses its own number and no other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Position–force: displayed force over the received one.
    pub force_gain: f64,
    /// Damped position–force: damping of the hand's own motion, N s/m.
    pub injected_damping_ns_per_m: f64,
    /// Delta of the deadband on the force, as a share.
    pub delta: f64,
    /// TDPA: most damping by which the hand pays back a debt of energy, N s/m.
    pub repayment_ns_per_m: f64,
    /// Waves: the wave impedance b, N s/m.
    pub wave_impedance_ns_per_m: f64,
}

impl Default for Tuning {
    /// What each is run with where nobody tunes it.
    fn default() -> Self {
        Self {
            force_gain: 1.0,
            // less than half of the damping of a hand (25 N s/m)
            injected_damping_ns_per_m: 10.0,
            delta: DELTA,
            repayment_ns_per_m: REPAYMENT_NS_PER_M,
            wave_impedance_ns_per_m: WAVE_IMPEDANCE_NS_PER_M,
        }
    }
}
