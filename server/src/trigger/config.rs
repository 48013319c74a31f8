//! The trigger's settings, and what is accepted of them.

use std::time::Duration;

use mmt_shared::model::settings::Mode;
use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

use super::{ContactConfig, MismatchMetric, Scheme};

/// Accepted time that (12) is judged over, s; 0 is each sample by itself.
const JUDGED_S: (f64, f64) = (0.0, 10.0);
/// Accepted least force that (12) divides by, N.
const FORCE_FLOOR_N: (f64, f64) = (0.001, 10.0);
/// Accepted thresholds of contact, N.
const CONTACT_N: (f64, f64) = (0.001, 10.0);
/// Accepted error of the place in free space, m; 0 is off.
const FREE_SPACE_ERROR_M: (f64, f64) = (0.0, 1.0);
/// Accepted samples in a row of a contact that begins or ends.
const CONTACT_SAMPLES: (f64, f64) = (1.0, 1000.0);

/// The trigger's settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TriggerConfig {
    /// When updates are sent.
    pub scheme: Scheme,
    /// What Delta bounds.
    pub metric: MismatchMetric,
    /// Whether the timer of `hybrid` runs in free space as well; that of `useful` never does.
    pub timer_in_free_space: bool,
    /// Whether an update that only the timer asked for carries the object's pose, as every update of section IV-A does
    /// ("both geometry and impedance"). If not, it carries the pose and the velocity of the shadow, and renews the
    /// parameters alone.
    pub timer_carries_pose: bool,
    /// (12) compares the means of both forces over so long since the last update. Default 0: each sample by itself.
    #[serde(skip_serializing_if = "Duration::is_zero")]
    pub judged_over: Duration,
    /// Least force that (12) divides by, N.
    pub force_floor_n: f64,
    /// Whether a box that sticks can be mismatched: its force is whatever friction holds.
    pub judge_sticking: bool,
    /// An object that nobody touches and that is this much away from where the model has it is sent, m, if that is beyond the
    /// noise of the images; 0: only contact is sent, as in the paper.
    pub free_space_error_m: f64,
    /// Whether the end of a contact is sent by itself. Default off: section III-A does not name it, both sides see it, and
    /// where they differ that is a contact mismatch.
    pub contact_lost: bool,
    /// How long only one side must be in contact before it counts.
    pub mismatch_debounce: Duration,
    /// How often a contact mismatch that lasts is sent again, and an untouched object that is elsewhere.
    pub mismatch_repeat: Duration,
    /// Thresholds of contact.
    pub contact: ContactConfig,
}

impl TriggerConfig {
    /// The settings of a mode. Paper: hybrid at its best point (10 %, 150 ms), floor F_min = 0.04 N.
    /// Recommended: `useful` with the same numbers, floor 0.3 N, free space to 1 mm.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        let (delta, t_update) = (0.10, Duration::from_millis(150));
        let (scheme, force_floor_n, judge_sticking, free_space_error_m) = match mode {
            Mode::Paper => (Scheme::Hybrid { delta, t_update }, 0.04, true, 0.0),
            Mode::Recommended => (Scheme::Useful { delta, t_update }, 0.3, false, 1e-3),
        };
        Self {
            scheme,
            metric: MismatchMetric::Force,
            timer_in_free_space: true,
            timer_carries_pose: true,
            judged_over: Duration::ZERO,
            force_floor_n,
            judge_sticking,
            free_space_error_m,
            contact_lost: false,
            mismatch_debounce: Duration::from_millis(10),
            mismatch_repeat: Duration::from_millis(50),
            contact: ContactConfig::default(),
        }
    }

    /// Checks every number; the scheme's are checked where it is read.
    ///
    /// # Errors
    /// Names the first one that is out of range or not a number.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        let ContactConfig {
            on_n,
            off_n,
            samples,
        } = self.contact;
        all_in_range([
            (
                "trigger: judged_over",
                "s",
                self.judged_over.as_secs_f64(),
                JUDGED_S,
            ),
            (
                "trigger: force floor",
                "N",
                self.force_floor_n,
                FORCE_FLOOR_N,
            ),
            (
                "trigger: free space error",
                "m",
                self.free_space_error_m,
                FREE_SPACE_ERROR_M,
            ),
            ("trigger: contact.on_n", "N", on_n, CONTACT_N),
            // a contact that has begun does not end by the force that began it
            ("trigger: contact.off_n", "N", off_n, (CONTACT_N.0, on_n)),
            (
                "trigger: contact.samples",
                "",
                f64::from(samples),
                CONTACT_SAMPLES,
            ),
        ])
    }
}

impl Default for TriggerConfig {
    fn default() -> Self {
        Self::of_mode(Mode::Recommended)
    }
}
