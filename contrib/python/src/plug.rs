//! `mmt.Device` and `mmt.Plant`: a device and a plant in Python, plugged into a master and a slave (docs/plugs.md).

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use mmt_shared::plug::{
    DEVICE_BYTES, PLANT_BYTES, PlugHead, PlugKind, PlugToken, decode, doubles, encode, singles,
};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

/// Without a packet of mmt for so long there is no force, and no session.
const SILENCE: Duration = Duration::from_millis(20);
/// The longest wait for a command, s.
const WAIT_MAX_S: f64 = 10.0;
/// Room for a packet and a byte, by which a longer one shows.
const ROOM: usize = PLANT_BYTES + 1;
/// Flags of a tool command: a session runs, it begins, and the tool is held by an emergency stop.
const SESSION: u16 = 1;
const BEGINS: u16 = 2;
const HELD: u16 = 4;
/// Flag of an answer: the object was seen.
const OBJECT_SEEN: u16 = 1;

/// x and y.
type Pair = (f64, f64);
/// x, y and z.
type Triple = (f64, f64, f64);

/// One end of a plug: its socket, and the numbers of the packets of both ways.
struct End {
    socket: UdpSocket,
    token: PlugToken,
    sequence: u32,
    newest: u32,
    received: u64,
    lost: u64,
}

impl End {
    /// Plugs in at an address as mmt printed it.
    fn connect(address: &str) -> PyResult<Self> {
        // not shown: a token may stand in it all the same
        let refused =
            || PyValueError::new_err("address is none; mmt prints one: udp://HOST:PORT?token=…");
        let (place, token) = address
            .strip_prefix("udp://")
            .and_then(|rest| rest.split_once("?token="))
            .ok_or_else(refused)?;
        let token: PlugToken = token
            .parse()
            .map_err(|error| PyValueError::new_err(format!("address: {error}")))?;
        let unreached = |error: std::io::Error| PyOSError::new_err(format!("{place}: {error}"));
        let mut found = place.to_socket_addrs().map_err(unreached)?;
        let there = found.next().ok_or_else(refused)?;
        let here: SocketAddr = match there {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(here).map_err(unreached)?;
        socket.connect(there).map_err(unreached)?;
        Ok(Self {
            socket,
            token,
            sequence: 0,
            newest: 0,
            received: 0,
            lost: 0,
        })
    }

    /// Sends a packet; where nobody is (yet), the silence shows it.
    fn send<const BYTES: usize, const N: usize>(
        &mut self,
        kind: PlugKind,
        flags: u16,
        stamp_ns: u64,
        numbers: impl IntoIterator<Item = [u8; N]>,
    ) {
        // it goes round, and 0 is none
        self.sequence = self.sequence.checked_add(1).unwrap_or(1);
        let head = PlugHead {
            flags,
            sequence: self.sequence,
            answers: self.newest,
            stamp_ns,
        };
        let packet: [u8; BYTES] = encode(kind, &self.token, &head, numbers);
        let _ = self.socket.send(&packet);
    }

    /// The next packet of mmt that waits or comes within `wait`: by how many it is ahead of the newest, its flags, and its numbers.
    fn receive(
        &mut self,
        kind: PlugKind,
        length: usize,
        wait: Duration,
    ) -> Option<(u32, u16, [u8; ROOM])> {
        let until = Instant::now() + wait;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            self.socket.set_nonblocking(left.is_zero()).ok()?;
            if !left.is_zero() {
                self.socket.set_read_timeout(Some(left)).ok()?;
            }
            let mut packet = [0; ROOM];
            // nothing came, nobody is there, or a signal for Python
            let bytes = self.socket.recv(&mut packet).ok()?;
            let bytes = packet.get(..bytes).unwrap_or_default();
            let Ok((head, numbers)) = decode(kind, length, &self.token, bytes) else {
                continue;
            };
            let mut room = [0; ROOM];
            for (to, from) in room.iter_mut().zip(numbers) {
                *to = *from;
            }
            return Some((self.ahead(head.sequence), head.flags, room));
        }
    }

    /// Counts a packet: 0 if it is no newer than the newest.
    fn ahead(&mut self, sequence: u32) -> u32 {
        let ahead = match self.newest {
            0 => 1,
            newest => sequence.wrapping_sub(newest),
        };
        self.received += 1;
        if ahead == 0 || ahead > u32::MAX / 2 {
            return 0;
        }
        self.lost += u64::from(ahead - 1);
        self.newest = sequence;
        ahead
    }
}

/// The clock of `time.monotonic_ns()`.
fn monotonic_ns(py: Python<'_>) -> PyResult<u64> {
    py.import("time")?.call_method0("monotonic_ns")?.extract()
}

