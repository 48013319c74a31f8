//! A configuration with nothing left out, and the keys that it then has.

use mmt_client::device::DeviceProfile;
use mmt_server::estimator::EstimatorConfig;

use crate::world::WorldConfig;

/// The same run with the parts written out that are the mode's where they are left out.
pub(super) fn whole(config: &WorldConfig) -> WorldConfig {
    let device = DeviceProfile::default();
    let used = device.used_with(config.stiffness_n_per_m, None);
    let coupling = used.unwrap_or(device).coupling();
    let mut whole = config.clone();
    whole.stiffness_n_per_m = Some(coupling.stiffness_n_per_m);
    whole.settings = Some(config.model_settings(coupling));
    let estimator = EstimatorConfig::of_mode(config.slave.mode, coupling);
    whole.slave.estimator.get_or_insert(estimator);
    whole
}

/// Every key that the default has, written with dots.
pub(super) fn keys() -> Vec<String> {
    let mut keys = Vec::new();
    if let Ok(tree) = toml::Value::try_from(whole(&WorldConfig::default())) {
        leaves(&tree, "", &mut keys);
    }
    keys
}

fn leaves(tree: &toml::Value, path: &str, keys: &mut Vec<String>) {
    for (name, value) in tree.as_table().into_iter().flatten() {
        let key = format!("{path}{name}");
        if value.is_table() {
            leaves(value, &format!("{key}."), keys);
        } else {
            keys.push(key);
        }
    }
}
