//! What the two halves of a session make together, and what nobody knows of one that died.

use super::*;

/// Halves of a session in which the master received an update less than the slave sent, and each dropped something.
fn halves() -> (MasterSession<u8>, SlaveSession<u8>) {
    let session = |sent, received| SessionStats {
        sent,
        received,
        drops: named([("datagrams_malformed", 1)]),
        ..SessionStats::default()
    };
    let down = |updates| MessagesReport {
        updates: Some(updates),
        ..MessagesReport::default()
    };
    let up = |commands| MessagesReport {
        commands: Some(commands),
        ..MessagesReport::default()
    };
    let master = MasterHalf {
        session: session(up(2000), down(233)),
        ..MasterHalf::default()
    };
    let mut slave = SlaveHalf {
        session: session(down(234), up(1990)),
        ..SlaveHalf::default()
    };
    (slave.updates.sent, slave.updates.repeated) = (Some(84), Some(150));
    let report = |own, other, configuration| SessionReport {
        seed: 1,
        duration_s: 20.0,
        ending: Ending::Finished,
        own,
        other,
        configuration,
    };
    let theirs = (Some(slave.clone()), Some(master.clone()));
    let of_slave = SessionReport {
        seed: 1,
        duration_s: 20.5,
        ending: Ending::Finished,
        own: slave,
        other: theirs.1,
        configuration: 2,
    };
    (report(master, theirs.0, 1), of_slave)
}

#[test]
fn in_a_demo_each_direction_is_counted_where_it_is_sent() {
    let (master, slave) = halves();
    let report = RunReport::of_both(master, Some(slave));
    let (messages, updates) = (&report.messages, &report.updates.sent);
    assert_eq!(messages.up.commands, Some(2000));
    let sent = updates
        .sent
        .zip(updates.repeated)
        .map(|(new, again)| new + again);
    assert_eq!(messages.down.updates, sent);
    let drops = [
        ("master_datagrams_malformed", 1),
        ("slave_datagrams_malformed", 1),
    ];
    assert_eq!(report.drops, Some(named(drops)));
    let both = Both {
        master: 1,
        slave: Some(2),
    };
    assert_eq!((report.command, report.configuration), ("demo", both));
}

#[test]
fn an_end_reports_what_it_sent_and_received_itself_and_takes_the_rest_from_the_others_farewell() {
    let (master, slave) = halves();
    let of_master = RunReport::from(master.clone());
    let messages = &of_master.messages;
    assert_eq!(
        (messages.up.commands, messages.down.updates),
        (Some(2000), Some(233))
    );
    assert_eq!(of_master.updates.sent.sent, Some(84), "the slave's");
    assert_eq!(
        (of_master.command, of_master.duration_s.get()),
        ("master", Some(20.0))
    );
    let of_slave = RunReport::from(slave);
    let messages = &of_slave.messages;
    assert_eq!(
        (messages.up.commands, messages.down.updates),
        (Some(1990), Some(234))
    );
    assert_eq!(
        (of_slave.command, of_slave.duration_s.get()),
        ("slave", Some(20.5))
    );
    let alone = RunReport::from(SessionReport {
        other: None,
        ..master
    });
    assert_eq!(alone.updates.sent, SentUpdates::default(), "never guessed");
}

#[test]
fn a_half_of_another_program_gives_what_it_has_and_the_rest_is_absent() {
    let foreign = r#"{"updates": {"applied": 7}, "session": {"timing": {"ticks": 9}}, "new": [1]}"#;
    let half: MasterHalf = serde_json::from_str(foreign).unwrap();
    let (applied, timing) = (half.updates.applied, half.session.timing);
    assert_eq!((applied, timing.ticks), (Some(7), Some(9)));
    assert_eq!(timing.cpu_us.p50.get(), None);
    assert!(serde_json::from_str::<SlaveHalf>("not JSON").is_err());
}

