//! A plant that is plugged in, in virtual time.

use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::plug::{NotTaken, PLANT_BYTES, PlugHead, PlugKind, PlugToken, encode};
use mmt_shared::rng::Substream;
use mmt_shared::time::{TICK, TICK_S};

use super::*;
use crate::environment::EnvironmentConfig;
use crate::slave::{Slave, SlaveConfig, SlaveTick};

const TOKEN: PlugToken = PlugToken::new([3; 16]);

fn linked() -> SlaveConfig {
    SlaveConfig {
        plant: PlantConfig {
            link: true,
            ..PlantConfig::default()
        },
        ..SlaveConfig::default()
    }
}

fn answer() -> PlantAnswer {
    PlantAnswer {
        tool: Vec2::new(0.1, -0.2),
        velocity: Vec2::new(0.3, 0.4),
        force: Vec2::new(1.5, -2.5),
        object: Some(Pose::new(0.5, 0.6, 0.7)),
        image_age_s: 0.02,
        anew: false,
    }
}

#[test]
fn an_answer_reads_back_and_one_that_cannot_be_is_none() {
    let head = PlugHead {
        sequence: 9,
        ..PlugHead::default()
    };
    let read = |answer: PlantAnswer| {
        let packet = answer.packet(&TOKEN, &head);
        let (found, answer) = PlantAnswer::read(&TOKEN, &packet).unwrap();
        assert_eq!(found.sequence, 9);
        answer
    };
    assert_eq!(read(answer()), Some(answer()));
    let blind = PlantAnswer {
        object: None,
        image_age_s: 0.0,
        ..answer()
    };
    assert_eq!(read(blind), Some(blind));
    for bad in [f64::NAN, f64::INFINITY, -1e9] {
        let vector = Vec2::new(0.0, bad);
        assert_eq!(
            read(PlantAnswer {
                tool: vector,
                ..answer()
            }),
            None
        );
        assert_eq!(
            read(PlantAnswer {
                velocity: vector,
                ..answer()
            }),
            None
        );
        assert_eq!(
            read(PlantAnswer {
                force: vector,
                ..answer()
            }),
            None
        );
        let object = Some(Pose::new(0.0, bad, 0.0));
        assert_eq!(read(PlantAnswer { object, ..answer() }), None);
        assert_eq!(
            read(PlantAnswer {
                image_age_s: bad,
                ..answer()
            }),
            None
        );
    }
}

#[test]
fn a_packet_of_another_kind_or_token_is_not_taken() {
    let head = PlugHead::default();
    let other = PlugToken::new([4; 16]);
    let stranger = answer().packet(&other, &head);
    assert_eq!(
        PlantAnswer::read(&TOKEN, &stranger),
        Err(NotTaken::Stranger)
    );
    let command: [u8; PLANT_BYTES] = encode(PlugKind::Tool, &TOKEN, &head, [[0_u8; 8]; 10]);
    assert_eq!(
        PlantAnswer::read(&TOKEN, &command),
        Err(NotTaken::Malformed)
    );
}

/// A slave whose hand goes along x at 0.1 m/s from −0.3 m, and whose plant answers what `plant` makes of the command.
fn drive(ticks: u64, plant: impl FnMut(&PlantCommand) -> Option<PlantAnswer>) -> Slave {
    drive_along(|t| 0.1 * t, ticks, plant, |_| {})
}

/// The same with a hand that has gone `way` (m) after a time (s); `watch` gets each tick.
fn drive_along(
    way: impl Fn(f64) -> f64,
    ticks: u64,
    mut plant: impl FnMut(&PlantCommand) -> Option<PlantAnswer>,
    mut watch: impl FnMut(&SlaveTick),
) -> Slave {
    let mut slave = Slave::try_new(&linked(), Coupling::for_stiffness(1000.0)).unwrap();
    slave.start_at(Vec2::new(-0.3, 0.0));
    for n in 1..=ticks {
        let now = Time::ZERO + TICK * n as u32;
        let sample = HipSample {
            stamp: now,
            hip: HipCounts::nearest(Vec2::new(-0.3 + way(n as f64 * TICK_S), 0.0)),
            force: ForceCounts::nearest(Vec2::zeros()),
        };
        slave.handle_sample(now, &sample, 0);
        let command = slave.plant_command().unwrap();
        if let Some(answer) = plant(&command) {
            slave.handle_plant(now, &answer);
        }
        if let Some(tick) = slave.tick(now) {
            watch(&tick);
        }
    }
    slave
}

