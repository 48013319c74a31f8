//! `mmt device test`: reads a device for some seconds and judges whether it does.
//!
//! The hand is the session's: the same clutch, clock map, limits and ramp; only the model is missing.

use std::fmt;
use std::time::Duration;

use mmt_client::device::link::HandOutput;
use mmt_client::io::device::DeviceHost;
use mmt_client::limiter::ForceLimiter;
use mmt_client::operator::pointer::{Driver, HandTuning, Person};
use mmt_client::operator::scripted::{Scripted, ScriptedConfig, View};
use mmt_shared::clean::clean;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::ticker::Ticker;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::plug::PlugCounts;
use mmt_shared::stats::histogram::Histogram;
use mmt_shared::time::{TICK, Time};
use serde::Serialize;

use super::gauge::Gauge;
use super::hand::Device;
use crate::args::DeviceTestArguments;
use crate::failure::{Exit, Failure};
use crate::output::{note, print, print_json};
use crate::stop::Stop;

/// A device that is asked, and sends nothing for so long, is not there.
const PATIENCE: Duration = Duration::from_secs(10);
/// Readings a second below which a device is unfit, and below which there is advice.
const RATES_HZ: (f64, f64) = (500.0, 900.0);

/// What was found; a number that is not known is null.
#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    device: &'static str,
    address: String,
    verdict: &'static str,
    /// What to do; none where nothing is to be done.
    advice: Vec<String>,
    readings: u64,
    duration_s: f64,
    rate_hz: f64,
    /// Between readings.
    interval_ms: Spread,
    /// How much later than the fastest each reading came by its stamp; all 0 where a device has no clock.
    late_ms: Spread,
    /// Least and greatest place on each axis of the device.
    place_min_m: [f64; 3],
    place_max_m: [f64; 3],
    speed_max_m_per_s: f64,
    /// Bits of the buttons that were down at some time.
    buttons: u16,
    /// For how long the hand was held.
    held_s: f64,
    /// Greatest force that was asked for.
    force_peak_n: f64,
    drops: Drops,
}

#[derive(Debug, Serialize)]
struct Spread {
    p50: f64,
    p99: f64,
    max: f64,
}

#[derive(Debug, Serialize)]
struct Drops {
    lost: u64,
    late: u64,
    malformed: u64,
    nonsense: u64,
}

impl From<&Histogram> for Spread {
    fn from(of: &Histogram) -> Self {
        let of = of.quantiles();
        let [p50, p99, max] = [of.p50, of.p99, of.max].map(|one| one.as_secs_f64() * 1e3);
        Self { p50, p99, max }
    }
}

/// Runs `mmt device test`.
///
/// # Errors
/// Wrong input, nobody there, or a device that is unfit.
pub(super) fn run(arguments: &DeviceTestArguments) -> Result<(), Failure> {
    let stop = Stop::on_signals()?;
    let device = Device::start(&arguments.device, None)?;
    let Some((host, tuning)) = &device.plugged_in else {
        return Err(
            Failure::usage("a device that is not plugged in needs no test")
                .remedy("add --device link, inverse3 or 2diy"),
        );
    };
    let felt = feel(arguments, &device, host, *tuning, &stop)?;
    if felt.gauge.readings == 0 {
        let what = format!("nothing came from the device at {}", host.address());
        return Err(Failure::new(Exit::NoAnswer, what)
            .remedy("is it switched on and calibrated? mmt device list shows what is there"));
    }
    let document = Document::of(&device, host, &felt);
    let unfit = document.verdict == "unfit";
    let advice = document.advice.join("; ");
    if arguments.json {
        print_json(&document)?;
    } else {
        print(&document)?;
    }
    if unfit {
        return Err(Failure::new(Exit::Failed, "the device is unfit").remedy(advice));
    }
    note("no force is left on the device");
    Ok(())
}

/// What a test came to.
#[derive(Debug, Default)]
struct Felt {
    gauge: Gauge,
    /// Ticks in which the hand was held.
    held_ticks: u32,
    /// Greatest force that was asked for, N.
    force_peak_n: f64,
    counts: PlugCounts,
}

/// Reads the device for as long as the test lasts, and lets a hand feel the force that was asked for.
fn feel(
    arguments: &DeviceTestArguments,
    device: &Device,
    host: &DeviceHost,
    tuning: HandTuning,
    stop: &Stop,
) -> Result<Felt, Failure> {
    let (mut port, mut readings) = (host.port(), host.readings());
    let view = View {
        pose: Pose::default(),
        footprint: BoxFootprint::square(0.4),
        in_contact: false,
    };
    let scripted = Scripted::try_new(ScriptedConfig::default(), view).map_err(Failure::usage)?;
    let mut person = Person::new(scripted, Driver::Pointer, tuning);
    let limits = device.profile.limits();
    let mut limiter = ForceLimiter::try_new(limits).map_err(Failure::usage)?;
    let clock = Clock::start();
    let mut ticker = Ticker::new(clock, TICK);
    let mut felt = Felt::default();
    let mut begun = None;
    let own = device.profile.name() != "link";
    loop {
        ticker.wait();
        let now = clock.now();
        while let Ok(seen) = readings.pop() {
            begun = begun.or(Some(now));
            felt.gauge.take(&seen);
        }
        let over = match begun {
            Some(begun) => now.saturating_since(begun) >= arguments.duration,
            None => own && now.saturating_since(Time::ZERO) >= PATIENCE,
        };
        let elapsed = now.saturating_since(Time::ZERO);
        while let Some(event) = port.event() {
            person.handle(elapsed, event);
        }
        let hip = person.step(elapsed, &view, Vec2::zeros());
        if person.engaged() && !over && !stop.asked() {
            limiter.engage();
        } else {
            limiter.release();
        }
        felt.held_ticks += u32::from(person.engaged());
        let force = limiter.limit(Vec2::new(arguments.force, 0.0));
        felt.force_peak_n = felt.force_peak_n.max(force.norm());
        port.give(HandOutput {
            force,
            hip,
            engaged: limiter.engaged(),
            ..HandOutput::default()
        });
        // the ramp ends before the test does
        if (over || stop.asked()) && limiter.at_rest() {
            felt.counts = port.counts();
            return Ok(felt);
        }
    }
}