/// Numbers of a packet: all must be finite.
fn finite<const N: usize>(numbers: [f64; N], what: &str) -> PyResult<[f64; N]> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(numbers);
    }
    let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
    let what = format!("{what} is ({}): it must be finite", numbers.join(", "));
    Err(PyValueError::new_err(what))
}

/// A haptic device at the device link of a master: it sends readings, and gets the force on the hand.
///
/// address: as mmt printed it after "device: ", "udp://HOST:PORT?token=…". Raises ValueError of another text, OSError where no
/// socket can be had. Whether a session runs shows in the first bit of `state`.
#[pyclass(module = "mmt")]
pub(crate) struct Device {
    end: End,
    flags: u16,
    force: Triple,
    hip: Pair,
    lost_up: f64,
    heard: Option<Instant>,
}

#[pymethods]
impl Device {
    #[new]
    fn new(address: &str) -> PyResult<Self> {
        Ok(Self {
            end: End::connect(address)?,
            flags: 0,
            force: (0.0, 0.0, 0.0),
            hip: (0.0, 0.0),
            lost_up: 0.0,
            heard: None,
        })
    }

    /// Sends a reading, a thousand times a second.
    ///
    /// position: (3,), m along the device's axes. velocity: (3,), m/s. buttons: a bit for each; the one that holds the hand must be
    /// seen up before it counts. stamp_ns: when it was taken, by a clock that does not go back; `time.monotonic_ns()` if None.
    /// Raises ValueError where a number is not finite.
    #[pyo3(signature = (position, velocity=[0.0; 3], buttons=0, stamp_ns=None))]
    fn send(
        &mut self,
        py: Python<'_>,
        position: [f64; 3],
        velocity: [f64; 3],
        buttons: u16,
        stamp_ns: Option<u64>,
    ) -> PyResult<()> {
        let position = finite(position, "position")?;
        let velocity = finite(velocity, "velocity")?;
        let stamp_ns = match stamp_ns {
            Some(stamp_ns) => stamp_ns,
            None => monotonic_ns(py)?,
        };
        let numbers = position.into_iter().chain(velocity);
        let numbers = numbers.map(|number| (number as f32).to_le_bytes());
        self.end
            .send::<DEVICE_BYTES, 4>(PlugKind::Reading, buttons, stamp_ns, numbers);
        Ok(())
    }

    /// Takes what has come; returns the force on the hand along the device's axes, (x, y, z), N, which is none after 20 ms of silence.
    fn receive(&mut self) -> Triple {
        let kind = PlugKind::Force;
        while let Some((ahead, flags, numbers)) =
            self.end.receive(kind, DEVICE_BYTES, Duration::ZERO)
        {
            if ahead > 0 {
                let [x, y, z, hip_x, hip_y, lost_up] = singles(&numbers);
                self.flags = flags;
                self.force = (x, y, z);
                self.hip = (hip_x, hip_y);
                self.lost_up = lost_up;
                self.heard = Some(Instant::now());
            }
        }
        if self.heard.is_none_or(|heard| heard.elapsed() > SILENCE) {
            self.flags = 0;
            self.force = (0.0, 0.0, 0.0);
        }
        self.force
    }

    /// Force on the hand along the device's axes when `receive` was last called, (x, y, z), N.
    #[getter]
    fn force(&self) -> Triple {
        self.force
    }

    /// The HIP in the world, (x, y), m.
    #[getter]
    fn hip(&self) -> Pair {
        self.hip
    }

    /// What mmt reports of itself, bits: 1 a session runs, 2 the hand is held, 4 in contact, 8 an emergency stop is set, 16 the slave is
    /// late, 32 the newest reading was refused, or the button was never up.
    #[getter]
    fn state(&self) -> u16 {
        self.flags
    }

    /// Number of the newest reading: how many were sent.
    #[getter]
    fn sequence(&self) -> u32 {
        self.end.sequence
    }

    /// Forces that came.
    #[getter]
    fn received(&self) -> u64 {
        self.end.received
    }

    /// Readings that never came, as the master counts them.
    #[getter]
    fn lost_up(&self) -> u64 {
        self.lost_up as u64
    }

    /// Forces that never came.
    #[getter]
    fn lost_down(&self) -> u64 {
        self.end.lost
    }

    fn __repr__(&self) -> String {
        let Self { end, flags, .. } = self;
        format!(
            "<mmt.Device: {} sent, {} received, state {flags}>",
            end.sequence, end.received
        )
    }
}

/// Where the tool has to be.
///
/// tool, velocity: (x, y), m and m/s, world. stiffness, damping: k_p and k_d of the master's device, N/m and N s/m. force_max: it
/// presses with no more, N. begins: a session begins, no sample of the hand has come yet. held: an emergency stop is set, the
/// tool stands. periods: of 1 ms since the command before: a simulator computes so many.
#[pyclass(frozen, get_all, module = "mmt")]
pub(crate) struct Command {
    tool: Pair,
    velocity: Pair,
    stiffness: f64,
    damping: f64,
    force_max: f64,
    begins: bool,
    held: bool,
    periods: u32,
}

