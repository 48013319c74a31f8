//! CPU time for a packet, of the relay and of a plain forwarder in C, under the same load by turns in the same run.

use std::error::Error;
use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use super::{LOCAL, TICK, relay, us};

/// What the relay may take of the forwarder's CPU time.
const RATIO: f64 = 1.2;
/// Both take turns so often, each time for so long.
const ROUNDS: u32 = 5;
const ROUND: Duration = Duration::from_secs(2);
const PACKET: [u8; 100] = [0; 100];
/// Another kernel buffer's worth of time after the last packet.
const LAST: Duration = Duration::from_millis(100);

type Outcome<T> = Result<T, Box<dyn Error>>;

/// What is sent to the target, which sends everything back.
struct Load {
    clients: u32,
    /// Packets of each client, one after the other, and how often.
    group: u32,
    every: Duration,
}

impl Load {
    fn per_second(&self) -> f64 {
        f64::from(self.clients * self.group) / self.every.as_secs_f64()
    }
}

/// Prints the comparison for several loads and links.
pub(crate) fn compare() -> Outcome<()> {
    let one = Load {
        clients: 1,
        group: 1,
        every: TICK,
    };
    let many = Load {
        clients: 8,
        group: 10,
        every: 4 * TICK,
    };
    println!(
        "CPU a packet, relay against a plain forwarder in C, the ratio over all of {ROUNDS} rounds and of each (target: at most {RATIO})\n  \
         load                                link       relay_us   forwarder_us   ratio   least   most"
    );
    for load in [one, many] {
        for words in ["none", "delay 5ms"] {
            compare_under(&load, words)?;
        }
    }
    Ok(())
}

fn compare_under(load: &Load, words: &str) -> Outcome<()> {
    let target = Target::start()?;
    let plain = Plain::start(target.address)?;
    let relay = relay(target.address, words)?;
    let relay_thread = thread_named("netem-relay")?;
    let (mut of_plain, mut of_relay) = (Taken::default(), Taken::default());
    let mut ratios = Vec::new();
    for _ in 0..ROUNDS {
        let plain = measure(load, plain.address, &plain.schedstat(), &target)?;
        let relay = measure(load, relay.local_addr(), &relay_thread, &target)?;
        ratios.push(relay.a_packet_us() / plain.a_packet_us());
        of_plain.add(&plain);
        of_relay.add(&relay);
    }
    ratios.sort_by(f64::total_cmp);
    let [least, .., most] = ratios.as_slice() else {
        return Err("no rounds".into());
    };
    let (relay, plain) = (of_relay.a_packet_us(), of_plain.a_packet_us());
    let load = format!(
        "{} client(s), {:.0}/s each way by {}",
        load.clients,
        load.per_second(),
        load.group
    );
    println!(
        "  {load:<34}  {words:<9}  {relay:>8.2}   {plain:>12.2}   {:>5.2}   {least:>5.2}   {most:>4.2}",
        relay / plain
    );
    Ok(())
}

/// CPU time, and the packets that it was for.
#[derive(Default)]
struct Taken {
    time: Duration,
    packets: u32,
}

impl Taken {
    fn add(&mut self, other: &Self) {
        self.time += other.time;
        self.packets += other.packets;
    }

    fn a_packet_us(&self) -> f64 {
        us(self.time) / f64::from(self.packets.max(1))
    }
}

/// One round through a forwarder whose CPU time the kernel counts in the file `schedstat`.
fn measure(
    load: &Load,
    forwarder: SocketAddr,
    schedstat: &Path,
    target: &Target,
) -> Outcome<Taken> {
    let clients = (0..load.clients).map(|_| Client::start(forwarder));
    let clients = clients.collect::<Outcome<Vec<Client>>>()?;
    let there_before = target.arrived.load(Ordering::Relaxed);
    let before = cpu_time(schedstat)?;
    let start = Instant::now();
    let mut groups = 0;
    while start.elapsed() < ROUND {
        std::thread::sleep((load.every * groups).saturating_sub(start.elapsed()));
        groups += 1;
        for client in &clients {
            for _ in 0..load.group {
                client.socket.send(&PACKET)?;
            }
        }
    }
    std::thread::sleep(LAST);
    let time = cpu_time(schedstat)?.saturating_sub(before);
    let there = target.arrived.load(Ordering::Relaxed) - there_before;
    let back = clients.iter().map(Client::arrived).sum::<u32>();
    Ok(Taken {
        time,
        packets: there + back,
    })
}

