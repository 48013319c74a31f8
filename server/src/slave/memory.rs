//! What outlives a session: where the bodies lie, what was found of them, and where the tool is.

use std::collections::BTreeMap;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::model::params::ModelState;
use serde::{Deserialize, Serialize};

use super::object::Found;
use super::{Slave, SlaveConfig, SlaveError};
use crate::shadow::Shadow;

/// What a slave leaves for the next session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Where the bodies lie, in the order of their numbers in the scene.
    pub(super) bodies: Vec<Pose>,
    /// Number of the body that was touched last.
    pub(super) touched: usize,
    /// What was found, by the bodies' numbers.
    pub(super) found: BTreeMap<usize, Found>,
    /// Where the tool is, m, world frame.
    pub(super) tool: Vec2,
}

impl Memory {
    /// Where the first body lies.
    #[must_use]
    pub fn object(&self) -> Option<Pose> {
        self.bodies.first().copied()
    }

    /// The beginning at a plant whose tool and object are there (m, world), with what an earlier session found.
    #[must_use]
    pub fn of_plant(tool: Vec2, object: Pose, earlier: Option<&Self>) -> Self {
        Self {
            bodies: vec![object],
            touched: 0,
            found: earlier
                .map(|memory| memory.found.clone())
                .unwrap_or_default(),
            tool,
        }
    }
}

impl Slave {
    /// A slave that goes on where an earlier session ended.
    ///
    /// # Errors
    /// As [`Slave::try_new`].
    pub fn remembering(
        config: &SlaveConfig,
        coupling: Coupling,
        memory: &Memory,
    ) -> Result<Self, SlaveError> {
        let mut slave = Self::try_new(config, coupling)?;
        let environment = slave.environment_mut();
        environment.place(&memory.bodies);
        environment.select(memory.touched);
        let pose = environment.pose();
        slave.object.remember(&memory.found, memory.touched, pose);
        slave.contact.begin_with(memory.touched);
        let params = slave.object.params;
        let footprint = slave.object.observer.footprint();
        slave.start = ModelState::nearest(params, footprint, pose, Twist::default(), &coupling)?;
        slave.shadow = Shadow::new(slave.settings, slave.start, slave.tool_force().max_n());
        slave.place_tool(memory.tool);
        // what a plant's tool touches the plant will report
        if slave.contact.plant_mut().linked_mut().is_none() {
            let force = slave.environment_mut().force_at(memory.tool);
            slave.tool.begin_at(memory.tool, force);
        }
        Ok(slave)
    }

    /// What the next session goes on with.
    #[must_use]
    pub fn memory(&self) -> Memory {
        Memory {
            bodies: self.environment().poses(),
            touched: self.object.body(),
            found: self.object.found(),
            tool: self.tool_at,
        }
    }

    /// Puts a simulated tool, which is nowhere yet, to `hip` (m), or as near as its reach allows; if that is inside of a
    /// body, in front of it.
    pub fn start_at(&mut self, hip: Vec2) {
        let hip = self.playout.within_reach(hip);
        let place = self.environment_mut().free_place(hip);
        self.place_tool(place);
    }

    /// Where the tool is, m, world frame.
    #[must_use]
    pub fn tool_at(&self) -> Vec2 {
        self.tool_at
    }

    fn place_tool(&mut self, place: Vec2) {
        self.tool_at = place;
        self.playout.start_at(place);
        if let Some(plant) = self.contact.plant_mut().linked_mut() {
            plant.place(place);
        }
    }
}
