//! What a session came to at the master: its half, which the farewell carries and the report prints.

use std::time::Duration;

use mmt_netem::io::socket::SocketCounters;
use mmt_shared::io::network_task::NetworkTask;
use mmt_shared::report::{MasterHalf, PushesReport};

use super::haptic::HapticLoop;
use super::open::Connected;
use super::options::{MasterOptions, OperatorChoice};
use super::{MasterConfiguration, MasterLive};

/// What the master counted and measured in the `duration` from the welcome to the farewell.
pub(super) fn half(
    haptic: &HapticLoop,
    task: &NetworkTask<MasterLive, HapticLoop>,
    connected: &Connected,
    duration: Duration,
) -> MasterHalf {
    let duration_s = duration.as_secs_f64();
    let mut half = haptic.end.half(duration_s);
    if let Some(completed) = haptic.operator.pushes_completed() {
        half.pushes = PushesReport::new(completed, &haptic.end.counts().breaks);
    }
    let lost = haptic.hand_events_lost();
    half.session.add_drops([("hand_events_ring_full", lost)]);
    if let Some(device) = &haptic.device {
        for (name, count) in device.counts().dropped() {
            half.session
                .add_drops([(format!("device_{name}").as_str(), count)]);
        }
    }
    half.pose = (&haptic.pose).into();
    half.session.timing = (&haptic.timing).into();
    task.add_to(&mut half.session);
    let (meter, before) = (&connected.meter, SocketCounters::default());
    meter.add_to(&mut half.session, &before, connected.address, duration_s);
    half
}

impl From<&MasterOptions> for MasterConfiguration {
    fn from(options: &MasterOptions) -> Self {
        Self {
            slave: options.pairing.address.to_string(),
            transport: options.transport.name(),
            device: options.device,
            operator: match (&options.operator, options.operator.name()) {
                (
                    OperatorChoice::Person {
                        device: Some(_), ..
                    },
                    name,
                ) => {
                    format!("{name} {}", options.device.name())
                }
                (_, name) => name.to_owned(),
            },
            scripted: match &options.operator {
                OperatorChoice::Scripted(config)
                | OperatorChoice::Person {
                    scripted: config, ..
                } => Some(*config),
                OperatorChoice::Trace { .. } => None,
            },
            architecture: options.architecture,
            commands: options.commands,
            netem: options.netem.to_string(),
        }
    }
}
