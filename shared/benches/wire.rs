//! What writing and reading a command of ten samples and an update cost. Budget: 2 µs each.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;

use mmt_shared::channel::peer::Peer;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Twist, Vec2};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::Time;
use mmt_shared::wire::{
    Command, DATAGRAM_MAX, Datagram, Echo, Envelope, Flags, Message, SampleBlock, Side,
};

const COUPLING: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};

const ENVELOPE: Envelope = Envelope {
    number: 3000,
    sent: Time::from_millis(30_010),
    echo: Some(Echo {
        number: 300,
        sent: Time::from_millis(29_900),
        held_ns: 31_000_000,
        received: 297,
    }),
};

fn command() -> Command {
    let mut samples = SampleBlock::default();
    for k in 0..10_u32 {
        let t = f64::from(k) * 1e-3;
        let _ = samples.push(HipSample {
            stamp: Time::from_millis(30_000 + u64::from(k)),
            hip: HipCounts::nearest(Vec2::new(0.2 * t, 0.01 * t)),
            force: ForceCounts::nearest(Vec2::new(4.0 + 7.0 * t, 0.3)),
        });
    }
    Command {
        newest_update: 250,
        samples,
        port: None,
    }
}

fn update() -> Option<Update> {
    let params = ModelParams::of_square(0.7, 3.0, 2.06, 0.36, &COUPLING).ok()?;
    let pose = Pose::new(0.1, -0.2, 0.3);
    let twist = Twist::new(0.15, 0.0, -0.5);
    Some(Update {
        sequence: 250,
        cause: Cause::Deadband,
        answers: Time::from_millis(30_000),
        touched_face: Some(Face::West),
        state: ModelState::try_new(params, BoxFootprint::square(0.36), pose, twist, &COUPLING)
            .ok()?,
    })
}

fn wire(criterion: &mut Criterion) {
    let mut out = [0; DATAGRAM_MAX];
    let datagram = |message| Datagram {
        flags: Flags::default(),
        envelope: ENVELOPE,
        message,
    };
    let command = datagram(Message::Command(command()));
    criterion.bench_function("wire/encode command", |b| {
        b.iter(|| black_box(&command).encode(&mut out));
    });
    let length = command.encode(&mut out).unwrap_or(0);
    let bytes = out.get(..length).unwrap_or_default().to_vec();
    criterion.bench_function("wire/decode command", |b| {
        b.iter(|| Datagram::decode(black_box(&bytes), Side::Master));
    });

    let Some(update) = update() else { return };
    criterion.bench_function("wire/encode update", |b| {
        b.iter(|| datagram(Message::Update(black_box(&update).into())).encode(&mut out));
    });
    let length = datagram(Message::Update((&update).into())).encode(&mut out);
    let bytes = out.get(..length.unwrap_or(0)).unwrap_or_default().to_vec();
    criterion.bench_function("wire/decode and accept update", |b| {
        b.iter(|| match Datagram::decode(black_box(&bytes), Side::Slave) {
            Ok(Datagram {
                message: Message::Update(raw),
                ..
            }) => raw.accept(&COUPLING).ok(),
            _ => None,
        });
    });
}

fn peer(criterion: &mut Criterion) {
    let (mut here, mut there, mut now) = (Peer::default(), Peer::default(), Time::ZERO);
    criterion.bench_function("peer/stamp and handle, both ways", |b| {
        b.iter(|| {
            now += Duration::from_millis(1);
            if let Ok(question) = here.stamp(now) {
                there.handle(now, &question);
            }
            if let Ok(answer) = there.stamp(now) {
                here.handle(now, &answer);
            }
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = wire, peer
}
criterion_main!(benches);