/// What this thread took of a processor so far.
fn cpu_time(schedstat: &Path) -> Outcome<Duration> {
    let counts = std::fs::read_to_string(schedstat)?;
    let nanos = counts.split(' ').next().unwrap_or("0").parse()?;
    Ok(Duration::from_nanos(nanos))
}

/// The counts of the thread of this name in this process; it gives itself the name once it runs.
fn thread_named(name: &str) -> Outcome<PathBuf> {
    let named = |task: &PathBuf| {
        let its = std::fs::read_to_string(task.join("comm")).unwrap_or_default();
        its.trim_end() == name
    };
    for _ in 0..100 {
        let tasks = std::fs::read_dir("/proc/self/task")?.flatten();
        if let Some(found) = tasks.map(|task| task.path()).find(named) {
            return Ok(found.join("schedstat"));
        }
        std::thread::sleep(10 * TICK);
    }
    Err("no such thread".into())
}

/// Counts what arrives at a socket until it is dropped.
struct Counting {
    arrived: Arc<AtomicU32>,
    over: Arc<AtomicBool>,
}

impl Counting {
    fn start(socket: UdpSocket, and: impl Fn(&UdpSocket, SocketAddr) + Send + 'static) -> Self {
        let counting = Self {
            arrived: Arc::default(),
            over: Arc::default(),
        };
        let (arrived, over) = (counting.arrived.clone(), counting.over.clone());
        std::thread::spawn(move || {
            let mut buffer = PACKET;
            while !over.load(Ordering::Relaxed) {
                if let Ok((_, from)) = socket.recv_from(&mut buffer) {
                    arrived.fetch_add(1, Ordering::Relaxed);
                    and(&socket, from);
                }
            }
        });
        counting
    }
}

impl Drop for Counting {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

/// Sends back what it gets.
struct Target {
    address: SocketAddr,
    arrived: Arc<AtomicU32>,
    _counting: Counting,
}

impl Target {
    fn start() -> Outcome<Self> {
        let socket = patient()?;
        let address = socket.local_addr()?;
        let counting = Counting::start(socket, |socket, from| {
            let _ = socket.send_to(&PACKET, from);
        });
        Ok(Self {
            address,
            arrived: counting.arrived.clone(),
            _counting: counting,
        })
    }
}

struct Client {
    socket: UdpSocket,
    counting: Counting,
}

impl Client {
    fn start(to: SocketAddr) -> Outcome<Self> {
        let socket = patient()?;
        socket.connect(to)?;
        Ok(Self {
            counting: Counting::start(socket.try_clone()?, |_, _| ()),
            socket,
        })
    }

    fn arrived(&self) -> u32 {
        self.counting.arrived.load(Ordering::Relaxed)
    }
}

/// A socket that waits for a second.
fn patient() -> Outcome<UdpSocket> {
    let socket = UdpSocket::bind(LOCAL)?;
    socket.set_read_timeout(Some(Duration::from_secs(1)))?;
    Ok(socket)
}

/// The forwarder in C, a process of its own; ends with its standard input.
struct Plain {
    address: SocketAddr,
    child: Child,
}

impl Plain {
    fn start(target: SocketAddr) -> Outcome<Self> {
        let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("forwarder");
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/relay/forwarder.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-O2", "-Wall", "-o"]).arg(&program);
        let status = compiler.arg(source).status();
        let status = status.map_err(|error| format!("no comparison without `cc`: {error}"))?;
        if !status.success() {
            return Err("the forwarder does not compile".into());
        }
        let mut child = Command::new(program)
            .arg(target.port().to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut port = String::new();
        let stdout = child.stdout.take().ok_or("no output")?;
        BufReader::new(stdout).read_line(&mut port)?;
        let address = (LOCAL.0, port.trim_end().parse()?).into();
        Ok(Self { address, child })
    }

    fn schedstat(&self) -> PathBuf {
        format!("/proc/{}/schedstat", self.child.id()).into()
    }
}

impl Drop for Plain {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}
