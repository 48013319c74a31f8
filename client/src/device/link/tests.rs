//! What a device that is plugged in is promised, and what is promised of it.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::NotTaken;

use super::*;
use crate::device::DeviceProfile;

const TOKEN: PlugToken = PlugToken::new([7; 16]);
const PRESSED: u16 = 1;

fn at(ms: u64) -> Time {
    Time::from_millis(ms)
}

fn device() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 5000))
}

struct Bench {
    link: DeviceLink,
    sequence: u32,
    events: Vec<HandEvent>,
}

impl Bench {
    fn new(config: DeviceLinkConfig) -> Self {
        Self {
            link: DeviceLink::try_new(config, TOKEN).unwrap(),
            sequence: 0,
            events: Vec::new(),
        }
    }

    /// A reading that arrives at once; the device's clock is far from the link's.
    fn reading(&mut self, ms: u64, buttons: u16, place: [f64; 3]) -> bool {
        self.sequence += 1;
        let head = PlugHead {
            flags: buttons,
            sequence: self.sequence,
            answers: 0,
            stamp_ns: 10_u64.pow(18) + ms * 1_000_000,
        };
        let [x, y, z] = place;
        let numbers = [x, y, z, 0.0, 0.0, 0.0].map(|n| (n as f32).to_le_bytes());
        let packet: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, numbers);
        self.events.clear();
        let Self { link, events, .. } = self;
        link.handle(at(ms), device(), &packet, |event| events.push(event))
    }

    fn pressed(config: DeviceLinkConfig) -> Self {
        let mut bench = Self::new(config);
        bench.reading(0, 0, [0.0; 3]);
        bench.reading(1, PRESSED, [0.0; 3]);
        assert!(matches!(bench.events[..], [HandEvent::Press(_)]));
        bench
    }

    /// Flags and numbers of the answer.
    fn answer(&mut self, ms: u64, output: &HandOutput) -> (u16, [f64; 6]) {
        let packet = self.link.answer(at(ms), output);
        let (head, numbers) = decode(PlugKind::Force, DEVICE_BYTES, &TOKEN, &packet).unwrap();
        assert_eq!(head.answers, self.sequence);
        (head.flags, singles(numbers))
    }
}

fn pushes(tick: u64) -> HandOutput {
    HandOutput {
        tick,
        force: Vec2::new(1.0, -2.0),
        hip: Vec2::new(0.5, 0.25),
        engaged: true,
        in_contact: true,
        ..HandOutput::default()
    }
}

#[test]
fn a_button_holds_the_hand_from_press_to_release_and_must_have_been_up_before() {
    let mut bench = Bench::new(DeviceLinkConfig::default());
    assert!(bench.reading(0, PRESSED, [0.0; 3]));
    assert_eq!(bench.events, [HandEvent::NewPage], "a button that sticks");
    bench.reading(1, 0, [0.0; 3]);
    assert!(matches!(bench.events[..], [HandEvent::Clock(_)]));
    bench.reading(2, PRESSED, [0.001, 0.0, 0.0]);
    assert!(matches!(bench.events[..], [HandEvent::Press(_)]));
    bench.reading(3, PRESSED, [0.002, 0.0, 0.0]);
    let [HandEvent::Move(sample)] = bench.events[..] else {
        panic!("{:?}", bench.events);
    };
    assert!((sample.at - Vec2::new(0.002, 0.0)).norm() < 1e-8);
    assert!((sample.page_s - 0.003).abs() < 1e-12, "{}", sample.page_s);
    bench.reading(4, 0, [0.002, 0.0, 0.0]);
    assert_eq!(bench.events, [HandEvent::Release]);
}

