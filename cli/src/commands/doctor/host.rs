//! What `mmt doctor` finds on this host by itself.

use std::ops::ControlFlow;
use std::path::Path;
use std::thread;
use std::time::Duration;

use super::finding::{Finding, Verdict};
use mmt_server::io::address_for_others;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::realtime::{self, Obtained, RealTime};
use mmt_shared::io::ticker::{Ticker, TickerReport};
use mmt_shared::time::TICK;

/// How long the loop is measured.
pub(super) const LOOP: Duration = Duration::from_secs(3);
/// A loop that is later than this in one tick of a hundred is felt.
const LATE_MOST: Duration = Duration::from_micros(500);
/// Of a thousand ticks this many may be skipped.
const SKIPPED_PER_MILLE: u64 = 1;
/// A relay's sockets ask for so much, bytes.
const BUFFER: u64 = 4 * 1024 * 1024;

/// All findings.
pub(super) fn findings() -> Vec<Finding> {
    let read = |path: &str| std::fs::read_to_string(Path::new(path)).ok();
    let (rights, loops) = measure();
    let governors = (0..).map_while(|cpu| {
        read(&format!(
            "/sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor"
        ))
    });
    let mut found = vec![timer(loops.as_ref())];
    found.extend(rights.iter().flat_map(of_rights));
    found.extend([
        cores(thread::available_parallelism().map_or(1, usize::from)),
        governor(&governors.collect::<Vec<_>>()),
        clock(read("/sys/devices/system/clocksource/clocksource0/current_clocksource").as_deref()),
        buffers(read("/proc/sys/net/core/rmem_max").as_deref()),
        address(),
    ]);
    found
}

