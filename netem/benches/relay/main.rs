//! What a relay adds to a delay, against bare loopback in the same run, what it carries, and the CPU time that it takes for
//! a packet against that of a plain forwarder in C (needs `cc`).
//!
//! Not criterion's kind of measurement: packets leave at fixed times and each is timed.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::print_stdout,
    reason = "a measurement in real time: it reads the clock and owns sockets and threads"
)]

use std::error::Error;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use mmt_netem::LinkConfig;
use mmt_netem::io::relay::{Extras, Relay, RelayHandle};
use mmt_shared::stats::values::quantile;

mod cpu;

const LOCAL: (Ipv4Addr, u16) = (Ipv4Addr::LOCALHOST, 0);
const TICK: Duration = Duration::from_millis(1);
const PINGS: u32 = 5000;
/// What the relay may add each way at the median, us.
const ADDED_US: f64 = 100.0;
const DELAY: Duration = Duration::from_millis(5);
const PACKETS_PER_TICK: u32 = 20;
const TICKS: u32 = 5000;

fn main() -> Result<(), Box<dyn Error>> {
    // alone: cargo bench -p mmt-netem --bench relay -- cpu
    if std::env::args().any(|word| word == "cpu") {
        return cpu::compare();
    }
    let (bare, _) = echo()?;
    let control = round_trips(bare)?;
    let (target, _) = echo()?;
    let relay = relay(target, "delay 5ms")?;
    let relayed = round_trips(relay.local_addr())?;
    let late = relay.stop()?.lateness;
    show("bare loopback, there and back", &control, Duration::ZERO);
    show("through the relay, less 10 ms", &relayed, 2 * DELAY);
    let added = (at_us(&relayed, 0.5) - at_us(&control, 0.5) - us(2 * DELAY)) / 2.0;
    println!(
        "added by the relay each way, p50 against p50: {added:.0} us (target: at most {ADDED_US})"
    );
    println!(
        "released late: p50 {:.0} us, p99 {:.0} us, max {:.0} us{}",
        late.p50_us,
        late.p99_us,
        late.max_us,
        if late.degraded() { " (degraded)" } else { "" }
    );
    carry()?;
    cpu::compare()
}

/// A socket that sends back what it gets.
fn echo() -> Result<(SocketAddr, std::thread::JoinHandle<()>), Box<dyn Error>> {
    let socket = UdpSocket::bind(LOCAL)?;
    let address = socket.local_addr()?;
    let thread = std::thread::spawn(move || {
        let mut buffer = [0; 2048];
        while let Ok((length, from)) = socket.recv_from(&mut buffer) {
            let _ = socket.send_to(buffer.get(..length).unwrap_or_default(), from);
        }
    });
    Ok((address, thread))
}

fn relay(to: SocketAddr, words: &str) -> Result<RelayHandle, Box<dyn Error>> {
    let link: LinkConfig = words.parse()?;
    Ok(Relay::bind(
        LOCAL.into(),
        to,
        link.clone(),
        link,
        1,
        Extras::default(),
    )?)
}

/// Round trips at 1 kHz, sorted; each packet carries its number.
fn round_trips(to: SocketAddr) -> Result<Vec<Duration>, Box<dyn Error>> {
    let socket = UdpSocket::bind(LOCAL)?;
    socket.set_read_timeout(Some(Duration::from_secs(1)))?;
    let receiver = socket.try_clone()?;
    let start = Instant::now();
    let arrivals = std::thread::spawn(move || {
        let mut arrivals = Vec::new();
        let mut buffer = [0; 100];
        while receiver.recv(&mut buffer).is_ok() {
            let number = buffer
                .first_chunk()
                .map_or(0, |bytes| u32::from_le_bytes(*bytes));
            arrivals.push((number, start.elapsed()));
            if arrivals.len() as u32 == PINGS {
                break;
            }
        }
        arrivals
    });
    let mut sent = Vec::new();
    for number in 0..PINGS {
        std::thread::sleep((TICK * number).saturating_sub(start.elapsed()));
        let mut packet = [0; 100];
        if let Some(bytes) = packet.first_chunk_mut() {
            *bytes = number.to_le_bytes();
        }
        sent.push(start.elapsed());
        socket.send_to(&packet, to)?;
    }
    let arrivals = arrivals.join().map_err(|_| "the receiver panicked")?;
    let trip = |(number, arrived): &(u32, Duration)| {
        let sent = sent.get(*number as usize)?;
        Some(arrived.saturating_sub(*sent))
    };
    let mut trips: Vec<Duration> = arrivals.iter().filter_map(trip).collect();
    trips.sort_unstable();
    Ok(trips)
}

fn us(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn at_us(sorted: &[Duration], share: f64) -> f64 {
    quantile(sorted, share).map_or(0.0, us)
}

fn show(what: &str, sorted: &[Duration], less: Duration) {
    let at = |share| at_us(sorted, share) - us(less);
    println!(
        "{what}: {} of {PINGS} packets, p50 {:.0} us, p99 {:.0} us, p99.9 {:.0} us",
        sorted.len(),
        at(0.5),
        at(0.99),
        at(0.999)
    );
}

/// 20 000 packets a second for 5 s, one way.
fn carry() -> Result<(), Box<dyn Error>> {
    let sink = UdpSocket::bind(LOCAL)?;
    sink.set_read_timeout(Some(Duration::from_secs(1)))?;
    let relay = relay(sink.local_addr()?, "delay 5ms")?;
    let counting = std::thread::spawn(move || {
        let mut buffer = [0; 100];
        let mut received = 0_u32;
        while sink.recv(&mut buffer).is_ok() {
            received += 1;
        }
        received
    });
    let source = UdpSocket::bind(LOCAL)?;
    let start = Instant::now();
    for tick in 0..TICKS {
        std::thread::sleep((TICK * tick).saturating_sub(start.elapsed()));
        for _ in 0..PACKETS_PER_TICK {
            source.send_to(&[0; 100], relay.local_addr())?;
        }
    }
    let received = counting.join().map_err(|_| "the receiver panicked")?;
    let seen = relay.stop()?;
    println!(
        "{} packets at {} /s: {} reached the relay, {} sent on, {} blocked, {received} arrived; \
         released late p50 {:.0} us, p99 {:.0} us",
        PACKETS_PER_TICK * TICKS,
        PACKETS_PER_TICK * 1000,
        seen.up.link.offered.packets,
        seen.up.sent.packets,
        seen.up.blocked.packets,
        seen.lateness.p50_us,
        seen.lateness.p99_us
    );
    // what the kernel had no room for never reached the relay; the rest must have been sent on
    if seen.up.sent.packets == seen.up.link.offered.packets {
        Ok(())
    } else {
        Err("the relay lost packets of its own".into())
    }
}
