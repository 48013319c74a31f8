//! What a process has of the system's, and whether that grows.

use mmt_lab::statistics::Slope;
use serde::Serialize;

/// Samples of the first minutes show no growth: a process that is new takes what it needs, h.
const WARM_UP_H: f64 = 5.0 / 60.0;
/// A slope is judged from so long a time on, h.
const JUDGED_H: f64 = 0.5;
/// Memory may grow by so much, kB/h, beyond three standard errors.
const SLOPE_MAX_KB_PER_H: f64 = 1024.0;
/// Halves of fewer samples than this are not compared.
const HALF_MIN: usize = 8;

/// What a process has at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Usage {
    /// Resident memory, kB.
    memory_kb: u64,
    /// Open files and sockets.
    descriptors: u64,
    threads: u64,
}

impl Usage {
    /// Of a running process; none if it has ended.
    pub(super) fn of(pid: u32) -> Option<Self> {
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
        let entries =
            |of| Some(std::fs::read_dir(format!("/proc/{pid}/{of}")).ok()?.count() as u64);
        Some(Self {
            memory_kb: resident_kb(&status)?,
            descriptors: entries("fd")?,
            threads: entries("task")?,
        })
    }

    fn larger(self, other: Self) -> Self {
        Self {
            memory_kb: self.memory_kb.max(other.memory_kb),
            descriptors: self.descriptors.max(other.descriptors),
            threads: self.threads.max(other.threads),
        }
    }
}

/// `VmRSS` of proc(5); one that has ended and is not waited for has none.
fn resident_kb(status: &str) -> Option<u64> {
    let mut lines = status.lines();
    let rest = lines.find_map(|line| line.strip_prefix("VmRSS:"))?;
    rest.trim().strip_suffix(" kB")?.parse().ok()
}

/// What the processes of one kind had in the course of a soak.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// Most of each at any time.
    most: Usage,
    /// Without a session, with when, h.
    idle: Vec<(f64, Usage)>,
}

impl Course {
    /// At any moment.
    pub(super) fn sample(&mut self, usage: Usage) {
        self.most = self.most.larger(usage);
    }

    /// At a moment when no session has been there for a while.
    pub(super) fn sample_idle(&mut self, at_h: f64, usage: Usage) {
        self.sample(usage);
        self.idle.push((at_h, usage));
    }

    pub(super) fn row(&self, process: &'static str) -> Row {
        let idle = |of: Option<&(f64, Usage)>| of.map(|(_, usage)| *usage);
        Row {
            process,
            first: idle(self.idle.first()),
            last: idle(self.idle.last()),
            most: self.most,
            slope: self.slope(),
            grows: self.grows(),
        }
    }

    /// How memory without a session grows after the first minutes, kB/h.
    fn slope(&self) -> Option<Slope> {
        let points = self.idle.iter().filter(|(at_h, _)| *at_h >= WARM_UP_H);
        let points: Vec<_> = points
            .map(|(at_h, usage)| (*at_h, usage.memory_kb as f64))
            .collect();
        Slope::of(&points)
    }

    /// What grows without bound.
    fn grows(&self) -> Vec<&'static str> {
        let until_h = self.idle.last().map_or(0.0, |(at_h, _)| *at_h);
        let slope = self.slope().filter(|_| until_h - WARM_UP_H >= JUDGED_H);
        let memory =
            slope.is_some_and(|slope| slope.value - 3.0 * slope.error > SLOPE_MAX_KB_PER_H);
        [
            ("memory", memory),
            ("descriptors", self.is_above(|usage| usage.descriptors)),
            ("threads", self.is_above(|usage| usage.threads)),
        ]
        .into_iter()
        .filter_map(|(name, grows)| grows.then_some(name))
        .collect()
    }

    /// Whether the least of the second half is more than the most of the first.
    fn is_above(&self, count: impl Fn(&Usage) -> u64) -> bool {
        let (first, second) = self.idle.split_at(self.idle.len() / 2);
        let most = first.iter().map(|(_, usage)| count(usage)).max();
        let least = second.iter().map(|(_, usage)| count(usage)).min();
        first.len() >= HALF_MIN && least > most
    }
}