#[test]
fn axes_and_scale_map_the_way_in_and_axes_alone_the_force_out() {
    let mut bench = Bench::pressed(DeviceLinkConfig {
        axes: [Axis::MinusZ, Axis::X],
        scale: 4.0,
        ..DeviceLinkConfig::default()
    });
    bench.reading(2, PRESSED, [0.001, 0.5, -0.003]);
    assert_eq!(bench.link.counts().nonsense, 1, "that was 0.5 m in 1 ms");
    bench.reading(3, 0, [0.001, 0.5, -0.003]);
    bench.reading(4, PRESSED, [0.001, 0.5, -0.003]);
    let [HandEvent::Press(sample)] = bench.events[..] else {
        panic!("{:?}", bench.events);
    };
    assert!((sample.at - Vec2::new(0.012, 0.004)).norm() < 1e-7);
    let (_, numbers) = bench.answer(4, &pushes(1));
    assert_eq!(numbers, [-2.0, 0.0, -1.0, 0.5, 0.25, 0.0]);
}

#[test]
fn force_goes_out_while_a_loop_runs_and_none_50_ms_after_its_last_tick() {
    let mut bench = Bench::pressed(DeviceLinkConfig::default());
    let none = HandOutput::default();
    assert_eq!(bench.answer(1, &none).0, 0, "no loop");
    let (flags, numbers) = bench.answer(2, &pushes(9));
    assert_eq!(flags, state::SESSION | state::ENGAGED | state::IN_CONTACT);
    assert_eq!(numbers[..3], [1.0, -2.0, 0.0]);
    assert_eq!(bench.answer(51, &pushes(9)).1[0], 1.0);
    let (flags, numbers) = bench.answer(52, &pushes(9));
    assert_eq!((flags, &numbers[..3]), (0, &[0.0; 3][..]));
    assert_eq!(bench.answer(53, &pushes(10)).1[0], 1.0, "it goes on");
}

#[test]
fn the_force_ramps_out_after_a_release_and_none_goes_to_a_device_that_nobody_holds() {
    let mut bench = Bench::new(DeviceLinkConfig::default());
    bench.reading(0, 0, [0.0; 3]);
    assert_eq!(
        bench.answer(0, &pushes(1)).1[..3],
        [0.0; 3],
        "a script pushes"
    );
    bench.reading(1, PRESSED, [0.0; 3]);
    assert_eq!(bench.answer(1, &pushes(2)).1[0], 1.0);
    bench.reading(2, 0, [0.0; 3]);
    assert_eq!(bench.answer(2, &pushes(3)).1[0], 1.0, "the limiter ramps");
    assert_eq!(bench.answer(210, &pushes(4)).1[0], 1.0);
    assert_eq!(bench.answer(211, &pushes(5)).1[0], 0.0);
}

#[test]
fn nonsense_lets_the_hand_go_without_force_until_the_button_was_up() {
    let nan = f64::NAN;
    for bad in [[nan, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.1, 0.0, 0.0]] {
        let mut bench = Bench::pressed(DeviceLinkConfig::default());
        assert!(
            bench.reading(2, PRESSED, bad),
            "it is answered all the same"
        );
        assert_eq!(bench.events, [HandEvent::Release, HandEvent::NewPage]);
        let (flags, numbers) = bench.answer(2, &pushes(1));
        assert_eq!(flags & (state::ENGAGED | state::REFUSED), state::REFUSED);
        assert_eq!(numbers[..3], [0.0; 3]);
        bench.reading(3, PRESSED, [0.0; 3]);
        assert_eq!(bench.events, [], "held through it");
        bench.reading(4, 0, [0.0; 3]);
        bench.reading(5, PRESSED, [0.0; 3]);
        assert!(matches!(bench.events[..], [HandEvent::Press(_)]));
        assert_eq!(bench.answer(5, &pushes(2)).1[0], 1.0);
        assert_eq!(bench.link.counts().nonsense, 1);
    }
}

