//! Texts to begin with, and the plan of a small sweep.
#![allow(
    clippy::disallowed_types,
    reason = "to make a plan tries every world of it: it is made once"
)]

use std::sync::OnceLock;

use mmt_lab::sweep::{Plan, RowResult, part_header};

/// A recorded path for words that name one.
pub(in crate::fuzz) const PATH: &str =
    "# mmt netem path 1\nat_ns,delay_ns\n0,40000000\n10000000,\n20000000,50000000\n";
/// A measured distribution.
pub(in crate::fuzz) const CDF: &str = "40 0\n50, 0.5\n# tail\n100; 1\n";
/// A table of iproute2.
pub(in crate::fuzz) const TABLE: &str = "# a comment\n -8192 0\n 8192 16384\n";

fn texts(of: &[&str]) -> Vec<Vec<u8>> {
    of.iter().map(|text| text.as_bytes().to_vec()).collect()
}

pub(in crate::fuzz) fn inverse3() -> Vec<Vec<u8>> {
    let frame = |x: &str, down: &str| {
        format!(
            "{{\"inverse3\":[{{\"device_id\":\"049D\",\"state\":{{\"cursor_position\":{{\"x\":{x},\"y\":-0.12,\"z\":0.15}},\
             \"cursor_velocity\":{{\"x\":0,\"y\":0,\"z\":0}}}}}}],\
             \"wireless_verse_grip\":[{{\"state\":{{\"buttons\":{{\"a\":{down}}}}}}}]}}"
        )
    };
    let held = [
        frame("0", "false"),
        frame("0", "true"),
        frame("0.001", "true"),
        frame("0.002", "false"),
    ]
    .join("\n");
    let away = [
        frame("0", "false"),
        frame("0", "true"),
        "{}".to_owned(),
        frame("0.5", "true"),
    ]
    .join("\n");
    vec![
        held.into_bytes(),
        away.into_bytes(),
        b"{\"inverse3\":[{\"device_id\":\"1\"}]}".to_vec(),
    ]
}

pub(in crate::fuzz) fn pages() -> Vec<Vec<u8>> {
    texts(&[
        "{\"clock\":1000}\n{\"press\":[1000,0.1,0.2]}\n{\"move\":[[1008,0.1,0.2],[1016,0.12,0.2]]}\n\"release\"",
        "{\"press\":[5,0,0]}\n{\"pause\":true}\n{\"move\":[[6,1,1]]}\n{\"pause\":false}\n{\"drive\":\"scripted\"}",
        "\"take\"\n\"stop\"\n\"clear\"\n\"leave\"\n\"end\"",
        "{\"network\":{\"up\":\"delay 5ms\",\"down\":\"none\"}}\n{\"restart\":{\"mode\":\"paper\",\"mass_kg\":2.5}}\n{\"study\":{\"answer\":7}}\n{\"study\":\"agree\"}",
    ])
}

pub(in crate::fuzz) fn pairings() -> Vec<Vec<u8>> {
    let (pin, token) = ("0123456789abcdef".repeat(4), "fedcba9876543210".repeat(4));
    let whole = |address: &str| format!("mmt://{address}?pin={pin}&token={token}").into_bytes();
    let mut seeds: Vec<_> = [
        "192.0.2.1:4433",
        "[2001:db8::1]:1",
        "slave.example.org:65535",
    ]
    .map(whole)
    .to_vec();
    seeds.extend([pin.clone().into_bytes(), token.as_bytes()[..32].to_vec()]);
    seeds.extend(texts(&["localhost:4433", "[::1]:80", "10.0.0.1:1"]));
    seeds
}

pub(in crate::fuzz) fn words() -> Vec<Vec<u8>> {
    texts(&[
        "deadband 10%",
        "hybrid 10% 150ms",
        "timer 150ms",
        "every-sample",
        "dis 0.3N 1000ms",
        "useful 10% 150ms",
        "adaptive 10% 50ms",
        "none",
        "10ms 30ms",
        "2.5",
        "3/8",
    ])
}

