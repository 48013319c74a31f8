//! An object that nobody touches: it coasts, rests, and is carried off.

use super::*;
use mmt_shared::rng::Substream;

/// Lets go of a box that was pushed at 0.1 m/s and coasts against less friction than is believed; vision looks every
/// 33 ms, 30 ms late, or not at all. How far off the pose is after 100, 200 and 400 ms, m.
fn off_while_coasting(seen: bool) -> [f64; 3] {
    let mut observer = observer(true);
    let mut truth = push(&mut observer, 1000, 0.0);
    let mut images = std::collections::VecDeque::new();
    let mut speed = 0.1_f64;
    let mut off = [0.0; 3];
    for n in 1001..=1400_u32 {
        // 2.06 N over 0.7 kg would stop it within 35 ms
        speed = (speed - 0.2 * TICK_S).max(0.0);
        truth.position.x += speed * TICK_S;
        let now = Time::ZERO + TICK * n;
        observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
        if n % 33 == 0 {
            images.push_back(VisionSample {
                taken: now,
                pose: truth,
            });
        }
        let due = |image: &VisionSample| image.taken + TICK * 30 <= now;
        if let Some(image) = images.pop_front_if(|image| due(image)).filter(|_| seen) {
            observer.see(&image);
        }
        if let Some(k) = [1100, 1200, 1400].iter().position(|at| *at == n) {
            off[k] = (observer.pose().position - truth.position).norm();
        }
    }
    off
}

#[test]
fn images_show_how_fast_a_box_coasts_that_was_taken_to_stop() {
    let [unseen, seen] = [false, true].map(off_while_coasting);
    assert!(unseen[2] > 0.02, "the effect exists: {unseen:?}");
    for (seen, unseen, share) in [
        (seen[0], unseen[0], 0.7),
        (seen[1], unseen[1], 0.4),
        (seen[2], unseen[2], 0.2),
    ] {
        assert!(seen < share * unseen, "{seen} m of {unseen} m");
    }
}

#[test]
fn images_correct_the_speed_of_a_box_that_coasts() {
    let mut observer = observer(true);
    let mut truth = push(&mut observer, 1000, 0.0);
    let slippery = ModelParams::of_square(0.7, 0.0, 0.0, 0.36, &COUPLING).unwrap();
    let speed = 0.15;
    for n in 1001..=1400_u32 {
        truth.position.x += speed * TICK_S;
        let now = Time::ZERO + TICK * n;
        observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &slippery);
        if n == 1001 {
            let believed = observer.twist().linear.x;
            assert!(believed < 0.11, "the effect exists: {believed} m/s");
        }
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: truth,
            });
        }
    }
    let found = observer.twist().linear.x;
    assert!((found - speed).abs() < 0.01, "{found} m/s of {speed} m/s");
}

#[test]
fn a_box_at_rest_is_known_better_with_every_image_and_what_was_seen_counts_once() {
    let mut observer = observer(true);
    let deviation = observer.deviation();
    for n in 1..=330_u32 {
        let now = Time::ZERO + TICK * n;
        observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
        // each image is 100 ms late, so three are on their way
        if n % 33 == 0 && n > 100 {
            observer.see(&VisionSample {
                taken: Time::ZERO + TICK * (n - 100),
                pose: Pose::new(1e-3, 0.0, 0.0),
            });
        }
    }
    let off = (observer.pose().position - Vec2::new(1e-3, 0.0)).norm();
    assert!(off < 0.3e-3, "{off} m");
    assert!(observer.deviation() < 0.5 * deviation);
}

/// Lets go of a box that was pushed at 0.1 m/s, and shows it every 33 ms, with the noise of the images, while `moved` moves it: from
/// the place where it was let go to the returned one (m), so many ms after that. What is then known of it.
fn seen_at_rest(ms: u32, moved: impl Fn(u32) -> f64) -> (PoseObserver, Vec2) {
    let mut observer = observer(true);
    let mut truth = push(&mut observer, 1000, 0.0);
    let let_go = truth.position;
    let mut random = Substream::new(7, "images", 0);
    for n in 1..=ms {
        truth.position = let_go + Vec2::new(moved(n), 0.0);
        let now = Time::ZERO + TICK * (1000 + n);
        observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
        if n % 33 == 0 {
            let mut noise = || random.normal();
            observer.see(&VisionSample {
                taken: now,
                pose: Pose::new(
                    truth.position.x + 1e-3 * noise(),
                    truth.position.y + 1e-3 * noise(),
                    5e-3 * noise(),
                ),
            });
        }
    }
    let off = observer.pose().position - truth.position;
    (observer, off)
}

#[test]
fn a_box_that_was_let_go_and_rests_is_known_better_with_every_image() {
    for ms in [1000, 2000, 4000] {
        let (observer, off) = seen_at_rest(ms, |_| 0.0);
        // so many images, each of 1 mm and 5 mrad
        let share = (f64::from(ms) / 33.0).sqrt().recip();
        let deviation = observer.deviation();
        assert!(deviation < 1.2e-3 * share, "{ms} ms: {deviation} m");
        let angle = observer.angle_deviation();
        assert!(angle < 6e-3 * share, "{ms} ms: {angle} rad");
        let off = off.norm();
        assert!(off < 3.0 * deviation, "{ms} ms: {off} m");
    }
}

#[test]
fn a_box_that_somebody_carries_off_from_where_it_rested_is_followed() {
    // 25 mm in half a second, after two seconds at rest
    let carried = |n: u32| 5e-5 * f64::from(n.clamp(2000, 2500) - 2000);
    let (_, off) = seen_at_rest(2500, carried);
    assert!(off.norm() < 6e-3, "on its way: {} m", off.norm());
    let (observer, off) = seen_at_rest(4000, carried);
    assert!(off.norm() < 0.6e-3, "at rest again: {} m", off.norm());
    assert!(observer.deviation() < 0.25e-3);
}
