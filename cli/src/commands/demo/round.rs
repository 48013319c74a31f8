//! A session of a demo, and the wait for the next.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::io::console::Order;
use mmt_client::io::{MasterConfiguration, MasterLive, MasterOptions, OperatorChoice, SessionEnd};
use mmt_client::operator::pointer::Driver;
use mmt_lab::world::WorldConfig;
use mmt_netem::Direction;
use mmt_server::io::{SlaveConfiguration, SlaveLive, SlaveOptions};
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::transport::Transport;
use mmt_shared::io::truth::{self, TruthReceiver, TruthSender};
use mmt_shared::pairing::Pairing;
use mmt_shared::report::{Both, RunReport};
use mmt_shared::wire::Ending;
use tokio::sync::watch;

use super::setting::{Setting, caption};
use crate::args::DemoArguments;
use crate::commands::console::{self, SessionConsole};
use crate::commands::device::Device;
use crate::commands::netem::wrap::Emulation;
use crate::commands::record::Record;
use crate::commands::viewer::Viewer;
use crate::commands::{master, slave};
use crate::failure::Failure;
use crate::stop::Stop;
use crate::view::Caption;

/// How long the slave may take to notice that the master has ended before it is asked to end as well.
pub(super) const FAREWELL: Duration = Duration::from_secs(3);

/// Between two looks at a session that nobody is shown.
pub(super) const LOOK: Duration = Duration::from_millis(50);

/// A session of a demo, and the wait for the next.
pub(super) struct Round<'a> {
    pub(super) setting: &'a mut Setting,
    pub(super) emulation: &'a Emulation,
    pub(super) record: &'a Record,
    pub(super) device: &'a Device,
    pub(super) stop: &'a Stop,
    pub(super) dashboard: bool,
    pub(super) viewer: &'a mut Viewer,
    pub(super) console: Option<&'a mut SessionConsole>,
    /// Whether this is a part of a blind comparison: the hand is the person's, the duration holds, nothing is shown.
    pub(super) blind: bool,
    /// The session that a viewer asked for next.
    pub(super) again: Option<Setting>,
}

/// What a session came to: its report and why it ended.
pub(super) type Ended = Option<(
    RunReport<Both<MasterConfiguration, SlaveConfiguration>>,
    Option<SessionEnd>,
)>;

