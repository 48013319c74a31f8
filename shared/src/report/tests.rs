//! The document's keys, its nulls, and the table.

mod halves;

use super::*;
use crate::channel::datagram_channel::DatagramChannel;
use crate::channel::peer::Loss;
use crate::metrics::{
    AgeOfInformation, ContactBreaks, ForceMetrics, ForcePeak, PoseError, UpdateCounts,
};
use crate::model::architecture::Architecture;
use crate::model::geometry::{Pose, Vec2};
use crate::model::update::Cause;
use crate::stats::histogram::Histogram;
use crate::stats::session::KindCounts;
use crate::time::Time;
use crate::wire::{DATAGRAM_MAX, Message, Side};
use serde_json::{Value, json};

fn empty() -> RunReport<Value> {
    RunReport::new("demo", json!({ "mode": "recommended" }))
}

/// A report in which every key has a meaning.
fn full() -> RunReport<Value> {
    let mut counts = UpdateCounts::default();
    (0..20_000).for_each(|tick| counts.tick(tick % 2 == 0));
    (0..30).for_each(|_| counts.sent(Cause::Deadband));
    counts.sent(Cause::ContactLost);
    let mut force = ForceMetrics::default();
    force.push(Vec2::new(2.0, 1.0), Vec2::new(1.9, 1.1));
    let mut peak = ForcePeak::default();
    peak.push(Vec2::new(2.0, 0.0));
    peak.push(Vec2::new(2.5, 0.0));
    let mut breaks = ContactBreaks::default();
    for touch in [true, false, true, false] {
        breaks.push(touch);
    }
    let mut pose = PoseError::default();
    pose.push(&Pose::new(0.003, 0.004, 0.01), &Pose::default());
    let mut age = AgeOfInformation::default();
    age.push(Time::from_millis(150), Time::from_millis(40));

    let mut report = empty();
    report.seed = Some(1);
    report.duration_s = 20.0.into();
    report.ending = Some(Ending::Finished.name());
    report.architecture = ArchitectureReport::new(Architecture::Tdpa, Some(0.0149));
    report.pushes = PushesReport::new(2, &breaks);
    let mut repeated = UpdateCounts::default();
    (0..20).for_each(|_| repeated.sent(Cause::Deadband));
    report.updates.sent = SentUpdates::new(&counts, &repeated);
    report.updates.received = ReceivedUpdates {
        applied: Some(30),
        dropped: Some(named([("stale", 1)])),
        age_ms: (&age).into(),
    };
    let mut kinds = KindCounts {
        commands: 2000,
        heartbeats: 3,
        ..KindCounts::default()
    };
    report.messages.up = MessagesReport::up(&kinds, 20.0);
    kinds = KindCounts {
        updates: 51,
        scenes: 600,
        heartbeats: 390,
        ..KindCounts::default()
    };
    report.messages.down = MessagesReport::down(&kinds, 20, 20.0);
    report.wire.up = WireReport::new(2100, 336_000, 28, 20.0);
    report.wire.down = WireReport::new(1100, 110_000, 28, 20.0);
    report.force = ForceReport {
        errors: force.summary(),
        truth: TrueForce {
            pmse_true: 0.012.into(),
            relative_error_true: 0.09.into(),
            contact_true_s: 9.5.into(),
        },
        hand: (&peak).into(),
    };
    report.model.mass_kg = EstimateReport::new(0.707, 0.7);
    report.model.damping_ns_per_m = EstimateReport::new(3.03, 3.0);
    report.model.friction_n = EstimateReport::new(2.06, 2.0601);
    report.pose = PoseReport::from(&pose);
    report.tool = ToolReport {
        held_s: 0.25.into(),
        force_peak_n: 15.02.into(),
        work_j: 1.5.into(),
        hand_work_j: 1.25.into(),
        energy_held_s: 0.125.into(),
        sensor_gain: 1.08.into(),
    };
    report.passivity = PassivityReport {
        energy_injected_j: 0.0.into(),
        observer_min_j: (-0.2e-3).into(),
        hand_work_j: 1.3.into(),
    };
    report.link.rtt_ms = DelayReport {
        p50: 100.2.into(),
        p99: 117.9.into(),
    };
    let mut delays = Histogram::default();
    delays.record(std::time::Duration::from_millis(16));
    report.link.playout_delay_ms = DelayReport::from(&delays);
    (report.link.loss_up, report.link.loss_down) = (0.01.into(), 0.012.into());
    (report.link.unsent_up, report.link.unsent_down) = (Some(0), Some(17));
    report.emulation.up = EmulationReport {
        released: Some(2100),
        late_us: LateReport {
            p50: 61.0.into(),
            p99: 180.0.into(),
            max: 402.0.into(),
        },
        degraded: Some(false),
    };
    report.emulation.down = EmulationReport {
        degraded: Some(true),
        ..report.emulation.up.clone()
    };
    report.haptic_loop = LoopReport {
        ticks: Some(20_000),
        skipped: Some(2),
        cpu_us: quantiles(3.1),
        lateness_us: quantiles(12.0),
    };
    report.slave_loop = report.haptic_loop;
    report.drops = Some(named([("datagrams_malformed", 0)]));
    report
}

