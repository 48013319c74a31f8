//! The emergency stop of one side, as its keys, buttons and signals set it and its loop reads it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The emergency stop of one side. Clones are the same one. Once set it stays set until it is cleared here.
#[derive(Clone, Debug, Default)]
pub struct EmergencyStop(Arc<AtomicBool>);

impl EmergencyStop {
    /// Sets or clears it.
    pub fn set(&self, stopped: bool) {
        if self.0.swap(stopped, Ordering::AcqRel) != stopped {
            let now = if stopped { "set" } else { "cleared" };
            tracing::warn!("the emergency stop of this side is {now}");
        }
    }

    /// Whether it is set.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}
