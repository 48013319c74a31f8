//! A slave whose object is a plant of somebody else's.

use mmt_shared::time::Time;

use super::Slave;
use crate::plant::{LinkedPlant, PlantAnswer, PlantCommand};

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