#[pymethods]
impl Command {
    fn __repr__(&self) -> String {
        let Self { tool, periods, .. } = self;
        format!("<mmt.Command: tool {tool:?} m, {periods} periods>")
    }
}

/// A robot or a simulator at the plant link of a slave: it takes commands, and sends what it measured.
///
/// address: as mmt printed it after "plant: ", "udp://HOST:PORT?token=…". Raises ValueError of another text, OSError where no
/// socket can be had.
#[pyclass(module = "mmt")]
pub(crate) struct Plant {
    // one thread may look on while another waits
    end: Mutex<End>,
}

impl Plant {
    fn with<T: Send>(&self, py: Python<'_>, act: impl FnOnce(&mut End) -> T + Send) -> T {
        py.detach(|| act(&mut self.end.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Plant {
    #[new]
    fn new(address: &str) -> PyResult<Self> {
        let end = Mutex::new(End::connect(address)?);
        Ok(Self { end })
    }

    /// The newest command, which is waited for so long, s, 0 to 10; None if none came. Releases the GIL.
    fn command(&self, py: Python<'_>, wait_s: f64) -> PyResult<Option<Command>> {
        if !(0.0..=WAIT_MAX_S).contains(&wait_s) {
            let what = format!("wait_s is {wait_s}; it must be 0 to {WAIT_MAX_S} s");
            return Err(PyValueError::new_err(what));
        }
        let wait = Duration::from_secs_f64(wait_s);
        Ok(self.with(py, |end| newest(end, wait)))
    }

    /// Sends what was measured, at the latest 20 ms after the last.
    ///
    /// tool, velocity: where the tool is and how fast, (x, y), m and m/s, world. force: of the tool on the object, (x, y), N.
    /// pose: (x, y, angle) of the object, m, m, rad, where it was seen since the last answer. image_age_s: how old that is, s.
    /// Raises ValueError where a number is not finite.
    #[pyo3(signature = (tool, velocity, force, pose=None, image_age_s=0.0))]
    fn answer(
        &self,
        py: Python<'_>,
        tool: [f64; 2],
        velocity: [f64; 2],
        force: [f64; 2],
        pose: Option<[f64; 3]>,
        image_age_s: f64,
    ) -> PyResult<()> {
        let flags = if pose.is_some() { OBJECT_SEEN } else { 0 };
        let tool = finite(tool, "tool")?;
        let velocity = finite(velocity, "velocity")?;
        let force = finite(force, "force")?;
        let pose = finite(pose.unwrap_or_default(), "pose")?;
        let age = finite([image_age_s], "image_age_s")?;
        let numbers = [&tool[..], &velocity, &force, &pose, &age].concat();
        let numbers = numbers.into_iter().map(f64::to_le_bytes);
        let stamp_ns = monotonic_ns(py)?;
        self.with(py, |end| {
            end.send::<PLANT_BYTES, 8>(PlugKind::Answer, flags, stamp_ns, numbers);
        });
        Ok(())
    }

    /// Commands that came.
    #[getter]
    fn received(&self, py: Python<'_>) -> u64 {
        self.with(py, |end| end.received)
    }

    /// Commands that never came.
    #[getter]
    fn lost(&self, py: Python<'_>) -> u64 {
        self.with(py, |end| end.lost)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        self.with(py, |end| {
            let End {
                sequence, received, ..
            } = end;
            format!("<mmt.Plant: {received} received, {sequence} sent>")
        })
    }
}

/// The first is waited for; then those that wait already. One that came late or twice is answered, and not computed again.
fn newest(end: &mut End, wait: Duration) -> Option<Command> {
    let mut newest: Option<Command> = None;
    let mut wait = wait;
    while let Some((ahead, flags, numbers)) = end.receive(PlugKind::Tool, PLANT_BYTES, wait) {
        if flags & SESSION == 0 {
            continue;
        }
        wait = Duration::ZERO;
        let before = newest.take();
        let periods = ahead.saturating_add(before.as_ref().map_or(0, |before| before.periods));
        let late = before.filter(|_| ahead == 0);
        let command = late.unwrap_or_else(|| {
            let [x, y, v_x, v_y, stiffness, damping, force_max] = doubles(&numbers);
            Command {
                tool: (x, y),
                velocity: (v_x, v_y),
                stiffness,
                damping,
                force_max,
                begins: flags & BEGINS != 0,
                held: flags & HELD != 0,
                periods: 0,
            }
        });
        newest = Some(Command { periods, ..command });
    }
    newest
}
