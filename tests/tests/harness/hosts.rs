//! Slave and master as two processes on two hosts, the relay between them on a third.
//!
//! The hosts are network namespaces with addresses of their own, each on one cable to the relay's; there must be no
//! other way between them. Needs root and `ip`.

use std::process::{Command, id};
use std::time::Duration;

use serde_json::Value;

use crate::harness::process::{Ended, PROGRAM, ProcessError, Running};

const SLAVE: &str = "10.91.1.2";
const RELAY_TO_SLAVE: &str = "10.91.1.1";
const RELAY_TO_MASTER: &str = "10.91.2.1";
const MASTER: &str = "10.91.2.2";
/// For what needs no more than a start or an end.
const SOON: Duration = Duration::from_secs(60);

/// Why there are no hosts, or why a session on them came to nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum HostsError {
    /// Namespaces and cables cannot be made here.
    #[error("{0}")]
    Unavailable(String),
    /// A process could not be run or read.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A process ended with another code than 0.
    #[error("exit code {code:?}: {printed}")]
    Ended {
        /// Its exit code; none after a signal.
        code: Option<i32>,
        /// Its standard error.
        printed: String,
    },
    /// Something else was printed or counted than should have been.
    #[error("unexpected: {0}")]
    Unexpected(String),
}

/// Runs `ip`; what it says when it fails.
fn ip(words: &str) -> Result<(), HostsError> {
    let output = Command::new("ip").args(words.split(' ')).output();
    let output =
        output.map_err(|error| HostsError::Unavailable(format!("`ip` does not start: {error}")))?;
    if output.status.success() {
        return Ok(());
    }
    let printed = String::from_utf8_lossy(&output.stderr);
    let printed = format!("`ip {words}`: {}", printed.trim());
    Err(HostsError::Unavailable(printed))
}

/// The three hosts; gone when dropped, with the cables between them.
#[derive(Debug)]
pub(crate) struct Hosts(());

impl Hosts {
    /// Makes the hosts and the cables.
    ///
    /// # Errors
    /// This process may not, or has no `ip`.
    pub(crate) fn try_new() -> Result<Self, HostsError> {
        if !rustix::process::geteuid().is_root() {
            let why = "it needs root to make network namespaces";
            return Err(HostsError::Unavailable(why.to_owned()));
        }
        let hosts = Self(());
        for host in ["slave", "relay", "master"] {
            ip(&format!("netns add {}", Self::name(host)))?;
            ip(&format!("-n {} link set lo up", Self::name(host)))?;
        }
        cable("slave", SLAVE, RELAY_TO_SLAVE)?;
        cable("master", MASTER, RELAY_TO_MASTER)?;
        Ok(hosts)
    }

    /// No other test run has a namespace of this name.
    fn name(host: &str) -> String {
        format!("mmt-{}-{host}", id())
    }

