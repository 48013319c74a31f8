//! How far a process that lives in time is followed through a silence.

/// The most steps that one packet makes a process in time take, about 20 ms of work. After a longer
/// silence the process begins anew, at a random point of its stationary distribution.
pub(super) const CATCH_UP_STEPS: u64 = 1 << 20;
