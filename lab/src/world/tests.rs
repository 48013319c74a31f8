//! What a world promises: the job is done over the default network, and a run is a function of its
//! configuration.

use super::*;
use mmt_netem::config::LinkConfig;
use mmt_server::playout::PlayoutConfig;
use mmt_server::slave::SlaveConfig;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::Token;
use mmt_shared::stats::values::median;
use mmt_shared::wire::Welcome;

mod estimation;
mod given;
mod shapes;

/// The default network: 50 ms ± 5 ms each way, 1 % loss.
const WAN: &str = "delay 50ms 5ms loss 1%";
pub(super) const SEEDS: std::ops::RangeInclusive<u64> = 1..=6;

fn link(words: &str) -> LinkConfig {
    words.parse().unwrap()
}

fn over(words: &str, seed: u64) -> WorldConfig {
    WorldConfig::over(link(words)).seeded(seed)
}

fn run(config: &WorldConfig, seconds: u64) -> World {
    let mut world = World::try_new(config).unwrap();
    world.run(Duration::from_secs(seconds), |_| {});
    world
}

fn relative_error(world: &World) -> f64 {
    world.force().relative_error.unwrap()
}

/// Every number that a report is made of.
fn numbers(world: &World) -> Vec<(&'static str, f64)> {
    let (force, outcome) = (world.force(), world.outcome());
    let estimate = world.slave().estimate();
    let model = world.master().model().state();
    let age_s = |age: Option<Duration>| age.unwrap().as_secs_f64();
    let pushes = world.operator().pushes_completed().unwrap();
    vec![
        ("pmse", force.pmse.unwrap()),
        ("pmse_x", force.pmse_x.unwrap()),
        ("pmse_y", force.pmse_y.unwrap()),
        ("pmse_magnitude", force.pmse_magnitude.unwrap()),
        ("relative_error", force.relative_error.unwrap()),
        ("error_rms_n", force.error_rms_n.unwrap()),
        ("jnd7_share", force.jnd7_share.unwrap()),
        ("jnd10_share", force.jnd10_share.unwrap()),
        ("largest_n", outcome.on_hand.largest_n().unwrap()),
        ("largest_step_n", outcome.on_hand.largest_step_n().unwrap()),
        ("rate_hz", outcome.updates.rate_hz().unwrap()),
        (
            "contact_rate_hz",
            outcome.updates.contact_rate_hz().unwrap(),
        ),
        ("age mean", age_s(outcome.age.mean())),
        ("age max", age_s(outcome.age.largest())),
        ("position_rms_m", outcome.pose.position_rms_m().unwrap()),
        ("angle_rms_rad", outcome.pose.angle_rms_rad().unwrap()),
        ("breaks", outcome.breaks.per_push(pushes).unwrap()),
        ("m", estimate.m),
        ("b", estimate.b),
        ("c", estimate.c),
        ("model x", model.pose.position.x),
        ("model y", model.pose.position.y),
        ("model angle", model.pose.angle),
    ]
}

#[test]
fn the_default_network_lets_the_job_be_done() {
    let mut errors = Vec::new();
    for seed in SEEDS {
        let world = run(&over(WAN, seed), 20);
        for (name, value) in numbers(&world) {
            assert!(value.is_finite(), "seed {seed}: {name} is {value}");
        }
        let pushes = world.operator().pushes_completed().unwrap();
        assert!(pushes >= 2, "seed {seed}: {pushes} pushes in 20 s");
        let (start, truth) = (SlaveConfig::default().start.mass_kg, 0.7);
        let m = world.slave().estimate().m;
        assert!((start - truth).abs() > 0.4 * truth, "starts wrong");
        assert!(
            (m - truth).abs() <= 0.05 * truth,
            "seed {seed}: m is estimated as {m} kg"
        );
        errors.push(relative_error(&world));
    }
    let typical = median(errors.iter().copied()).unwrap();
    assert!(
        typical <= 0.2,
        "relative force error {typical:.3}, by seed {errors:.3?}"
    );
}

