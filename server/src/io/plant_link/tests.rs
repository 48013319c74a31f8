//! What becomes of a plant's answers on their way to the loop; packets are handed in, no thread runs.

use mmt_shared::model::geometry::{Pose, Vec2};

use super::*;
use crate::environment::BodyConfig;

/// A plug that is fed by hand, the loop's end of it, and what comes next.
struct Bench {
    host: PlantHost,
    port: PlantPort,
    receiver: Receiver,
    sequence: u32,
}

impl Bench {
    fn new() -> Self {
        let socket = PlugSocket::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let host = PlantHost(Arc::new(Shared::new(socket)));
        Self {
            port: host.port(),
            host,
            receiver: Receiver::new(),
            sequence: 0,
        }
    }

    /// An answer that comes at `ms`.
    fn comes(&mut self, ms: u64, answer: &PlantAnswer) {
        self.sequence += 1;
        let head = PlugHead {
            sequence: self.sequence,
            ..PlugHead::default()
        };
        let Self { host, receiver, .. } = self;
        let packet = answer.packet(host.0.socket.token(), &head);
        let from = SocketAddr::from(([127, 0, 0, 1], 9));
        receiver.handle(&host.0, Time::from_millis(ms), from, &packet);
    }

    fn received(&mut self, ms: u64) -> PlantAnswer {
        self.port.receive(Time::from_millis(ms)).unwrap()
    }

    fn object(&self, config: &SlaveConfig, earlier: Option<&Memory>) -> Pose {
        let memory = self.host.memory(config, earlier).unwrap();
        memory.object().unwrap()
    }
}

fn blind() -> PlantAnswer {
    PlantAnswer {
        tool: Vec2::new(-0.45, 0.0),
        ..PlantAnswer::default()
    }
}

fn seeing(x: f64, image_age_s: f64) -> PlantAnswer {
    PlantAnswer {
        object: Some(Pose::new(x, 0.2, 0.1)),
        image_age_s,
        ..blind()
    }
}

#[test]
fn a_session_begins_with_the_object_where_it_was_seen_last_and_until_then_where_it_is_configured() {
    let mut bench = Bench::new();
    let mut config = SlaveConfig::default();
    config.environment.pose = Pose::new(0.5, -0.25, 0.3);
    assert_eq!(bench.host.memory(&config, None), None);
    bench.comes(1, &blind());
    assert_eq!(bench.object(&config, None), config.environment.pose);
    let earlier = Memory::of_plant(Vec2::zeros(), Pose::new(0.7, 0.0, 0.0), None);
    assert_eq!(bench.object(&config, Some(&earlier)).position.x, 0.7);
    bench.comes(2, &seeing(0.9, 0.0));
    bench.comes(3, &blind());
    assert_eq!(bench.object(&config, Some(&earlier)).position.x, 0.9);
    let mut bench = Bench::new();
    config.scene.bodies = vec![BodyConfig {
        pose: Pose::new(1.0, 0.0, 0.0),
        ..BodyConfig::default()
    }];
    bench.comes(1, &blind());
    assert_eq!(bench.object(&config, None).position.x, 1.0);
}

#[test]
fn an_image_in_an_answer_that_a_newer_one_overtook_comes_with_it_and_is_older() {
    let mut bench = Bench::new();
    bench.comes(1, &seeing(0.1, 0.03));
    bench.comes(4, &seeing(0.2, 0.02));
    bench.comes(9, &blind());
    let received = bench.received(10);
    assert_eq!(received.object.map(|pose| pose.position.x), Some(0.2));
    let age_s = received.image_age_s;
    assert!((age_s - 0.025).abs() < 1e-12, "{age_s}");
    bench.comes(11, &blind());
    let received = bench.received(12);
    assert_eq!((received.object, received.image_age_s), (None, 0.0), "once");
    assert_eq!(bench.host.not_given()[0], ("superseded", 2));
}

#[test]
fn a_plant_that_sent_nonsense_for_50_ms_begins_anew() {
    let nonsense = PlantAnswer {
        force: Vec2::new(1e9, 0.0),
        ..blind()
    };
    for (last, anew) in [(50, false), (51, true)] {
        let mut bench = Bench::new();
        bench.comes(1, &blind());
        assert!(bench.received(1).anew, "its first");
        (2..last).for_each(|ms| bench.comes(ms, &nonsense));
        bench.comes(last, &blind());
        assert_eq!(bench.received(last).anew, anew, "{last} ms");
        bench.comes(last + 1, &blind());
        assert!(!bench.received(last + 1).anew);
        let counts = bench.host.counts();
        assert_eq!((counts.nonsense, counts.lost), (last - 2, 0));
    }
}