fn quantiles(p50: f64) -> QuantilesReport {
    QuantilesReport {
        p50: p50.into(),
        p99: (p50 * 4.0).into(),
        p999: (p50 * 9.0).into(),
    }
}

/// Every path of the document; what hangs under the names of counts is left out.
fn paths(value: &Value, prefix: &str, into: &mut Vec<String>) {
    let open = [
        "updates.by_cause",
        "updates.repeated_by_cause",
        "updates.dropped",
        "drops",
        "configuration",
    ];
    match value {
        Value::Object(keys) if !open.contains(&prefix) => {
            for (key, value) in keys {
                let dot = if prefix.is_empty() { "" } else { "." };
                paths(value, &format!("{prefix}{dot}{key}"), into);
            }
        }
        _ => into.push(prefix.to_owned()),
    }
}

const REQUIRED: &str = "version command seed duration_s ending configuration drops \
    architecture.name architecture.round_trip_ms \
    pushes.completed pushes.contact_breaks_per_push \
    updates.sent updates.rate_hz updates.contact_rate_hz updates.by_cause updates.applied \
    updates.repeated updates.repeated_by_cause \
    updates.dropped updates.age_ms.mean updates.age_ms.max \
    messages.up.commands messages.up.updates messages.up.repeats messages.up.scenes \
    messages.up.tools messages.up.heartbeats messages.up.rate_hz \
    messages.down.commands messages.down.updates messages.down.repeats messages.down.scenes \
    messages.down.tools messages.down.heartbeats messages.down.rate_hz \
    wire.up.datagrams wire.up.bytes wire.up.rate_hz wire.up.bits_per_s wire.up.header_bytes \
    wire.down.datagrams wire.down.bytes wire.down.rate_hz wire.down.bits_per_s \
    wire.down.header_bytes \
    force.samples force.contact_samples force.pmse force.pmse_x force.pmse_y \
    force.pmse_magnitude force.relative_error force.error_rms_n force.jnd7_share \
    force.jnd10_share force.pmse_true force.relative_error_true force.contact_true_s \
    force.largest_n force.largest_step_n \
    model.mass_kg.estimate model.mass_kg.truth \
    model.damping_ns_per_m.estimate model.damping_ns_per_m.truth \
    model.friction_n.estimate model.friction_n.truth \
    pose.position_rms_m pose.position_max_m pose.angle_rms_rad pose.angle_max_rad \
    tool.held_s tool.force_peak_n tool.work_j tool.hand_work_j tool.energy_held_s \
    tool.sensor_gain \
    passivity.energy_injected_j passivity.observer_min_j passivity.hand_work_j \
    link.rtt_ms.p50 link.rtt_ms.p99 link.loss_up link.loss_down link.unsent_up link.unsent_down \
    emulation.up.released emulation.up.late_us.p50 emulation.up.late_us.p99 \
    emulation.up.late_us.max emulation.up.degraded \
    emulation.down.released emulation.down.late_us.p50 emulation.down.late_us.p99 \
    emulation.down.late_us.max emulation.down.degraded \
    link.playout_delay_ms.p50 link.playout_delay_ms.p99 \
    haptic_loop.ticks haptic_loop.skipped \
    haptic_loop.cpu_us.p50 haptic_loop.cpu_us.p99 haptic_loop.cpu_us.p999 \
    haptic_loop.lateness_us.p50 haptic_loop.lateness_us.p99 haptic_loop.lateness_us.p999 \
    slave_loop.ticks slave_loop.skipped \
    slave_loop.cpu_us.p50 slave_loop.cpu_us.p99 slave_loop.cpu_us.p999 \
    slave_loop.lateness_us.p50 slave_loop.lateness_us.p99 slave_loop.lateness_us.p999";