/// The processes of one kind in a report.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) process: &'static str,
    /// Without a session; none of processes that live for a cycle only.
    pub(super) first: Option<Usage>,
    pub(super) last: Option<Usage>,
    pub(super) most: Usage,
    /// Of memory without a session after the first minutes, kB/h.
    pub(super) slope: Option<Slope>,
    /// What grows beyond its bound.
    pub(super) grows: Vec<&'static str>,
}

impl Row {
    /// The names of the columns.
    pub(super) fn heading() -> String {
        let names = ["memory kB", "descriptors", "threads"];
        let of = names.map(|name| format!("{:>27}", format!("{name} first last most")));
        format!("{:<24}{}", "process", of.join("  "))
    }

    /// A line of the table.
    pub(super) fn line(&self) -> String {
        let columns: [fn(&Usage) -> u64; 3] = [
            |usage| usage.memory_kb,
            |usage| usage.descriptors,
            |usage| usage.threads,
        ];
        let columns = columns.map(|of| {
            let shown = |usage: Option<Usage>| {
                usage.map_or_else(|| "-".to_owned(), |usage| of(&usage).to_string())
            };
            let [first, last] = [self.first, self.last].map(shown);
            format!("{:>27}", format!("{first} {last} {}", of(&self.most)))
        });
        format!("{:<24}{}", self.process, columns.join("  "))
    }

    /// How memory grows, where there are enough samples.
    pub(super) fn slope_line(&self) -> Option<String> {
        let Slope { n, value, error } = self.slope?;
        Some(format!(
            "  memory grows by {value:.0} kB/h, standard error {error:.0}, by {n} samples"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(values: impl IntoIterator<Item = (f64, u64, u64)>) -> Course {
        let mut course = Course::default();
        for (at_h, memory_kb, descriptors) in values {
            let usage = Usage {
                memory_kb,
                descriptors,
                threads: 5,
            };
            course.sample_idle(at_h, usage);
        }
        course
    }

    #[test]
    fn the_resident_memory_of_a_process_is_read_and_of_one_that_has_ended_there_is_none() {
        assert_eq!(
            resident_kb("Name:\tmmt\nVmRSS:\t   11240 kB\n"),
            Some(11_240)
        );
        assert_eq!(resident_kb("Name:\tmmt\nState:\tZ (zombie)\n"), None);
        let own = Usage::of(std::process::id()).unwrap();
        assert!(own.memory_kb > 100 && own.descriptors > 2 && own.threads > 0);
        assert_eq!(Usage::of(u32::MAX), None);
    }

    #[test]
    fn memory_that_grows_by_two_megabytes_an_hour_grows_and_noise_does_not() {
        let noise = |k: u32| u64::from(k * 7919 % 13) * 100;
        let of = |slope: u64| {
            let of = |k: u32| {
                (
                    f64::from(k) / 60.0,
                    20_000 + noise(k) + slope * u64::from(k) / 60,
                    9,
                )
            };
            course((0..90).map(of))
        };
        assert_eq!(of(0).grows(), [""; 0]);
        assert_eq!(of(2048).grows(), ["memory"]);
        let slope = of(2048).slope().unwrap();
        assert!(
            (slope.value - 2048.0).abs() < 3.0 * slope.error,
            "{slope:?}"
        );
        // too short a time shows nothing
        let short = course((0..20).map(|k| (f64::from(k) / 60.0, 20_000 + 1000 * k as u64, 9)));
        assert_eq!(short.grows(), [""; 0]);
    }

    #[test]
    fn descriptors_grow_where_the_later_half_never_comes_down_to_the_earlier_one() {
        let of = |count: fn(u64) -> u64| course((0..20).map(|k| (k as f64 / 60.0, 1, count(k))));
        assert_eq!(of(|k| 9 + k % 5).grows(), [""; 0]);
        assert_eq!(of(|k| 9 + k / 2).grows(), ["descriptors"]);
    }
}
