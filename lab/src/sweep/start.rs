//! What the keys of a plan are laid over: a start in the mode that the keys name.
//!
//! Of the keys it must know those alone that choose the parts which a start leaves to the mode.

use mmt_client::device::DeviceProfile;
use mmt_server::estimator::EstimatorConfig;
use mmt_server::slave::SlaveConfig;
use mmt_server::trigger::TriggerConfig;
use mmt_shared::model::settings::Mode;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, Deserializer};

use super::plan::Start;
use crate::setting::paper_world;
use crate::world::WorldConfig;

/// What must be known of the given keys to choose what they are laid over.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Hints {
    slave: SlaveHints,
    stiffness_n_per_m: Option<f64>,
    settings: Option<serde::de::IgnoredAny>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct SlaveHints {
    mode: Option<Mode>,
    estimator: Option<serde::de::IgnoredAny>,
}

/// The start in the mode that the keys name. The local model's settings and the estimator's are the mode's own
/// and absent, unless a key reaches into them.
pub(crate) fn beginning(start: Start, given: &Spanned<DeTable>) -> WorldConfig {
    // keys of a wrong type are reported when everything is read
    let hints = Hints::deserialize(Deserializer::from(given.clone())).unwrap_or_default();
    let mode = hints.slave.mode.unwrap_or(Mode::Recommended);
    let mut world = match start {
        Start::Live => WorldConfig {
            slave: SlaveConfig::of_mode(mode),
            ..WorldConfig::default()
        },
        Start::PaperExperiment => paper_world(mode, TriggerConfig::of_mode(mode).scheme),
    };
    let device = DeviceProfile::default();
    let device = device
        .used_with(hints.stiffness_n_per_m, None)
        .unwrap_or(device);
    let coupling = device.coupling();
    if let Some(settings) = &mut world.settings {
        settings.coupling = coupling;
    }
    if hints.settings.is_some() && world.settings.is_none() {
        world.settings = Some(mode.model_settings(coupling));
    }
    if hints.slave.estimator.is_some() {
        world.slave.estimator = Some(EstimatorConfig::of_mode(mode, coupling));
    }
    world
}
