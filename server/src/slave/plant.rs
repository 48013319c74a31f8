//! What the tool of a configuration meets, and how it is seen before the session.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::BoxFootprint;

use super::{SlaveConfig, SlaveError};
use crate::environment::Environment;
use crate::plant::{LinkedPlant, Plant};
use crate::sensing::{self, Sensing};

/// What the tool of a configuration meets: `environment`, or a plant for which it stands.
pub(super) fn of_config(
    config: &SlaveConfig,
    environment: Environment,
    coupling: Coupling,
    speed_max_m_per_s: f64,
) -> Result<Plant, SlaveError> {
    if config.plant.link {
        let limits = (speed_max_m_per_s, config.tool_force_max_n);
        let gives = config.tool_gives();
        let plant = LinkedPlant::new(config.plant, environment, coupling, limits, gives);
        return Ok(Plant::Linked(Box::new(plant)));
    }
    Ok(Plant::World {
        environment: Box::new(environment),
        sensing: Box::new(Sensing::try_new(config.sensing, config.seed)?),
    })
}

/// Footprints of the bodies of a configuration as vision sees them before the session; none of a plant, and where it sees no size.
pub(super) fn sizes_seen(config: &SlaveConfig, environment: &Environment) -> Vec<BoxFootprint> {
    if config.plant.link {
        return Vec::new();
    }
    sensing::sizes_seen(
        &config.sensing.vision,
        config.seed,
        environment.footprints(),
    )
}