#[test]
fn the_longest_half_fits_into_a_farewell_and_is_read_back_the_same() {
    // every key of a slave's half with the longest number that a session can reach
    let mut half = serde_json::to_value(halves().1.own).unwrap();
    fn fill(value: &mut Value) {
        match value {
            Value::Object(keys) => keys.values_mut().for_each(fill),
            _ => *value = json!(4_294_967_295_u32),
        }
    }
    fill(&mut half);
    let (up, yes) = (json!("tdpa"), json!(true));
    half["session"]["architecture"]["name"] = up;
    half["session"]["emulation"]["degraded"] = yes;
    let causes: Counts = Cause::ALL
        .map(|cause| (cause.name().to_owned(), u64::MAX))
        .into();
    half["updates"]["by_cause"] = json!(causes);
    half["updates"]["repeated_by_cause"] = json!(causes);
    // a slave has 41 names of drops
    let drops: Counts = (10..52)
        .map(|n| (format!("handshakes_unreadable{n}"), 99_999))
        .collect();
    half["session"]["drops"] = json!(drops);
    let written = serde_json::to_vec(&half).unwrap();
    let room = crate::wire::STREAM_MESSAGE_MAX - 8 - 1 - 2;
    assert!(written.len() < room, "{} bytes", written.len());
    let read: SlaveHalf = serde_json::from_slice(&written).unwrap();
    assert_eq!(read.session.drops, drops);
    assert_eq!(
        serde_json::from_value::<SlaveHalf>(json!(read)).unwrap(),
        read
    );
}

/// The stats of an end that has sent 686 datagrams when the path dies: the other has answered 500, and all of them came.
fn of_a_path_that_died() -> SessionStats {
    let ends = [Side::Master, Side::Slave].map(|side| DatagramChannel::new(side, Time::ZERO));
    let [mut up, mut down] = ends;
    let mut buffer = [0; DATAGRAM_MAX];
    for n in 0..686 {
        let now = Time::from_millis(n);
        let length = up.encode(now, Message::Heartbeat, &mut buffer);
        let length = length.unwrap().unwrap();
        if n < 500 {
            down.handle(now, &buffer[..length]).unwrap();
            let length = down.encode(now, Message::Heartbeat, &mut buffer);
            up.handle(now, &buffer[..length.unwrap().unwrap()]).unwrap();
        }
    }
    SessionStats::new(Side::Master, &up, 0, 0.7)
}

#[test]
fn of_a_session_that_died_nobody_knows_the_loss() {
    let (mut master, mut slave) = halves();
    (master.own.session, slave.own.session) = (of_a_path_that_died(), of_a_path_that_died());
    let living = RunReport::from(master.clone()).link;
    assert_eq!(
        (living.loss_up.get(), living.loss_down.get()),
        (Some(0.0), Some(0.0)),
        "the farewell came, so the path lived to the end"
    );
    (master.other, slave.other) = (None, None);
    let both = RunReport::of_both(master.clone(), Some(slave.clone())).link;
    for link in [
        RunReport::from(master).link,
        RunReport::from(slave).link,
        both,
    ] {
        assert_eq!((link.loss_up, link.loss_down), Default::default());
    }
}

#[test]
fn what_a_host_dropped_is_not_lost_on_the_path() {
    let (mut master, _) = halves();
    let own = &mut master.own.session;
    // the master stood still and overtook 90 of its 1000 datagrams, the path lost 10, the slave left 5 unread
    own.outgoing = Loss {
        expected: 1000,
        received: 895,
    };
    own.unsent = Some(90);
    own.incoming = Loss {
        expected: 500,
        received: 480,
    };
    own.unread = Some(0);
    let mut other = master.other.take().unwrap();
    (other.session.unsent, other.session.unread) = (Some(20), Some(5));
    master.other = Some(other);
    let link = RunReport::from(master).link;
    assert_eq!((link.unsent_up, link.unsent_down), (Some(90), Some(20)));
    assert_eq!(link.loss_up.get(), Some(10.0 / 910.0));
    assert_eq!(link.loss_down.get(), Some(0.0));
}