/// What a thread of its own obtains and how its loop does; none where no thread is to be had.
fn measure() -> (Option<RealTime>, Option<TickerReport>) {
    let looping = || {
        let rights = realtime::request();
        let clock = Clock::start();
        let end = clock.now() + LOOP;
        let mut ticker = Ticker::new(clock, TICK);
        ticker.run(|tick| {
            if tick.deadline < end {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        (rights, ticker.report())
    };
    match thread::Builder::new()
        .spawn(looping)
        .map(thread::JoinHandle::join)
    {
        Ok(Ok((rights, report))) => (Some(rights), Some(report)),
        _ => (None, None),
    }
}

fn timer(report: Option<&TickerReport>) -> Finding {
    let subject = "1 kHz loop";
    let Some(report) = report else {
        return Finding::of(
            subject,
            Verdict::Unfit,
            "no thread is to be had",
            "raise `ulimit -u`",
        );
    };
    let (late, skipped, ticks) = (report.lateness.p99, report.skipped, report.ticks);
    let found = format!(
        "p99 {:.0} us late, {skipped} of {} ticks skipped",
        late.as_secs_f64() * 1e6,
        ticks + skipped
    );
    let verdict = if skipped * 1000 > (ticks + skipped) * SKIPPED_PER_MILLE {
        Verdict::Unfit
    } else if late > LATE_MOST {
        Verdict::Advised
    } else {
        return Finding::fit(subject, found);
    };
    let remedy = "leave it a core that is idle; see the findings below";
    Finding::of(subject, verdict, found, remedy)
}

fn of_rights(rights: &RealTime) -> Vec<Finding> {
    let parts = [
        ("real time", &rights.fifo),
        ("locked memory", &rights.memory),
        ("timer slack", &rights.slack),
    ];
    let one = |(subject, obtained): (&'static str, &Obtained)| match obtained {
        Obtained::Yes => Finding::fit(subject, "granted"),
        Obtained::No { reason, remedy } => Finding::of(
            subject,
            Verdict::Advised,
            format!("not granted: {reason}"),
            remedy,
        ),
    };
    parts.map(one).into()
}

fn cores(cores: usize) -> Finding {
    let subject = "cores";
    if cores >= 2 {
        return Finding::fit(subject, cores);
    }
    let remedy = "a demo needs two: one for each side's loop";
    Finding::of(subject, Verdict::Advised, cores, remedy)
}

/// Of what each core's clock rate is governed by.
fn governor(of_cores: &[String]) -> Finding {
    let subject = "governor";
    let slow = of_cores
        .iter()
        .map(|name| name.trim())
        .find(|name| *name != "performance");
    match (slow, of_cores.is_empty()) {
        (_, true) => Finding::fit(subject, "this host does not scale its clock rate"),
        (None, _) => Finding::fit(subject, "performance"),
        (Some(name), _) => {
            let remedy = "`cpupower frequency-set -g performance`";
            Finding::of(subject, Verdict::Advised, name, remedy)
        }
    }
}

fn clock(source: Option<&str>) -> Finding {
    let subject = "clock source";
    let source = source.map_or("unknown", str::trim);
    // these cost a trap or a bus access a reading
    if ["hpet", "acpi_pm", "jiffies"].contains(&source) {
        let remedy = "boot with a stable tsc; `dmesg | grep -i tsc` names why it is not used";
        return Finding::of(subject, Verdict::Advised, source, remedy);
    }
    Finding::fit(subject, source)
}

fn buffers(rmem_max: Option<&str>) -> Finding {
    let subject = "socket buffers";
    let most = rmem_max.and_then(|text| text.trim().parse::<u64>().ok());
    match most {
        Some(most) if most < BUFFER => {
            let found = format!("at most {} kB", most / 1024);
            let remedy =
                format!("for a relay of many clients: `sysctl net.core.rmem_max={BUFFER}`");
            Finding::of(subject, Verdict::Advised, found, remedy)
        }
        Some(most) => Finding::fit(subject, format_args!("up to {} kB", most / 1024)),
        None => Finding::fit(subject, "unknown"),
    }
}

fn address() -> Finding {
    let subject = "own address";
    match address_for_others() {
        Some(address) => Finding::fit(subject, address),
        None => Finding::of(
            subject,
            Verdict::Advised,
            "no interface for other hosts",
            "a slave here needs --advertise ADDRESS, one that the master's host reaches",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticked(ticks: u64, skipped: u64, late_us: u64) -> TickerReport {
        let mut report = TickerReport {
            ticks,
            skipped,
            ..TickerReport::default()
        };
        report.lateness.p99 = Duration::from_micros(late_us);
        report
    }

    #[test]
    fn a_loop_is_unfit_beyond_one_skipped_tick_in_a_thousand_and_better_rested_when_late() {
        let verdict = |report: &TickerReport| timer(Some(report)).verdict;
        assert_eq!(verdict(&ticked(2997, 3, 80)), Verdict::Fit);
        assert_eq!(verdict(&ticked(2996, 4, 80)), Verdict::Unfit);
        assert_eq!(verdict(&ticked(3000, 0, 501)), Verdict::Advised);
        assert_eq!(timer(None).verdict, Verdict::Unfit);
    }

    #[test]
    fn what_slows_a_host_is_named_with_its_remedy() {
        let of = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            governor(&names)
        };
        assert_eq!(of(&[]).verdict, Verdict::Fit);
        assert_eq!(of(&["performance\n"]).verdict, Verdict::Fit);
        let slow = of(&["performance\n", "powersave\n"]);
        assert_eq!(
            (slow.verdict, slow.found.as_str()),
            (Verdict::Advised, "powersave")
        );
        assert!(slow.remedy.unwrap().contains("cpupower"));
        assert_eq!(clock(Some("tsc\n")).verdict, Verdict::Fit);
        assert_eq!(clock(Some("hpet\n")).verdict, Verdict::Advised);
        assert_eq!(buffers(Some("212992\n")).verdict, Verdict::Advised);
        assert_eq!(buffers(Some("4194304\n")).verdict, Verdict::Fit);
        assert_eq!(
            (cores(1).verdict, cores(2).verdict),
            (Verdict::Advised, Verdict::Fit)
        );
    }
}