#[test]
fn an_empty_report_and_a_full_one_have_the_same_keys_to_the_letter() {
    let mut expected: Vec<_> = REQUIRED.split_whitespace().map(str::to_owned).collect();
    expected.sort();
    for report in [empty(), full()] {
        let mut found = Vec::new();
        paths(&serde_json::to_value(&report).unwrap(), "", &mut found);
        found.sort();
        assert_eq!(found, expected);
    }
}

#[test]
fn a_key_without_meaning_is_null_and_neither_missing_nor_zero() {
    let document = serde_json::to_value(empty()).unwrap();
    for path in REQUIRED.split_whitespace() {
        let value = path.split('.').fold(&document, |value, key| &value[key]);
        let meant = ["version", "command", "configuration"].contains(&path);
        assert_eq!(value.is_null(), !meant, "{path}");
    }
}

#[test]
fn every_key_is_filled_by_a_run_in_which_it_has_a_meaning() {
    let document = serde_json::to_value(full()).unwrap();
    let other_way = [
        "messages.up.updates",
        "messages.up.repeats",
        "messages.up.scenes",
        "messages.up.tools",
        "messages.down.commands",
    ];
    for path in REQUIRED.split_whitespace() {
        let value = path.split('.').fold(&document, |value, key| &value[key]);
        assert_eq!(value.is_null(), other_way.contains(&path), "{path}");
    }
}

#[test]
fn values_stand_under_their_keys() {
    let document = serde_json::to_value(full()).unwrap();
    assert_eq!(document["updates"]["sent"], 31);
    assert_eq!(document["updates"]["rate_hz"], 1.55);
    assert_eq!(document["updates"]["contact_rate_hz"], 3.1);
    assert_eq!(
        document["updates"]["by_cause"],
        json!({
            "deadband": 30, "timer": 0, "master_only_contact": 0,
            "slave_only_contact": 0, "contact_lost": 1, "every_sample": 0,
            "elsewhere": 0
        })
    );
    assert_eq!(document["updates"]["dropped"], json!({ "stale": 1 }));
    assert_eq!(document["updates"]["repeated_by_cause"]["deadband"], 20);
    // 2000 commands and 3 heartbeats in 20 s
    assert_eq!(document["messages"]["up"]["rate_hz"], 100.15);
    assert_eq!(document["messages"]["down"]["rate_hz"], 52.05);
    assert_eq!(document["updates"]["age_ms"]["max"], 110.0);
    // 2100 datagrams of 160 bytes in 20 s: 105 a second, 188 bytes each with headers
    assert_eq!(document["wire"]["up"]["rate_hz"], 105.0);
    assert_eq!(document["wire"]["up"]["bits_per_s"], 157_920.0);
    assert_eq!(document["pose"]["position_rms_m"], 0.005);
    assert_eq!(document["force"]["largest_step_n"], 0.5);
    assert_eq!(document["pushes"]["contact_breaks_per_push"], 1.0);
    assert_eq!(document["configuration"]["mode"], "recommended");
}

#[test]
fn numbers_that_are_not_finite_become_null() {
    let mut report = full();
    report.duration_s = f64::NAN.into();
    report.model.mass_kg = EstimateReport::new(f64::INFINITY, 0.7);
    report.wire.up = WireReport::new(1, 1, 28, 0.0);
    let document = serde_json::to_value(&report).unwrap();
    assert!(document["duration_s"].is_null());
    assert!(document["model"]["mass_kg"]["estimate"].is_null());
    assert!(document["wire"]["up"]["bits_per_s"].is_null());
    let shown = report.to_string();
    let nonsense = ["NaN", "inf", "-inf"];
    let mut words = shown.split_whitespace();
    assert!(words.all(|word| !nonsense.contains(&word)), "{shown}");
}

