//! What is on the screen and in the plain line.

use mmt_client::failsafe::LinkState;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::model::tool::Scene;
use mmt_shared::time::Time;
use mmt_shared::wire::Side;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;

use super::*;

fn snapshot(elapsed_s: f64) -> Snapshot {
    let slave = SlaveLive {
        connected: true,
        elapsed_s,
        f_s: Vec2::new(3.0, 4.0),
        f_shadow: Vec2::new(3.0, 3.5),
        updates: [7, 11, 0, 1, 2, 0, 0],
        estimate: [0.701, 2.95, 2.06],
        in_contact: true,
        // a stall of its host: the path lost 9 of the 1000 that it did send
        unsent: 100,
        ..SlaveLive::default()
    };
    let master = MasterLive {
        elapsed_s,
        f_m: Vec2::new(0.0, 2.5),
        params: [0.699, 2.9, 2.05],
        updates_applied: [7, 10, 0, 1, 2, 0, 0],
        pushes: Some(3),
        link: LinkState::Late,
        footprint: Some(BoxFootprint::square(0.4)),
        hip: Vec2::new(-0.3, 0.0),
        scene: Some(Scene {
            answers: Time::ZERO,
            object: Pose::new(0.1, 0.0, 0.3),
            tool: Vec2::new(-0.25, 0.1),
            force: Vec2::zeros(),
        }),
        scene_age_s: Some(0.21),
        rtt_ms: Some(101.5),
        up: Loss {
            expected: 1000,
            received: 989,
        },
        down: Loss {
            expected: 1100,
            received: 991,
        },
        unsent: 12,
        lateness_p99_us: 63.0,
        skipped: 4,
        ..MasterLive::default()
    };
    Snapshot::new(Some(slave), Some(master), 3.0)
}

fn caption() -> Caption {
    Caption {
        command: "demo",
        duration_s: Some(20.0),
        setting: "recommended, useful 10% 150ms, each way delay 50ms".to_owned(),
        slave: "192.0.2.7:4433".to_owned(),
        truth: Some([0.7, 3.0, 2.06]),
    }
}

fn screen(width: u16, height: u16, history: &History, messages: &[String]) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let draw = |frame: &mut ratatui::Frame<'_>| {
        dashboard::render(frame, &caption(), history, messages);
    };
    terminal.draw(draw).unwrap();
    terminal.backend().to_string()
}

