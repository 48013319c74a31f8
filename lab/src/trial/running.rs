//! A trial that is stepped from outside, millisecond by millisecond, and may be given what its world would do by itself.

use mmt_client::operator::trace::Trace;

use super::{Change, Counters, Measured, Trial, TrialError, Watch};
use crate::world::{Given, World, WorldPackets, WorldTick};

impl Trial {
    /// Runs it.
    ///
    /// # Errors
    /// When a number of the configuration or of the change is not accepted.
    pub fn run(&self) -> Result<Measured, TrialError> {
        self.run_in(World::try_new(&self.config)?)
    }

    /// Runs it with a hand that goes this way, whatever it feels.
    ///
    /// # Errors
    /// As [`Trial::run`].
    pub fn run_along(&self, hand: &Trace) -> Result<Measured, TrialError> {
        self.run_in(World::along(&self.config, hand.clone())?)
    }

    fn run_in(&self, world: World) -> Result<Measured, TrialError> {
        let mut running = Running::of(self, world);
        while !running.is_over() {
            running.step(Given::default())?;
        }
        Ok(running.into_measured())
    }
}

/// A trial on its way.
pub struct Running {
    world: World,
    change: Option<Change>,
    traced: bool,
    /// Milliseconds to go.
    left: u128,
    run: Counters,
}

impl Running {
    /// A trial at its beginning.
    ///
    /// # Errors
    /// When a number of the configuration is not accepted.
    pub fn try_new(trial: &Trial) -> Result<Self, TrialError> {
        Ok(Self::of(trial, World::try_new(&trial.config)?))
    }

    /// The same with a hand that goes this way, whatever it feels.
    ///
    /// # Errors
    /// As [`Running::try_new`].
    pub fn along(trial: &Trial, hand: Trace) -> Result<Self, TrialError> {
        Ok(Self::of(trial, World::along(&trial.config, hand)?))
    }

    pub(super) fn of(trial: &Trial, world: World) -> Self {
        Self {
            world,
            change: trial.change,
            traced: trial.traced,
            left: trial.duration.as_millis(),
            run: Counters::default(),
        }
    }

    /// The same, keeping every datagram ([`World::with_packets`]).
    #[must_use]
    pub fn with_packets(self) -> Self {
        let world = self.world.with_packets();
        Self { world, ..self }
    }

    /// Those datagrams, handed out ([`World::take_packets`]).
    pub fn take_packets(&mut self) -> WorldPackets {
        self.world.take_packets()
    }

    /// The world.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Whether its time is over; it may be stepped on all the same.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.left == 0
    }

    /// The next millisecond.
    ///
    /// # Errors
    /// When the object cannot be changed as the trial requires.
    pub fn step(&mut self, given: Given<'_>) -> Result<WorldTick, TrialError> {
        let tick = self.world.step_given(given);
        self.left = self.left.saturating_sub(1);
        self.run.take(&tick, self.traced);
        self.change_if_due()?;
        Ok(tick)
    }

    fn change_if_due(&mut self) -> Result<(), TrialError> {
        let Some(change) = self.change.filter(|_| self.run.watch.is_none()) else {
            return Ok(());
        };
        let pushes = self.world.operator().pushes_completed().unwrap_or_default();
        if pushes != change.after_pushes {
            self.run.push_contact_s = None;
        }
        let contact_s = self.run.push_contact_s.unwrap_or_default();
        if contact_s <= 0.0 || contact_s < change.contact_s {
            return Ok(());
        }
        change.to.apply(self.world.environment_mut())?;
        self.run.watch = Some(Watch::default());
        Ok(())
    }

    /// What it has come to so far.
    #[must_use]
    pub fn measured(&self) -> Measured {
        self.run.clone().measured(&self.world)
    }

    /// What it has come to.
    pub(super) fn into_measured(self) -> Measured {
        self.run.measured(&self.world)
    }
}