/// A wall at x = −0.2 m, of the stiffness that the command asks for.
fn wall(command: &PlantCommand) -> PlantAnswer {
    let depth = (command.tool.x + 0.2).max(0.0);
    PlantAnswer {
        tool: Vec2::new(command.tool.x.min(-0.2), command.tool.y),
        force: Vec2::new(depth * command.stiffness_n_per_m, 0.0),
        object: Some(Pose::default()),
        ..PlantAnswer::default()
    }
}

#[test]
fn the_force_that_a_plant_measured_is_f_s_a_period_later_and_the_tool_goes_where_the_hand_was() {
    let mut commands = Vec::new();
    let mut slave = drive(1100, |command| {
        commands.push(*command);
        Some(wall(command))
    });
    assert!(slave.is_linked());
    let forward = commands.last().unwrap().tool.x + 0.3;
    assert!(
        (0.1..0.11).contains(&forward),
        "behind the play-out: {forward}"
    );
    for pair in commands.windows(2) {
        assert!((pair[1].tool - pair[0].tool).norm() <= 0.6 * TICK_S + 1e-12);
    }
    let now = Time::ZERO + TICK * 1101;
    let tick = slave.tick(now).unwrap();
    let depth = commands.last().unwrap().tool.x + 0.2;
    assert!(tick.in_contact && depth > 0.0);
    assert!(
        (tick.f_s.x - 1000.0 * depth).abs() < 0.5,
        "{} {depth}",
        tick.f_s
    );
}

/// A plant whose contacts have 1000 N/m, and whose tool is sent at 0.6 m/s at the most.
fn plugged_in(gives: ToolGives) -> LinkedPlant {
    let stand_in = Environment::try_new(EnvironmentConfig::default()).unwrap();
    let (coupling, limits) = (Coupling::for_stiffness(1000.0), (0.6, 15.0));
    LinkedPlant::new(linked().plant, stand_in, coupling, limits, gives)
}

#[test]
fn a_tool_that_gives_by_itself_is_rendered_as_penetration() {
    for (gives, given) in [(ToolGives::ByPlant, 0.0015), (ToolGives::BySlave, 0.0)] {
        let mut plant = plugged_in(gives);
        let stands = PlantAnswer {
            velocity: Vec2::zeros(),
            ..answer()
        };
        plant.take(Time::ZERO, &stands);
        let mut met = plant.meet(Time::ZERO, Vec2::zeros(), Vec2::zeros());
        // the damper gives way in some 10 ms
        assert!((met.sensed.tool.x - 0.1 - 0.1 * given).abs() < 1e-4);
        for _ in 0..1000 {
            met = plant.meet(Time::ZERO, Vec2::zeros(), Vec2::zeros());
        }
        assert!((met.sensed.tool.x - 0.1 - given).abs() < 1e-12);
        assert_eq!(met.force, answer().force);
        assert_eq!(met.pose, Pose::new(0.5, 0.6, 0.7));
    }
}

/// A block of 0.7 kg, b = 3 N s/m and c = 2 N. The tool is a spring and a damper, and stands at the face while it touches.
struct Block {
    face: f64,
    speed: f64,
    tool: f64,
    noise: Substream,
    noise_n: f64,
}

impl Block {
    fn new(noise_n: f64) -> Self {
        Self {
            face: -0.18,
            speed: 0.0,
            tool: -0.3,
            noise: Substream::new(8, "plant", 0),
            noise_n,
        }
    }

    fn answer(&mut self, command: &PlantCommand) -> PlantAnswer {
        let tool = command.tool.x;
        let depth = tool - self.face;
        let rate = (tool - self.tool) / TICK_S - self.speed;
        let spring = command.stiffness_n_per_m * depth + command.damping_ns_per_m * rate;
        let force = if depth > 0.0 { spring.max(0.0) } else { 0.0 };
        let (noise, beside) = self.noise.normal_pair();
        let velocity = if depth > 0.0 {
            Vec2::new(self.speed, 0.0)
        } else {
            command.velocity
        };
        let answer = PlantAnswer {
            tool: Vec2::new(tool.min(self.face), command.tool.y),
            velocity,
            force: Vec2::new(force + noise * self.noise_n, beside * self.noise_n),
            object: Some(Pose::new(self.face + 0.18, 0.0, 0.0)),
            ..PlantAnswer::default()
        };
        let free = self.speed + TICK_S * (force - 3.0 * self.speed) / 0.7;
        self.speed = (free - TICK_S * 2.0 / 0.7).max(0.0);
        self.face += TICK_S * self.speed;
        self.tool = tool;
        answer
    }
}

#[test]
fn noise_of_the_force_does_not_make_the_object_of_a_plant_light() {
    for noise_n in [0.0, 0.1, 0.2] {
        let mut block = Block::new(noise_n);
        let shake = |t: f64| 0.004 * libm::sin(12.0 * t);
        let slave = drive_along(
            |t| 0.1 * t + shake(t),
            6000,
            |command| Some(block.answer(command)),
            |_| {},
        );
        let mass_kg = slave.estimate().m;
        assert!((mass_kg - 0.7).abs() < 0.03, "{noise_n} N: {mass_kg} kg");
    }
}