    /// A command that runs on a host.
    fn on(&self, host: &str, program: &str) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &Self::name(host), program]);
        command
    }

    /// Starts `mmt` on a host.
    fn mmt(&self, host: &str, arguments: &[&str]) -> Result<Running, HostsError> {
        let mut command = self.on(host, PROGRAM);
        command.args(arguments);
        Ok(Running::start(command)?)
    }

    /// What the cable's end at a host counted itself.
    fn counted(&self, host: &str) -> Result<Cable, HostsError> {
        let read = |name: &str| {
            let mut command = self.on(host, "cat");
            command.arg(format!("/sys/class/net/cable/statistics/{name}"));
            let output = command.output();
            let output = output.map_err(|error| HostsError::Unexpected(error.to_string()))?;
            let text = String::from_utf8_lossy(&output.stdout);
            let number = text.trim().parse();
            number.map_err(|_| HostsError::Unexpected(format!("{name} is `{text}`")))
        };
        Ok(Cable {
            sent: read("tx_packets")?,
            sent_bytes: read("tx_bytes")?,
            received: read("rx_packets")?,
            received_bytes: read("rx_bytes")?,
        })
    }

    /// What the kernel of a host counted of UDP (RFC 4113): datagrams sent and received.
    fn udp(&self, host: &str) -> Result<Udp, HostsError> {
        let output = self.on(host, "cat").arg("/proc/net/snmp").output();
        let output = output.map_err(|error| HostsError::Unexpected(error.to_string()))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let mut rows = text.lines().filter(|line| line.starts_with("Udp: "));
        let (names, counts) = (rows.next().unwrap_or(""), rows.next().unwrap_or(""));
        let of = |name: &str| {
            let named = names.split(' ').zip(counts.split(' '));
            let mut found = named.filter(|(of, _)| *of == name);
            let count = found.next().and_then(|(_, count)| count.parse().ok());
            count.ok_or_else(|| HostsError::Unexpected(format!("no {name} in `{text}`")))
        };
        Ok(Udp {
            sent: of("OutDatagrams")?,
            received: of("InDatagrams")?,
            refused: of("InErrors")?,
        })
    }

    /// One session of `seconds` through the relay, which does `link` to each direction with `seed`.
    ///
    /// # Errors
    /// A process did not do what it should.
    pub(crate) fn session(
        &self,
        link: &str,
        seconds: u64,
        seed: u64,
    ) -> Result<Session, HostsError> {
        let seed = seed.to_string();
        let listen = format!("{SLAVE}:4433");
        let slave = [
            "slave",
            "--listen",
            "0.0.0.0:4433",
            "--once",
            "--seed",
            &seed,
            "--json",
        ];
        let mut slave = self.mmt("slave", &slave)?;
        let pairing = slave.pairing()?;
        // this host has no route to the world: the slave names the address of its cable
        if !pairing.contains(&listen) {
            let what = format!("{pairing} does not name {listen}");
            return Err(HostsError::Unexpected(what));
        }
        let near = format!("{RELAY_TO_MASTER}:4434");
        let relay = ["netem", "--listen", &near, "--to", &listen];
        let relay = [&relay[..], &["--up", link, "--down", link, "--seed", &seed]].concat();
        let mut relay = self.mmt("relay", &relay)?;
        relay.wait_for_line(SOON, |line| line.contains(&near))?;
        let through_relay = pairing.replace(&listen, &near);
        let duration = format!("{seconds}s");
        let master = ["master", &through_relay, "--duration", &duration];
        let master = self.mmt(
            "master",
            &[&master[..], &["--seed", &seed, "--json"]].concat(),
        )?;
        let master = well(master.end(Duration::from_secs(seconds) + SOON)?)?;
        let slave = well(slave.end(SOON)?)?;
        let session = Session {
            slave: slave.document(1)?,
            master: master.document(0)?,
            slave_cable: self.counted("slave")?,
            master_cable: self.counted("master")?,
            slave_udp: self.udp("slave")?,
            master_udp: self.udp("master")?,
        };
        relay.interrupt()?;
        well(relay.end(SOON)?)?;
        Ok(session)
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for host in ["slave", "relay", "master"] {
            // one that was never made cannot be removed
            let _ = ip(&format!("netns del {}", Self::name(host)));
        }
    }
}

/// A cable from a host to the relay, with an address at each end.
fn cable(host: &str, address: &str, relay_address: &str) -> Result<(), HostsError> {
    let (near, far, end) = (
        Hosts::name(host),
        Hosts::name("relay"),
        format!("to-{host}"),
    );
    ip(&format!(
        "-n {near} link add cable type veth peer name {end} netns {far}"
    ))?;
    for (space, device, address) in [(&near, "cable", address), (&far, &end[..], relay_address)] {
        // without addresses of IPv6 nothing but ARP and ours is on the cable
        ip(&format!("-n {space} link set {device} addrgenmode none"))?;
        ip(&format!("-n {space} address add {address}/24 dev {device}"))?;
        ip(&format!("-n {space} link set {device} up"))?;
    }
    Ok(())
}

/// A process that ended well.
fn well(ended: Ended) -> Result<Ended, HostsError> {
    match ended.status.code() {
        Some(0) => Ok(ended),
        code => Err(HostsError::Ended {
            code,
            printed: ended.err,
        }),
    }
}

/// Counters of one end of a cable.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cable {
    /// Packets that the host sent.
    pub(crate) sent: f64,
    /// Their bytes, Ethernet's header included.
    pub(crate) sent_bytes: f64,
    /// Packets that the host received.
    pub(crate) received: f64,
    /// Their bytes, Ethernet's header included.
    pub(crate) received_bytes: f64,
}

/// Counters of a host's UDP.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Udp {
    /// Datagrams sent.
    pub(crate) sent: f64,
    /// Datagrams received.
    pub(crate) received: f64,
    /// Datagrams that came and were not taken.
    pub(crate) refused: f64,
}

/// One session of both hosts through the relay: their reports and what their cables counted.
#[derive(Debug)]
pub(crate) struct Session {
    /// The slave's report.
    pub(crate) slave: Value,
    /// The master's report.
    pub(crate) master: Value,
    /// What the slave's cable counted.
    pub(crate) slave_cable: Cable,
    /// What the master's cable counted.
    pub(crate) master_cable: Cable,
    /// What the slave's kernel counted of UDP.
    pub(crate) slave_udp: Udp,
    /// What the master's kernel counted of UDP.
    pub(crate) master_udp: Udp,
}