#[test]
fn what_was_felt_is_shown_where_that_was_the_tool_and_the_tools_messages_where_there_were_any() {
    let mut report = full();
    report.architecture = ArchitectureReport::new(Architecture::Mmt, None);
    assert!(!report.to_string().contains("Felt"));
    let kinds = KindCounts {
        updates: 33,
        tools: 4542,
        ..KindCounts::default()
    };
    report.messages.down = MessagesReport::down(&kinds, 0, 20.0);
    let row = "  messages down             228.8 /s           33 updates         4542 of the tool   0 heartbeats";
    let shown = report.to_string();
    assert!(shown.lines().any(|line| line == row), "{shown}");
}

#[test]
fn the_table_shows_what_is_known_and_leaves_out_what_is_not() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(empty().to_string(), format!("mmt demo {version}\n"));
    let mut report = empty();
    report.model.mass_kg = EstimateReport::new(0.707, None);
    assert_eq!(
        report.to_string(),
        format!(
            "mmt demo {version}\n\nModel\n  mass m                    0.707 kg           -                  -\n"
        )
    );
}

#[test]
fn no_name_that_a_peer_made_up_steers_a_terminal_or_forges_a_line() {
    let shown = |name: &str| {
        let mut report = full();
        let counts = || Some(named([(name, 3)]));
        report.architecture.name = Some(name.to_owned());
        report.updates.sent.by_cause = counts();
        report.updates.sent.repeated_by_cause = counts();
        report.updates.received.dropped = counts();
        report.drops = counts();
        format!("{report}{}", Brief(&report))
    };
    let hostile = shown("timer\u{1b}[2J\n  completed   9\u{202e}");
    let unfit = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
    assert!(!hostile.contains(unfit), "{hostile:?}");
    let lines = shown("timer").lines().count();
    assert_eq!(hostile.lines().count(), lines, "{hostile}");
    assert_eq!(
        hostile.matches("timer?[2J?  completed").count(),
        5,
        "{hostile}"
    );
}

#[test]
fn the_brief_is_a_sentence_and_ten_lines_and_a_spoilt_run_reports_that_first() {
    let mut sound = full();
    sound.passivity.energy_injected_j = 0.002.into();
    for way in [&mut sound.emulation.up, &mut sound.emulation.down] {
        way.degraded = Some(false);
    }
    let shown = Brief(&sound).to_string();
    let lines: Vec<&str> = shown.lines().collect();
    assert!(
        lines[2].starts_with("The force that was felt was off by "),
        "{shown}"
    );
    let rows = lines.iter().filter(|line| line.starts_with("  ")).count();
    assert_eq!(rows, 10, "{shown}");
    assert!(
        lines
            .iter()
            .all(|line| line.len() <= 110 && line.is_ascii()),
        "{shown}"
    );
    sound.passivity.energy_injected_j = 0.0.into();
    sound.link.loss_up = 0.0.into();
    let shown = Brief(&sound).to_string();
    assert!(!shown.contains("energy"), "{shown}");
    assert!(
        !shown.contains("up 0.0 %") && shown.contains("down 1.2 %"),
        "{shown}"
    );
    let mut slow = full();
    slow.slave_loop.skipped = slow.slave_loop.ticks;
    let mut failed = slow.clone();
    failed.ending = Some("failed");
    for (report, verdict) in [
        (&slow, "This host skipped 50 % of the ticks"),
        (&failed, "The session failed"),
    ] {
        let shown = Brief(report).to_string();
        assert!(shown.contains(verdict), "{shown}");
    }
}

#[test]
fn the_table_of_a_full_report_is_aligned_and_stays_within_100_columns() {
    let shown = full().to_string();
    let version = env!("CARGO_PKG_VERSION");
    assert!(shown.starts_with(&format!("mmt demo {version}, seed 1, 20.0 s, finished\n")));
    for row in [
        "  rate                      1.55 /s            3.10 /s of contact",
        "  for deadband              30",
        "  repeats, deadband         20",
        "  messages up               100.2 /s           2000 commands      3 heartbeats",
        "  round trip as felt        14.9 ms",
        "  against the true force    relative 0.0900    PMSE 0.0120",
        "  mass m                    0.707 kg           truth 0.700 kg     error 1.0 %",
        "  loss                      up 1.0 %           down 1.2 %",
        "  unsent                    up 0               down 17",
        "  datagrams up              2100               105.0 /s           336000 B           157.9 kbit/s",
    ] {
        assert!(shown.lines().any(|line| line == row), "{row}\n{shown}");
    }
    for line in shown.lines() {
        assert!(line.len() <= 100 && line.is_ascii(), "{line}");
    }
}
