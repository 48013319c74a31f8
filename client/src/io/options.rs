//! How a master host runs, and who operates.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use mmt_netem::LinkConfig;
use mmt_netem::io::socket::SocketExtras;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::record::Recorder;
use mmt_shared::io::transport::Transport;
use mmt_shared::io::truth::TruthReceiver;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::pairing::Pairing;
use mmt_shared::range::OutOfRange;

use super::device::DevicePort;
use super::hand_events::HandEvents;
use super::resume::ResumeFile;
use crate::commands::CommandConfig;
use crate::device::DeviceProfile;
use crate::operator::Operator;
use crate::operator::pointer::{Driver, HandTuning, Person};
use crate::operator::scripted::{Scripted, ScriptedConfig, View};
use crate::operator::trace::Trace;
use crate::path::PathRecorder;

/// Who operates.
#[derive(Clone, Debug)]
pub enum OperatorChoice {
    /// The scripted operator.
    Scripted(ScriptedConfig),
    /// A person at a pointer or a device. Until the first press `driver` moves the HIP.
    Person {
        /// What the scripted operator does in the meantime.
        scripted: ScriptedConfig,
        /// Who begins.
        driver: Driver,
        /// How the readings of the device that is plugged in are read; none at a pointer.
        device: Option<HandTuning>,
    },
    /// A recorded path, with the name it is reported by.
    Trace {
        /// The path.
        trace: Trace,
        /// Its name.
        name: String,
    },
}

impl OperatorChoice {
    /// The operator at its start, looking at `view`.
    ///
    /// # Errors
    /// Names the first number of the scripted operator that is out of its range.
    pub fn begin(&self, view: View) -> Result<Operator, OutOfRange> {
        match self {
            Self::Scripted(config) => Scripted::try_new(*config, view)
                .map(|scripted| Operator::Scripted(Box::new(scripted))),
            Self::Trace { trace, .. } => Ok(Operator::Trace(trace.clone())),
            Self::Person {
                scripted,
                driver,
                device,
            } => {
                let tuning = device.unwrap_or(HandTuning::POINTER);
                Scripted::try_new(*scripted, view).map(|scripted| {
                    Operator::Person(Box::new(Person::new(scripted, *driver, tuning)))
                })
            }
        }
    }

    /// What it is called; of a device that is plugged in its own name belongs behind it.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Scripted(_) => "scripted",
            Self::Trace { name, .. } => name,
            Self::Person {
                device: Some(_), ..
            } => "device",
            Self::Person {
                driver: Driver::Scripted,
                ..
            } => "scripted or pointer",
            Self::Person {
                driver: Driver::Pointer,
                ..
            } => "pointer",
        }
    }
}

/// A record of the path that a session fills and whoever started it reads.
pub type SharedPath = Arc<Mutex<PathRecorder>>;

/// How a master host runs.
#[derive(Debug)]
pub struct MasterOptions {
    /// Where the slave is, and its secrets.
    pub pairing: Pairing,
    /// What carries the session; the slave's must be the same.
    pub transport: Transport,
    /// The device.
    pub device: DeviceProfile,
    /// Who operates.
    pub operator: OperatorChoice,
    /// What a person does, where one operates; the session takes it.
    pub events: Mutex<Option<HandEvents>>,
    /// The device that is plugged in, where one is; the session takes it.
    pub device_port: Mutex<Option<DevicePort>>,
    /// How long; until the operator has finished or a person ends it if absent.
    pub duration: Option<Duration>,
    /// Whose force the hand feels.
    pub architecture: Architecture,
    /// Scenes that somebody wants to see, 1/s, 0 to 60.
    pub scene_hz: u8,
    /// How commands are made.
    pub commands: CommandConfig,
    /// Emulated network on what the master sends.
    pub netem: LinkConfig,
    /// Seed of the emulated network.
    pub netem_seed: u64,
    /// Record and control of the emulated network.
    pub netem_extras: SocketExtras,
    /// Where the path of the session is kept, if anybody wants it.
    pub path: Option<SharedPath>,
    /// Where the session is recorded, if anybody wants that.
    pub record: Option<Recorder>,
    /// The object's true pose, where the slave lives in this process: for the report.
    pub truth: Option<TruthReceiver>,
    /// Whether another operator of the slave has to go.
    pub take_over: bool,
    /// Where the secret is kept with which this master, started again, resumes at once.
    pub resume: Option<ResumeFile>,
    /// The emergency stop of this side.
    pub emergency: EmergencyStop,
}
