//! A slave and the relay before it, and what is between them.

use std::path::{Path, PathBuf};
use std::time::Duration;

use mmt_lab::swarm::{Fault, Scheduled};
use mmt_lab::worlds::RandomWorld;
use mmt_shared::pairing::Pairing;

use super::process::Process;
use crate::failure::Failure;

/// Half of a period of flapping.
const FLAP: Duration = Duration::from_millis(100);
/// The latest that [`Fault::Late`] makes a datagram, ms.
const LATE_MS: f64 = 400.0;

/// A slave, and the relay before it.
#[derive(Debug)]
pub(super) struct Rig {
    folder: PathBuf,
    state: PathBuf,
    /// Of the slave, with the relay's address in it: a secret.
    pairing: Pairing,
    slave_at: String,
    /// Files that the slave has recorded, one a process.
    records: Vec<PathBuf>,
    /// None while it is dead.
    pub(super) slave: Option<Process>,
    pub(super) relay: Process,
    /// The settings that the relay received last, up and down.
    settings: [String; 2],
}

/// Whether the slave records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Recording {
    /// Into files in the rig's folder.
    On,
    /// The index of a record grows with the record.
    Off,
}

impl Rig {
    /// Starts both. `state` has what the processes keep for themselves: the slave's identity among it.
    ///
    /// # Errors
    /// One does not start.
    pub(super) fn start(
        folder: &Path,
        state: &Path,
        recording: Recording,
        seed: u64,
    ) -> Result<Self, Failure> {
        let mut records = Vec::new();
        let record = (recording == Recording::On).then(|| record(folder, &mut records));
        let mut slave = slave(folder, state, 1, "127.0.0.1:0", record.as_deref())?;
        let mut pairing = paired(&mut slave)?;
        let slave_at = pairing.address.to_string();
        let seed = seed.to_string();
        let words = ["netem", "--listen", "127.0.0.1:0", "--to", &slave_at];
        let words = [&words[..], &["--control", "--json", "--seed", &seed]].concat();
        let mut relay = Process::start("relay", folder, state, &words)?;
        let relay_at = relay.first_line()?;
        pairing.address = relay_at
            .parse()
            .map_err(|error| Failure::failed(format!("the relay printed no address: {error}")))?;
        Ok(Self {
            folder: folder.to_owned(),
            state: state.to_owned(),
            pairing,
            slave_at,
            records,
            slave: Some(slave),
            relay,
            settings: Default::default(),
        })
    }

    /// Starts the slave again where it was.
    ///
    /// # Errors
    /// It does not start.
    pub(super) fn revive(&mut self) -> Result<(), Failure> {
        let record = record(&self.folder, &mut self.records);
        let number = self.records.len();
        let mut slave = slave(
            &self.folder,
            &self.state,
            number,
            &self.slave_at,
            Some(&record),
        )?;
        paired(&mut slave)?;
        self.slave = Some(slave);
        Ok(())
    }

    /// What the slave recorded, a file for each of its processes.
    pub(super) fn records(&self) -> &[PathBuf] {
        &self.records
    }

    /// Its processes, to be ended: the relay last.
    pub(super) fn into_processes(self) -> impl Iterator<Item = Process> {
        self.slave.into_iter().chain([self.relay])
    }

    /// What a master is given on its stdin: a secret.
    pub(super) fn pairing(&self) -> String {
        self.pairing.to_string()
    }

    /// Makes the network that of the world, with these faults.
    pub(super) fn network(&mut self, world: &RandomWorld, faults: &[Scheduled]) {
        let ways = [
            ("up", &world.config.up, Fault::UpSilent),
            ("down", &world.config.down, Fault::DownSilent),
        ];
        for ((way, link, silent), settings) in ways.into_iter().zip(&mut self.settings) {
            let link = std::iter::once(link.to_string());
            let faults = faults.iter().filter_map(|of| behind(of, silent));
            let line = format!(
                "{way} {}",
                link.chain(faults).collect::<Vec<_>>().join("; then ")
            );
            if *settings != line {
                self.relay.send_line(&line);
                *settings = line;
            }
        }
    }

    /// Gives every master another port toward the slave, as a NAT that forgets.
    pub(super) fn rebind(&mut self) {
        self.relay.send_line("rebind");
    }
}

/// What a fault puts behind the link of a direction that is silent with `silent`.
fn behind(of: &Scheduled, silent: Fault) -> Option<String> {
    let flap_ms = FLAP.as_millis();
    match of.fault {
        Fault::BothSilent => Some("loss 100%".to_owned()),
        fault if fault == silent => Some("loss 100%".to_owned()),
        Fault::Burst => Some("loss 50%".to_owned()),
        Fault::Flapping => Some(format!("outage 0s for {flap_ms}ms every {}ms", 2 * flap_ms)),
        Fault::Late => {
            let half_ms = of.strength * LATE_MS / 2.0;
            Some(format!("delay {half_ms:.3}ms {half_ms:.3}ms order free"))
        }
        Fault::Replayed => Some(format!("duplicate {:.1}%", 100.0 * of.strength)),
        Fault::Mutated => Some(format!("corrupt {:.1}%", 20.0 * of.strength)),
        _ => None,
    }
}

/// Where the next process of the slave records.
fn record(folder: &Path, records: &mut Vec<PathBuf>) -> PathBuf {
    let path = folder.join(format!("slave-{}.mcap", records.len() + 1));
    records.push(path.clone());
    path
}

/// The rig's process number so and so of the slave.
fn slave(
    folder: &Path,
    state: &Path,
    number: usize,
    listen: &str,
    record: Option<&Path>,
) -> Result<Process, Failure> {
    let record = record.map(Path::to_string_lossy);
    let mut words = vec!["slave", "--listen", listen, "--json"];
    words.extend(record.iter().flat_map(|record| ["--record", record]));
    Process::start(&format!("slave-{number}"), folder, state, &words)
}

fn paired(slave: &mut Process) -> Result<Pairing, Failure> {
    let line = slave.first_line()?;
    // the error holds nothing of the secret
    line.parse()
        .map_err(|error| Failure::failed(format!("the slave printed no pairing string: {error}")))
}