#[test]
fn without_updates_the_force_error_is_clearly_larger() {
    let mut silent = over(WAN, 2);
    silent.slave.trigger.scheme = "timer 60s".parse().unwrap();
    silent.slave.trigger.mismatch_debounce = Duration::from_secs(60);
    let (silent, informed) = (run(&silent, 20), run(&over(WAN, 2), 20));
    let updates = informed.outcome().updates.total();
    assert!(updates > 20, "{updates} updates");
    let (silent, informed) = (relative_error(&silent), relative_error(&informed));
    assert!(silent > 1.5 * informed, "{silent} without, {informed} with");
}

#[test]
fn paper_mode_runs_and_renders_worse_forces_than_recommended_mode() {
    for seed in [1, 2] {
        let recommended = run(&over(WAN, seed), 20);
        let mut config = over(WAN, seed);
        config.slave = SlaveConfig {
            seed,
            ..SlaveConfig::of_mode(Mode::Paper)
        };
        let paper = run(&config, 20);
        for (name, value) in numbers(&paper) {
            assert!(value.is_finite(), "seed {seed}: {name} is {value}");
        }
        let (paper, recommended) = (relative_error(&paper), relative_error(&recommended));
        assert!(
            paper > recommended,
            "seed {seed}: paper {paper}, recommended {recommended}"
        );
    }
}

/// Relative error of f_s against the force that the master rendered at the very stamp that the slave
/// plays, whether or not a sample of that stamp arrived: the report leaves out what was not a sample.
fn relative_error_at_the_stamps(config: &WorldConfig) -> f64 {
    let mut world = World::try_new(config).unwrap();
    let (mut felt, mut error, mut measured) = (Vec::new(), 0.0, 0.0);
    world.run(Duration::from_secs(20), |tick| {
        felt.push(tick.master.rendered.force);
        let Some(slave) = &tick.slave else { return };
        // the first tick is at one period
        let place = slave.stamp.saturating_since(Time::ZERO + TICK).as_millis();
        error += (slave.f_s - felt[place as usize]).norm_squared();
        measured += slave.f_s.norm_squared();
    });
    (error / measured).sqrt()
}

#[test]
fn a_play_out_delay_above_the_jitter_takes_the_force_error_of_jitter_away() {
    let error = |words, playout| {
        let mut config = over(words, 2);
        config.slave.playout = playout;
        config.samples_per_command = 1;
        relative_error_at_the_stamps(&config)
    };
    let newest_held = PlayoutConfig {
        delay_ms: 0.0,
        delay_max_ms: 0.0,
        extrapolation_ms: 0.0,
        ..PlayoutConfig::default()
    };
    let buffered = PlayoutConfig::for_packing_and_jitter(1, Duration::from_millis(20));
    // ±10 ms, in which packets overtake each other
    let jitter = "delay 50ms 10ms order free";
    let smooth = error("delay 50ms", newest_held);
    let (held, played) = (error(jitter, newest_held), error(jitter, buffered));
    assert!(held > 2.0 * smooth, "{held} with jitter, {smooth} without");
    assert!(played < 0.5 * held, "{played} played out, {held} held");
}

#[test]
fn one_configuration_is_one_run_to_the_bit_and_another_seed_is_another() {
    let digest = |seed| run(&over(WAN, seed), 5).digest();
    assert_eq!(digest(1), digest(1));
    assert_ne!(digest(1), digest(2));
}

#[test]
fn every_datagram_that_an_end_sent_was_received_or_lost_or_is_in_flight() {
    let mut world = run(&over("delay 50ms 5ms loss 5%", 3), 10);
    while world.down.in_flight() == 0 {
        world.step();
    }
    let up = (&world.up, world.master.channel(), world.slave.channel());
    let down = (&world.down, world.slave.channel(), world.master.channel());
    for (path, from, to) in [up, down] {
        let (sent, received) = (from.counts(), to.counts());
        let counters = path.counters();
        let lost = counters.dropped.total().packets;
        assert!(lost > 0 && path.in_flight() > 0, "the law has work to do");
        assert_eq!(sent.sent.total(), counters.offered.packets);
        assert_eq!(received.received.total(), counters.delivered.packets);
        assert_eq!(
            sent.sent.total(),
            received.received.total() + lost + path.in_flight() as u64
        );
        assert_eq!(received.dropped(), 0);
    }
}