#[test]
fn the_edge_of_the_workspace_lets_the_hand_go() {
    let mut bench = Bench::pressed(DeviceLinkConfig {
        workspace_m: 0.02,
        ..DeviceLinkConfig::default()
    });
    bench.reading(3, PRESSED, [0.0099, 0.0, 0.0]);
    assert!(matches!(bench.events[..], [HandEvent::Move(_)]));
    bench.reading(4, PRESSED, [0.0101, 0.0, 0.0]);
    assert_eq!(bench.events, [HandEvent::Release]);
    bench.reading(5, PRESSED, [0.0099, 0.0, 0.0]);
    assert_eq!(bench.events, [], "back inside with the button held");
}

#[test]
fn a_clock_that_goes_back_is_nonsense_once_and_begins_anew() {
    let mut bench = Bench::pressed(DeviceLinkConfig::default());
    bench.sequence += 1;
    let numbers = [0.0_f32; 6].map(f32::to_le_bytes);
    for (n, stamp_ns) in [5_u64, 1_000_005].into_iter().enumerate() {
        let head = PlugHead {
            flags: 0,
            sequence: bench.sequence + n as u32,
            answers: 0,
            stamp_ns,
        };
        let packet: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, numbers);
        assert!(bench.link.handle(at(2), device(), &packet, |_| ()));
    }
    assert_eq!(bench.link.counts().nonsense, 1);
}

#[test]
fn a_device_that_was_silent_begins_anew_and_does_not_go_on_by_itself() {
    let mut bench = Bench::pressed(DeviceLinkConfig::default());
    bench.reading(41, PRESSED, [0.0; 3]);
    assert_eq!(bench.events, [HandEvent::Release, HandEvent::NewPage]);
    bench.reading(42, PRESSED, [0.0; 3]);
    assert_eq!(bench.events, []);
}

#[test]
fn strangers_and_nonsense_packets_are_counted_and_not_answered() {
    let mut bench = Bench::pressed(DeviceLinkConfig::default());
    let others = PlugToken::new([8; 16]);
    let numbers = [0.0_f32; 6].map(f32::to_le_bytes);
    let head = PlugHead::default();
    let stranger: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &others, &head, numbers);
    let wrong_way: [u8; DEVICE_BYTES] = encode(PlugKind::Force, &TOKEN, &head, numbers);
    for packet in [&stranger[..], &wrong_way, &[], &[0xff; 2000]] {
        assert!(!bench.link.handle(at(2), device(), packet, |_| panic!()));
    }
    let counts = bench.link.counts();
    assert_eq!((counts.stranger, counts.malformed), (1, 3));
    let read = decode(PlugKind::Reading, DEVICE_BYTES, &TOKEN, &stranger);
    assert_eq!(read.map(|_| ()), Err(NotTaken::Stranger));
}

#[test]
fn a_device_that_contradicts_itself_is_refused() {
    let default = DeviceLinkConfig::default();
    let refused = |config| DeviceLink::try_new(config, TOKEN).is_err();
    assert!(!refused(default));
    for axes in [[Axis::X, Axis::MinusX], [Axis::Z, Axis::Z]] {
        assert!(refused(DeviceLinkConfig { axes, ..default }));
    }
    for bad in [f64::NAN, -1.0, 1e9] {
        let (workspace_m, playout_ms, silence_ms) = (bad, bad, bad);
        assert!(refused(DeviceLinkConfig {
            workspace_m,
            ..default
        }));
        assert!(refused(DeviceLinkConfig {
            playout_ms,
            ..default
        }));
        assert!(refused(DeviceLinkConfig {
            silence_ms,
            ..default
        }));
    }
    assert!(refused(DeviceLinkConfig {
        button: 16,
        ..default
    }));
    let stiff = DeviceLinkConfig {
        scale: 13.0,
        ..default
    };
    assert!(DeviceProfile::plugged_in(&stiff).is_err(), "13 x 500 N/m");
    let soft = DeviceLinkConfig {
        stiffness_n_per_m: 200.0,
        force_max_n: 3.0,
        ..stiff
    };
    let profile = DeviceProfile::plugged_in(&soft).unwrap();
    assert_eq!(profile.limits().force_max_n, 3.0);
}
