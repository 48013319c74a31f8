//! The slave's object as a plant of somebody else's.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::BoxFootprint;
use mmt_shared::time::Time;

use super::{Slave, SlaveConfig, SlaveError};
use crate::environment::Environment;
use crate::plant::{LinkedPlant, Plant, PlantAnswer, PlantCommand};
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
        let is_stiff = config.tool_compliance.is_some();
        let plant = LinkedPlant::new(config.plant, environment, coupling, limits, is_stiff);
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

impl Slave {
    /// Whether a plant of somebody else's is plugged in, of which no truth is known.
    #[must_use]
    pub fn is_linked(&self) -> bool {
        self.contact.plant().linked().is_some()
    }

    /// Takes in what the plant that is plugged in measured; it came at `now`. After a silence the tool is where it is, and
    /// stands there until the hand comes for it.
    pub fn handle_plant(&mut self, now: Time, answer: &PlantAnswer) {
        if let Some(plant) = self.contact.plant_mut().linked_mut() {
            plant.take(now, answer);
            if answer.anew {
                plant.place(answer.tool);
                self.playout.move_to(answer.tool);
            }
        }
    }

    /// Where the plant that is plugged in has to move the tool; none in the simulated world.
    #[must_use]
    pub fn plant_command(&self) -> Option<PlantCommand> {
        self.contact.plant().linked().and_then(LinkedPlant::command)
    }
}