pub(in crate::fuzz) fn link_words() -> Vec<Vec<u8>> {
    let mut seeds = texts(&[
        "delay 50ms 5ms 25% loss 1%",
        "delay 50ms 5ms tau 100ms distribution pareto loss gemodel 1% 10% 70% 0.1%",
        "delay cdf 40ms@0%,50ms@90%,200ms@100% order free reorder 1% gap 5 duplicate 1% corrupt 0.1% mtu 1400",
        "rate 1mbit 28 53 5 queue 64kb 100p 50ms drop-head codel 5ms 100ms cross 500kbit poisson 1200 ecn limit 1000 64mb",
        "outage 1s for 20ms every 5s outage 2s for 1ms slot 10ms 20ms packets 5 bytes 3000 seed 7",
        "loss state 1% 10% 70% 20% 0.1% delay 10ms; at 1s over 2s delay 100ms loss 5%; at 5s none; loop 10s; then rate 2mbit queue 20p; then delay 5ms",
        "loss burst 1% 20ms 90% 0.1%",
        "loss list 3,17,100-120",
        "loss every 7",
        "trace path up",
        "delay cdf cdf",
        "rate trace opportunities queue 10p",
        "delay 50ms 10ms distribution table table",
        "none",
    ]);
    seeds.extend(
        mmt_netem::presets::PRESETS
            .iter()
            .map(|preset| preset.words.as_bytes().to_vec()),
    );
    seeds
}

/// Round trips as irtt writes them.
const IRTT: &str = r#"{"round_trips":[
{"seqno":0,"lost":"false","timestamps":{"client":{"send":{"wall":1707277440772833721,"monotonic":22211105}}},"delay":{"receive":-10470921269,"rtt":17291970,"send":10488213200}},
{"seqno":1,"lost":"true_down","timestamps":{"client":{"send":{"wall":1707277441773479264,"monotonic":1022856655}}}},
{"seqno":2,"lost":"true","timestamps":{"client":{"send":{"monotonic":1522856655}}}},
{"seqno":3,"lost":"false","timestamps":{"client":{"send":{"monotonic":2022029432}}},"delay":{"receive":-10470373417,"rtt":16064572,"send":10486437967}}]}"#;

const PING: &str = "PING 192.0.2.1 (192.0.2.1) 56(84) bytes of data.
[1700182800.100000] 64 bytes from 192.0.2.1: icmp_seq=1 ttl=63 time=60.0 ms
[1700182801.100000] 64 bytes from 192.0.2.1: icmp_seq=2 ttl=63 time=60.0 ms
[1700182804.140000] 64 bytes from 192.0.2.1: icmp_seq=5 ttl=63 time=100 ms

--- 192.0.2.1 ping statistics ---
";

pub(in crate::fuzz) fn traces() -> Vec<Vec<u8>> {
    let lens = "timestamp,rtt,uplink,downlink\n1705744800616897349,0,0,-1\n1705744800626565141,120.126123,72.439368,47.68675\n";
    let record = String::from_utf8(super::packets::packet_records().swap_remove(0)).unwrap();
    let of = [
        IRTT,
        PING,
        lens,
        "timestamp,rtt\n1705744800.533641,91.8\n1705744800.55492,96.5\n",
        PATH,
        &record,
    ];
    let asked = |text: &str, direction: u8| [&[direction], text.as_bytes()].concat();
    of.iter()
        .flat_map(|text| [0, 1, 2].map(|direction| asked(text, direction)))
        .collect()
}

pub(in crate::fuzz) fn opportunities() -> Vec<Vec<u8>> {
    texts(&["3\n7\n7\n20\n", "# mahimahi\n0\n0\n1\n", "1000000000000"])
}

pub(in crate::fuzz) fn distributions() -> Vec<Vec<u8>> {
    texts(&[
        CDF,
        TABLE,
        "30\n10\n20\n",
        "1 0\n1 1\n",
        "0\n0.5\n3600000\n",
    ])
}

pub(in crate::fuzz) fn pushes() -> Vec<Vec<u8>> {
    let push = "100 200 8 1 0 0 0\n110 200 8 1 0 0 0\n3\n1000.00 0.5 0.25\n1000.01 0.5 0.25\n1000.02 1.5 1.25\n2\n\
                1000.00 95 230 8 0.70710678118654752 0 0 0.70710678118654752\n1000.03 96 230 8 0.70710678118654752 0 0 0.70710678118654752\n";
    let strong = push.replace("1.5 1.25", "-1.5 -5.25");
    vec![
        format!("1\n{push}").into_bytes(),
        format!("2\n{push}{strong}").into_bytes(),
        format!("3\n{strong}{strong}{push}").into_bytes(),
    ]
}