#[test]
fn in_every_run_what_was_sent_arrived_or_was_lost_and_what_arrived_was_applied_or_dropped() {
    for (link, seed) in [
        ("delay 50ms 5ms", 1),
        ("delay 50ms 5ms loss 5%", 3),
        ("delay 1ms", 2),
    ] {
        let world = run(&over(link, seed), 10);
        let (master, slave) = (world.master.half(10.0), world.slave.half(10.0));
        let sent = slave.updates.sent.unwrap() + slave.updates.repeated.unwrap();
        assert_eq!(slave.session.sent.updates, Some(sent));
        let arrived = master.session.received.updates.unwrap();
        let dropped: u64 = master.updates.dropped.unwrap().values().sum();
        assert_eq!(master.updates.applied, Some(arrived - dropped), "{link}");
        let [down, gone] = [world.slave.channel(), world.master.channel()].map(|end| end.counts());
        let missing = down.sent.total() - gone.received.total();
        let lost = world.down.counters().dropped.total().packets + world.down.in_flight() as u64;
        assert_eq!(missing, lost, "{link}");
        assert!((arrived..=arrived + lost).contains(&sent), "{link}");
        let made =
            slave.session.drops["updates_superseded"] + slave.session.drops["updates_unsent"];
        assert_eq!(made, 0, "every tick sends");
    }
}

#[test]
fn loss_on_the_way_up_changes_no_draw_on_the_way_down() {
    // lost down in the world, lost down by a link of the same seed alone, lost up
    let lost_down = |up: &str| {
        let mut config = over(WAN, 4);
        config.up = link(up);
        let world = run(&config, 10);
        let counters = world.down.counters();
        let most = counters.offered.packets;
        let mut alone = mmt_netem::Link::try_new(link(WAN), 4, LinkId::DOWN).unwrap();
        for _ in 0..most {
            alone.offer(Time::ZERO, Packet::new(0, ()));
            while alone.poll(Time::MAX).is_some() {}
        }
        let expected = alone.counters().dropped.loss.packets;
        (
            counters.dropped.loss.packets,
            expected,
            world.up.counters().dropped.loss.packets,
        )
    };
    let (clean, faulty) = (
        lost_down("delay 50ms 5ms"),
        lost_down("delay 50ms 5ms loss 20%"),
    );
    assert_eq!((clean.2, faulty.2 > 100), (0, true), "loss up is on");
    assert_eq!(
        clean.0, clean.1,
        "down loses the packets that its own seed draws"
    );
    assert_eq!(faulty.0, faulty.1, "whatever happens on the way up");
}

mod delay;
mod hard;
#[cfg(test)]
mod still;

mod scenes;
mod sight;

#[test]
fn what_the_master_refuses_the_slaves_confirmed_shadow_never_takes_and_both_sides_count_it() {
    let config = over(WAN, 1);
    let mut world = World::try_new(&config).unwrap();
    // a device so stiff in damping that no estimate of the box is stable for it
    let coupling = Coupling {
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 300.0,
    };
    let welcome = Welcome {
        settings: config.slave.mode.model_settings(coupling),
        tool: Vec2::new(-0.45, 0.0),
        ..world.slave().welcome(Token::new([0; 32]), "any", "test")
    };
    let limiter = ForceLimiter::try_new(DeviceProfile::default().limits()).unwrap();
    let master = Master::new(&welcome, limiter);
    world.master = MasterEnd::new(Time::ZERO, master, config.commands());
    // the judges know the coupling that the slave got
    world.judges = false;
    world.run(Duration::from_secs(6), |_| {});
    let sent = world.outcome().updates.total();
    let drops = world.master.update_drops();
    assert!(sent > 5, "{sent} updates sent");
    assert!(drops.rejected > 5, "{drops:?}");
    let half = world.slave_end().half(6.0);
    let refused = half.session.drops["updates_unacknowledged"];
    assert!(refused > 5, "the slave counts {refused}");
    let newest = world.master.counts().newest_applied;
    assert!(u64::from(newest) < sent, "the last was refused");
    let shadow = world.slave().shadow();
    let confirmed = shadow.newest_confirmed();
    assert!(confirmed <= newest, "{confirmed} confirmed of {newest}");
    assert!(shadow.ahead().state() != shadow.confirmed().state());
    // the slave repeats what is not acknowledged
    let repeated = world.slave_end().counts().repeated.total();
    assert!(repeated > 0, "{repeated} repeats");
}