#[test]
fn the_dashboard_shows_every_label_and_number_on_a_small_terminal() {
    let mut history = History::default();
    (0..100_u32).for_each(|tick| history.push(snapshot(f64::from(tick) * 0.05)));
    let shown = screen(80, 24, &history, &["a message".to_owned()]);
    for part in [
        "mmt demo",
        "of 20 s",
        "slave touches",
        "master free",
        "q ends, space stops",
        "recommended",
        "─ model",
        "┄ remote 210 ms ago",
        "|f_s|",
        "5.00 N",
        "|f_m|",
        "2.50 N",
        "|error|",
        "0.50 N",
        "updates 21",
        "deadband 7",
        "timer 11",
        "slave only 1",
        "contact lost 2",
        "applied 20",
        "per s",
        "estimate",
        "truth",
        "0.701",
        "0.700",
        "0.699",
        "m kg",
        "b N s/m",
        "c N",
        "pushes",
        "link: late",
        "101.5 ms",
        "up   loss 1.1 %, unsent 12",
        "down loss 0.9 %, unsent 100",
        "lateness p99 63 us",
        "skipped 4",
        "a message",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
}

#[test]
fn half_of_the_screen_is_the_scene_and_a_low_and_narrow_one_without_colours_has_every_number() {
    let mut history = History::default();
    (0..100_u32).for_each(|tick| history.push(snapshot(f64::from(tick) * 0.05)));
    let shown = screen(60, 15, &history, &["a message".to_owned()]);
    let lines: Vec<Vec<char>> = shown.lines().map(|line| line.chars().collect()).collect();
    let right = |line: &Vec<char>| line.iter().skip(31).take(30).collect::<String>();
    let numbers: Vec<String> = lines.iter().map(right).collect();
    let numbers = numbers.join("\n");
    for part in [
        "f_s 5.00 f_m 2.50 error 0.50 N",
        "link: late  rtt 101.5 ms",
        "up   loss 1.1 %, unsent 12",
        "down loss 0.9 %, unsent 100",
        "m kg       0.701  0.700  0.699",
        "hand 0.00 N   pushes 3",
        "updates 21, 0.0 per s",
        "deadband 7, timer 11",
        "slave only 1, contact lost 2",
        "applied 20",
    ] {
        assert!(numbers.contains(part), "{part}\n{shown}");
    }
    assert!(shown.contains("of 20 s   q ends, space stops"), "{shown}");
    assert!(shown.contains("a message"), "{shown}");
    // on a large one the updates are a table
    let large = screen(100, 40, &history, &[]);
    assert!(large.contains("deadband          7    0.0"), "{large}");
    assert!(large.contains("|f_m| master 2.50 N  (of 5.0 N)"), "{large}");
}

#[test]
fn a_master_alone_shows_what_came_from_the_slave() {
    let mut history = History::default();
    let of_both = snapshot(1.0);
    let force = Vec2::new(0.0, 4.5);
    let scene = of_both
        .master
        .unwrap()
        .scene
        .map(|scene| Scene { force, ..scene });
    let master = of_both.master.map(|master| MasterLive { scene, ..master });
    history.push(Snapshot::new(None, master, 1.0));
    let shown = screen(80, 24, &history, &[]);
    for part in [
        "|f_s| slave 4.50 N",
        "applied      so far",
        "timer            10",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
    let text = line(&caption(), &history);
    for part in ["f_s 4.50 N", "updates 20", "mass 0.699 kg"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn what_is_not_known_yet_is_a_dash_and_no_size_of_terminal_is_too_small() {
    let history = History::default();
    assert!(screen(80, 24, &history, &[]).contains("lateness p99 -"));
    for (width, height) in [(1, 1), (10, 5), (40, 10), (300, 100)] {
        screen(width, height, &history, &["x".repeat(200)]);
    }
}

#[test]
fn the_plain_line_has_the_same_numbers_and_leaves_out_what_is_not_known() {
    let mut history = History::default();
    history.push(snapshot(1.0));
    let text = line(&caption(), &history);
    for part in [
        "1.0 s",
        "f_s 5.00 N",
        "error 0.50 N",
        "updates 21",
        "rtt 102 ms",
        "mass 0.701 kg",
        "pushes 3",
        "link late",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let text = line(&caption(), &History::default());
    assert!(!text.contains("f_s") && !text.contains("link"), "{text}");
}

#[test]
fn before_the_session_begins_no_link_is_called_fresh() {
    let mut history = History::default();
    history.push(Snapshot::new(None, Some(MasterLive::default()), 3.2));
    assert_eq!(
        line(&caption(), &history),
        "connecting to 192.0.2.7:4433, 3 s"
    );
    let shown = screen(100, 30, &history, &[]);
    assert!(shown.contains("link: connecting to"), "{shown}");
    assert!(shown.contains("192.0.2.7:4433, 3 s"), "{shown}");
    assert!(!shown.contains("fresh"), "{shown}");
}

#[test]
fn an_emergency_stop_takes_the_place_of_the_links_state() {
    let mut history = History::default();
    let mut stopped = snapshot(1.0);
    let slave = stopped.slave.as_mut().unwrap();
    slave.stopped_by = Some(Side::Slave);
    history.push(stopped);
    for text in [line(&caption(), &history), screen(100, 30, &history, &[])] {
        assert!(text.contains("EMERGENCY STOP (slave)"), "{text}");
    }
}

#[test]
fn what_a_sender_left_unsent_is_no_loss_of_the_path_and_without_its_count_nothing_is_called_loss() {
    let mut history = History::default();
    history.push(snapshot(1.0));
    let text = line(&caption(), &history);
    for part in [
        "loss up 1.1 %",
        "unsent up 12",
        "loss down 0.9 %",
        "unsent down 100",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let mut alone = History::default();
    alone.push(Snapshot {
        slave: None,
        ..snapshot(1.0)
    });
    let text = line(&caption(), &alone);
    assert!(
        text.contains("missing down 9.9 %") && !text.contains("loss down"),
        "{text}"
    );
}

#[test]
fn the_scene_shows_the_model_and_behind_it_the_ghost_where_the_slave_saw_it() {
    let mut terminal = Terminal::new(TestBackend::new(40, 20)).unwrap();
    let Snapshot { master, .. } = snapshot(1.0);
    let mut draw = |master: Option<MasterLive>| {
        let shown = terminal.draw(|frame| {
            let now = Snapshot::new(None, master, 0.0);
            scene::render_scene(frame, frame.area(), &now);
        });
        let cells = shown.unwrap().buffer.content().to_vec();
        let drawn = |colour| {
            let places = cells.iter().skip(40).enumerate();
            let drawn = places.filter(move |(_, cell)| cell.fg == colour && cell.symbol() != " ");
            let columns: Vec<usize> = drawn.map(|(place, _)| place % 40).collect();
            let mean = columns.iter().sum::<usize>() as f64 / columns.len() as f64;
            (columns.len(), mean)
        };
        (
            drawn(Color::Cyan),
            drawn(Color::DarkGray),
            drawn(Color::White),
        )
    };
    let (model, ghost, hip) = draw(master);
    assert!(
        model.0 > 20 && ghost.0 > 10 && hip.0 == 1,
        "{model:?} {ghost:?}"
    );
    // the model is in the middle, the ghost 10 cm to the right, the HIP 30 cm to the left of 90 cm
    assert!((model.1 - 19.5).abs() < 1.0, "{model:?}");
    assert!(
        ghost.1 > model.1 + 1.0 && hip.1 < model.1 - 10.0,
        "{ghost:?} {hip:?}"
    );
    let blind = master.map(|master| MasterLive {
        scene: None,
        ..master
    });
    assert_eq!(draw(blind).1.0, 0, "no ghost that never came");
    assert_eq!(draw(None).0.0, 0);
}

fn observed() -> ObserverLive {
    let of_master = snapshot(1.0).master.unwrap();
    ObserverLive {
        elapsed_s: 1.0,
        footprint: of_master.footprint,
        params: [0.699, 2.9, 2.05],
        in_contact: true,
        scene: of_master.scene.map(|scene| Scene {
            force: Vec2::new(0.0, 4.5),
            ..scene
        }),
        scene_age_s: Some(0.21),
        updates: [7, 10, 0, 1, 2, 0, 0],
        rtt_ms: Some(101.5),
        ..ObserverLive::default()
    }
}

#[test]
fn an_observer_sees_the_slaves_side_no_hand_and_no_key_that_stops() {
    let mut history = History::default();
    history.push(Snapshot::of_observer(ObserverLive::default(), 3.2));
    let text = line(&caption(), &history);
    assert_eq!(text, "connecting to 192.0.2.7:4433, 3 s");
    history.push(Snapshot::of_observer(observed(), 1.0));
    let shown = screen(80, 24, &history, &[]);
    for part in [
        "slave touches",
        "q ends",
        "┄ remote 210 ms ago",
        "|f_s| slave 4.50 N",
        "|f_m| master -",
        "updates      so far",
        "timer            10",
        "update",
        "0.699",
        "link: fresh  rtt 101.5 ms",
        "hand -   pushes -",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
    assert!(!shown.contains("space stops"), "{shown}");
    let text = line(&caption(), &history);
    for part in [
        "f_s 4.50 N",
        "updates 20",
        "mass 0.699 kg",
        "scene 210 ms old",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let stopped = ObserverLive {
        stopped: true,
        ..observed()
    };
    history.push(Snapshot::of_observer(stopped, 1.0));
    assert!(line(&caption(), &history).contains("EMERGENCY STOP"));
}