#[test]
fn a_plant_that_measures_every_few_periods_shows_the_object_as_it_is() {
    for (periods, noise_n) in [(4, 0.0), (8, 0.0), (4, 0.05), (8, 0.05)] {
        let mut block = Block::new(noise_n);
        let shake = |t: f64| 0.004 * libm::sin(12.0 * t);
        let (mut n, mut contacts) = (0, 0);
        let slave = drive_along(
            |t| 0.1 * t + shake(t),
            6000,
            |command| {
                let answer = block.answer(command);
                n += 1;
                (n % periods == 0).then_some(answer)
            },
            |tick| contacts += u32::from(tick.in_contact && tick.true_force.norm() < 0.3),
        );
        let mass_kg = slave.estimate().m;
        let what = format!("{periods} periods, {noise_n} N");
        assert!((mass_kg - 0.7).abs() < 0.08, "{what}: {mass_kg} kg");
        assert!(
            contacts < 60,
            "{what}: contact of {contacts} ticks in free space"
        );
    }
}

#[test]
fn a_velocity_that_no_tool_is_sent_with_moves_it_by_little() {
    let mut plant = plugged_in(ToolGives::BySlave);
    let answer = PlantAnswer {
        velocity: Vec2::new(-15.0, 0.0),
        force: Vec2::zeros(),
        ..answer()
    };
    plant.take(Time::ZERO, &answer);
    let places: Vec<f64> = (0..100)
        .map(|_| plant.meet(Time::ZERO, Vec2::zeros(), Vec2::zeros()))
        .map(|met| answer.tool.x - met.sensed.tool.x)
        .collect();
    // 20 ms at 0.6 m/s
    assert!((places[20] - 0.012).abs() < 1e-9, "{} m", places[20]);
    assert_eq!(places[99], places[20]);
}

#[test]
fn after_a_silence_the_tool_is_where_the_plant_reports_it_and_waits_for_the_hand() {
    let mut n = 0;
    let mut places = Vec::new();
    drive(3000, |command| {
        n += 1;
        places.push(command.tool);
        let anew = n == 1000;
        // somebody carried it 5 cm back meanwhile
        let tool = Vec2::new(command.tool.x - if anew { 0.05 } else { 0.0 }, 0.0);
        (!(900..1000).contains(&n)).then_some(PlantAnswer {
            tool,
            anew,
            ..PlantAnswer::default()
        })
    });
    let carried = places[1000];
    assert!((carried.x - (places[999].x - 0.05)).abs() < 1e-9);
    assert_eq!(places[1100], carried, "the hand is 5 cm away and goes on");
    assert_eq!(places[2999], carried);
}

#[test]
fn an_image_that_no_tick_took_and_one_that_is_too_old_are_counted() {
    let mut n = 0;
    let slave = drive(600, |_| {
        n += 1;
        (n >= 500).then_some(PlantAnswer {
            // 256 ms are remembered
            image_age_s: if n == 550 { 0.3 } else { 0.02 },
            ..answer()
        })
    });
    assert_eq!((slave.images_dropped(), slave.images_too_old()), (0, 1));
    let mut slave = Slave::try_new(&linked(), Coupling::for_stiffness(1000.0)).unwrap();
    for _ in 0..3 {
        slave.handle_plant(Time::ZERO + TICK, &answer());
    }
    assert_eq!(slave.images_dropped(), 2);
}

#[test]
fn a_limit_or_a_friction_that_no_tool_should_have_is_refused() {
    for bad in [f64::NAN, 0.0, 1e6] {
        let mut config = linked();
        config.plant.acceleration_max_m_per_s2 = bad;
        assert!(Slave::try_new(&config, Coupling::for_stiffness(1000.0)).is_err());
    }
    for bad in [f64::NAN, -0.1, 0.6] {
        let mut config = linked();
        config.plant.tool_friction = bad;
        let Err(refused) = Slave::try_new(&config, Coupling::for_stiffness(1000.0)) else {
            panic!("{bad} is accepted");
        };
        assert!(refused.to_string().contains("tool_friction"), "{refused}");
    }
}

#[test]
fn only_a_plant_s_tool_rubs_and_none_in_paper_mode() {
    let linked = linked().plant;
    assert!(linked.friction_in(Mode::Recommended) > 0.0);
    assert_eq!(linked.friction_in(Mode::Paper), 0.0);
    assert_eq!(PlantConfig::default().friction_in(Mode::Recommended), 0.0);
}