impl Document {
    fn of(device: &Device, host: &DeviceHost, felt: &Felt) -> Self {
        let Felt { gauge, counts, .. } = felt;
        let mut document = Document {
            version: env!("CARGO_PKG_VERSION"),
            command: "device test",
            device: device.profile.name(),
            address: clean(host.address().split('?').next().unwrap_or_default()).to_string(),
            verdict: "fit",
            advice: Vec::new(),
            readings: gauge.readings,
            duration_s: 0.0,
            rate_hz: 0.0,
            interval_ms: (&gauge.interval).into(),
            late_ms: (&gauge.late).into(),
            place_min_m: gauge.range.map(|(least, _)| least),
            place_max_m: gauge.range.map(|(_, most)| most),
            speed_max_m_per_s: gauge.speed_max,
            buttons: gauge.buttons,
            held_s: f64::from(felt.held_ticks) * TICK.as_secs_f64(),
            force_peak_n: felt.force_peak_n,
            drops: Drops {
                lost: counts.lost,
                late: counts.late,
                malformed: counts.malformed,
                nonsense: counts.nonsense,
            },
        };
        if let (Some(first), Some(last)) = (gauge.first, gauge.last) {
            document.duration_s = last.saturating_since(first).as_secs_f64();
            document.rate_hz = (gauge.readings - 1) as f64 / document.duration_s.max(1e-9);
        }
        document.judge(counts);
        document
    }

    fn judge(&mut self, counts: &PlugCounts) {
        let (least, good) = RATES_HZ;
        let mut advise = |verdict, advice: String| {
            if self.verdict != "unfit" {
                self.verdict = verdict;
            }
            self.advice.push(advice);
        };
        let rate = self.rate_hz;
        if rate < least {
            let what =
                format!("{rate:.0} readings a second are too few to feel with: at least {least}");
            advise("unfit", what);
        } else if rate < good {
            advise(
                "advised",
                "mmt doctor reports what keeps a loop from 1000 Hz".to_owned(),
            );
        }
        if counts.taken > 0 && counts.nonsense * 2 > counts.taken {
            let middle: Vec<_> = self.place_min_m.iter().zip(&self.place_max_m).collect();
            let middle: Vec<_> = middle
                .iter()
                .map(|(a, b)| format!("{:.3}", f64::midpoint(**a, **b)))
                .collect();
            let what = format!(
                "most readings were outside of the workspace, or impossible; the middle of what came: centre_m = [{}]",
                middle.join(", ")
            );
            advise("unfit", what);
        } else if counts.nonsense + counts.malformed > 0 {
            let what = "readings were refused: keep inside the workspace, or check the cable";
            advise("advised", what.to_owned());
        }
    }
}

impl fmt::Display for Document {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            interval_ms: between,
            late_ms: late,
            drops,
            ..
        } = self;
        writeln!(f, "device       {} at {}", self.device, self.address)?;
        let rate = self.rate_hz;
        writeln!(f, "readings     {}, {rate:.0} a second", self.readings)?;
        let Spread { p50, p99, max } = between;
        writeln!(
            f,
            "between      {p50:.2} ms, p99 {p99:.2}, longest {max:.2}"
        )?;
        let Spread { p50, p99, max } = late;
        writeln!(f, "late         {p50:.2} ms, p99 {p99:.2}, most {max:.2}")?;
        let ranges = self.place_min_m.iter().zip(&self.place_max_m);
        for (axis, (least, most)) in ["x", "y", "z"].iter().zip(ranges) {
            writeln!(f, "{axis}            {least:.4} to {most:.4} m")?;
        }
        writeln!(f, "speed        up to {:.3} m/s", self.speed_max_m_per_s)?;
        writeln!(
            f,
            "held         {:.1} s, force up to {:.2} N, buttons {:#06b}",
            self.held_s, self.force_peak_n, self.buttons
        )?;
        let drops = [
            ("lost", drops.lost),
            ("late", drops.late),
            ("malformed", drops.malformed),
            ("nonsense", drops.nonsense),
        ];
        let dropped = drops.iter().filter(|(_, count)| *count > 0);
        let dropped: Vec<_> = dropped.map(|(name, n)| format!("{name} {n}")).collect();
        if !dropped.is_empty() {
            writeln!(f, "dropped      {}", dropped.join(", "))?;
        }
        write!(f, "verdict      {}", self.verdict)?;
        for advice in &self.advice {
            write!(f, "\n             what to do: {advice}")?;
        }
        Ok(())
    }
}
