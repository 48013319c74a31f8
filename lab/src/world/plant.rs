//! A plant of somebody else's in virtual time: whoever steps the world exchanges command and answer in between.

use mmt_server::plant::{PlantAnswer, PlantCommand};

use super::World;

impl World {
    /// Where the plant that is plugged in has to move the tool now; none in the simulated world.
    #[must_use]
    pub fn plant_command(&self) -> Option<PlantCommand> {
        self.slave.plant_command()
    }

    /// What that plant measured, for the next tick of the slave.
    pub fn answer_of_plant(&mut self, answer: PlantAnswer) {
        self.answer = Some(answer);
    }
}