impl Round<'_> {
    /// Runs slave and master to their end; none if the slave ended before it listened, or a person's wish came before they met.
    pub(super) fn session(&mut self) -> Result<Ended, Failure> {
        let config = self.setting.config()?;
        let arguments = &self.setting.arguments;
        let transport = arguments.transport.choose()?;
        let (stop, stop_slave) = (Stop::new(), Stop::new());
        let (truth_from, truth_to) = truth::pair();
        let mut options = slave_options(transport, self.emulation, &config, truth_from)?;
        options.record = self.record.recorder();
        let (slave, started) = slave::start(options, None, stop_slave.receiver())?;
        let Ok(started) = started.recv() else {
            return slave.join().map(|_| None);
        };
        let caption = caption(arguments, &config, &started.pairing);
        let mut options = master_options(
            arguments,
            transport,
            self.emulation,
            &config,
            started.pairing,
            truth_to,
        );
        options.record = self.record.recorder();
        options.emergency = self.stop.emergency().clone();
        options.scene_hz = Viewer::scene_hz(self.dashboard);
        if let Some(console) = &self.console {
            operated_at(console, &mut options, self.blind);
        }
        self.device.give(&mut options);
        let (master, master_live) = master::start(options, stop.receiver())?;
        self.show(caption, &started.live, &master_live);
        let (mut met, mut master_ended) = (false, None);
        while master.is_running() || slave.is_running() {
            // copied first: a borrow that lives through the viewer's wait would stop the hosts' tasks
            let (slave_now, master_now) = (*started.live.borrow(), *master_live.borrow());
            met |= slave_now.connected;
            self.look(slave_now, master_now);
            self.attend(&stop);
            self.finish_unwatched(&master_now);
            if self.stop.asked() || self.again.is_some() {
                stop.end();
                // a slave that nobody has met waits for nobody now
                if !met {
                    stop_slave.end();
                }
            }
            if !master.is_running() {
                let since = *master_ended.get_or_insert_with(Instant::now);
                if since.elapsed() > FAREWELL {
                    stop_slave.end();
                }
            }
        }
        let (master, slave) = (master.join(), slave.join());
        if !met && self.stop.ending() == Ending::Interrupted && master.is_err() {
            return Ok(None);
        }
        let report = RunReport::of_both(master?, slave?);
        let end = master_live.borrow().ended;
        if let Some(console) = &mut self.console {
            console.show_end(&end.map(|end| end.to_string()).unwrap_or_default());
        }
        Ok(Some((report, end)))
    }

    /// Shows what has begun, at the console if there is one and in the viewer.
    fn show(
        &mut self,
        mut caption: Caption,
        slave: &Arc<watch::Sender<SlaveLive>>,
        master: &watch::Receiver<MasterLive>,
    ) {
        if let Some(console) = &mut self.console {
            let (slave, master) = (Arc::clone(slave), master.clone());
            let connected = move || Some(*slave.borrow()).filter(|slave| slave.connected);
            console.show(&caption, move || *master.borrow(), connected);
            if !self.blind {
                console.show_about(self.setting.shown());
            }
            caption.setting = format!("{}  {}", console.address(), caption.setting);
        }
        self.viewer.caption(caption);
    }

    /// Looks at both; where nothing is shown only time passes.
    fn look(&mut self, slave: SlaveLive, master: MasterLive) {
        if self.blind {
            std::thread::sleep(LOOK);
        } else {
            let slave = Some(slave).filter(|slave| slave.connected);
            self.viewer.look(slave, Some(master));
        }
    }

    /// With a console the loop has no duration of its own: nobody's hand is taken away.
    fn finish_unwatched(&self, master: &MasterLive) {
        let duration_s = self.setting.arguments.duration.as_secs_f64();
        if let Some(console) = &self.console
            && !self.blind
            && master.elapsed_s >= duration_s
            && !console.is_watched()
        {
            console.finish();
        }
    }

    /// After a session: as long as somebody looks on, they may want another.
    pub(super) fn wait(&mut self) {
        while self.again.is_none() && !self.stop.asked() {
            if !self
                .console
                .as_ref()
                .is_some_and(|console| console.is_watched())
            {
                return;
            }
            self.viewer.look(None, None);
            self.attend(&Stop::new());
        }
    }

    /// Does what viewers ask for.
    fn attend(&mut self, stop: &Stop) {
        let Some(console) = &mut self.console else {
            return;
        };
        while let Some(order) = console.next_order() {
            match order {
                Order::Study(_) => {}
                // a participant steers nothing
                _ if self.blind => {}
                Order::End => stop.end(),
                Order::Network(wish) => {
                    match self.setting.networks() {
                        Ok(ways) => console.change_networks(&wish, self.emulation, ways.map(Some)),
                        Err(what) => console.show_about([("note", what.to_string().into())]),
                    }
                    console.show_about(self.setting.shown());
                }
                Order::Restart(wish) => match self.setting.wished(&wish) {
                    Ok(setting) => self.again = Some(setting),
                    Err(what) => console.show_about([("note", what.into())]),
                },
            }
        }
    }
}

/// A person may take the hand of the scripted operator.
pub(super) fn operated_at(console: &SessionConsole, options: &mut MasterOptions, blind: bool) {
    options.scene_hz = console::SCENE_HZ;
    options.events = std::sync::Mutex::new(Some(console.events()));
    let driver = if blind {
        Driver::Pointer
    } else {
        options.duration = None;
        Driver::Scripted
    };
    if let OperatorChoice::Scripted(scripted) = options.operator {
        options.operator = OperatorChoice::Person {
            scripted,
            driver,
            device: None,
        };
    }
}

pub(super) fn slave_options(
    transport: Transport,
    emulation: &Emulation,
    config: &WorldConfig,
    truth: TruthSender,
) -> Result<SlaveOptions, Failure> {
    Ok(SlaveOptions {
        transport,
        listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        identity: Identity::ephemeral().map_err(Failure::failed)?,
        config: config.slave.clone(),
        netem: config.down.clone(),
        netem_seed: config.seed,
        netem_extras: emulation.extras(Direction::Down),
        once: true,
        observers: 0,
        truth: Some(truth),
        record: None,
        emergency: EmergencyStop::default(),
        plant: None,
    })
}

pub(super) fn master_options(
    arguments: &DemoArguments,
    transport: Transport,
    emulation: &Emulation,
    config: &WorldConfig,
    pairing: Pairing,
    truth: TruthReceiver,
) -> MasterOptions {
    MasterOptions {
        transport,
        pairing,
        device: DeviceProfile::default(),
        operator: OperatorChoice::Scripted(config.operator),
        events: std::sync::Mutex::default(),
        device_port: std::sync::Mutex::default(),
        duration: Some(arguments.duration),
        architecture: config.architecture,
        scene_hz: 0,
        commands: CommandConfig {
            samples_per_command: config.samples_per_command,
            repeat_samples: config.repeat_samples,
            stretch_max: config.stretch_max,
        },
        netem: config.up.clone(),
        netem_seed: config.seed,
        netem_extras: emulation.extras(Direction::Up),
        path: None,
        take_over: false,
        resume: None,
        emergency: EmergencyStop::default(),
        truth: Some(truth),
        record: None,
    }
}