pub(in crate::fuzz) fn paths() -> Vec<Vec<u8>> {
    texts(&[
        "t_s,x_m,y_m\n0,0,0\n0.5,0.1,0\n1.25,0.2,-0.1\n",
        "t_s,x_m,y_m\n-3,100,-100\n2700000,0,0",
    ])
}

pub(in crate::fuzz) fn identities() -> Vec<Vec<u8>> {
    texts(&[include_str!("../../../fuzz/identity")])
}

/// The first byte is the program.
pub(in crate::fuzz) fn configs() -> Vec<Vec<u8>> {
    let slave = "mode = \"paper\"\nseed = 3\n[environment]\nmass_kg = 1.2\nfriction_coefficient = 0.4\n[trigger]\nscheme = \"deadband 5%\"\n";
    let demo = "seed = 1\nup = \"delay 20ms 2ms loss 1%\"\nsamples_per_command = 5\n[slave.playout]\ndelay_ms = 21.0\n[slave.sensing.vision]\nrate_hz = 10.0\n";
    let of = [
        "",
        slave,
        demo,
        "stretch_max = 2.0\nrepeat_samples = 1\n[operator]\npush_m = 0.2\n[operator.hand]\nmass_kg = 0.5\n",
    ];
    let asked = |text: &str, program: u8| [&[program], text.as_bytes()].concat();
    of.iter()
        .flat_map(|text| [0, 1, 2, 3].map(|program| asked(text, program)))
        .collect()
}

const PLAN: &str = "duration_s = 0.2\nseeds = { first = 3, count = 2 }\nstart = \"live\"\n[base]\nslave.playout.delay_ms = 21.0\n[[axis]]\n\
    key = \"slave.trigger.scheme\"\nvalues = [\"deadband 5%\", \"every-sample\"]\n";

pub(in crate::fuzz) fn plans() -> Vec<Vec<u8>> {
    let both = "duration_s = 1\nseeds = { count = 1 }\n[[axis]]\nkeys = [\"up\", \"down\"]\nvalues = [[\"none\", \"none\"], [\"delay 50ms\", \"loss 1%\"]]\n\
        [change]\nafter_pushes = 1\ncontact_s = 1.0\nto = { friction_coefficient = 0.5 }\n";
    texts(&[
        PLAN,
        both,
        "duration_s = 1\nseeds = { count = 1 }\nstart = \"paper-experiment\"\n",
    ])
}

pub(in crate::fuzz) fn scenes() -> Vec<Vec<u8>> {
    texts(&[
        include_str!("../../../../docs/scenes/corner.toml"),
        include_str!("../../../../docs/scenes/row.toml"),
        "",
    ])
}

/// The first byte is the kind of device.
pub(in crate::fuzz) fn device_files() -> Vec<Vec<u8>> {
    let all = "axes = [\"x\", \"-z\"]\ncentre_m = [0.0, 0.1, 0.0]\nscale = 2.0\nworkspace_m = 0.3\nspeed_max_m_per_s = 3.0\nforce_max_n = 5.0\nstep_max_n = 1.0\n\
        stiffness_n_per_m = 400.0\nstiffness_max_n_per_m = 2000.0\nplayout_ms = 3.0\nsilence_ms = 30.0\nbutton = 1\n";
    let of = [
        (0, all),
        (1, "dialect = \"values\"\nforce_max_n = 4"),
        (2, "version = \"2\"\nhold = \"rest\"\ntorque_max_nm = 0.2"),
        (0, ""),
    ];
    of.map(|(kind, text)| [&[kind], text.as_bytes()].concat())
        .to_vec()
}

/// A sweep of four rows.
pub(in crate::fuzz) fn small_plan() -> Plan {
    static SMALL: OnceLock<Plan> = OnceLock::new();
    SMALL.get_or_init(|| Plan::parse(PLAN).unwrap()).clone()
}

pub(in crate::fuzz) fn sweep_parts() -> Vec<Vec<u8>> {
    let plan = small_plan();
    let rows = (1..=plan.rows()).filter_map(|number| {
        let row = plan.row(number)?;
        let measured = row.trial.run().ok()?;
        Some(RowResult::of(&row, &measured).line())
    });
    let rows: Vec<Vec<u8>> = rows.collect();
    let part = |rows: &[Vec<u8>]| [part_header(), rows.concat()].concat();
    vec![part(&rows), part(&rows[1..2]), part(&[])]
}
