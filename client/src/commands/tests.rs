//! What a command holds: new samples, repeats, and what congestion leaves of both.

use super::*;
use mmt_shared::model::sample::HipCounts;
use mmt_shared::time::Time;

fn sample(ms: u64) -> HipSample {
    let hip = HipCounts { x: ms as i32, y: 0 };
    HipSample {
        stamp: Time::from_millis(ms),
        hip,
        ..HipSample::default()
    }
}

fn packer(samples_per_command: u8, repeat_samples: u8) -> CommandPacker {
    CommandPacker::new(CommandConfig {
        samples_per_command,
        repeat_samples,
        ..CommandConfig::default()
    })
}

/// The stamps (ms) of each command that the samples of `ms` make.
fn commands(packer: &mut CommandPacker, ms: impl IntoIterator<Item = u64>) -> Vec<Vec<u64>> {
    stretched(packer, ms, 1.0)
}

/// The same at this stretch.
fn stretched(
    packer: &mut CommandPacker,
    ms: impl IntoIterator<Item = u64>,
    stretch: f64,
) -> Vec<Vec<u64>> {
    let stamp = |sample: &HipSample| {
        let ms = sample.stamp.as_nanos() / 1_000_000;
        assert_eq!(sample.hip.x as u64, ms, "never in another form");
        ms
    };
    ms.into_iter()
        .filter_map(|ms| {
            packer.push(sample(ms), stretch);
            packer.take_full(stretch)
        })
        .map(|samples| samples.as_slice().iter().map(stamp).collect())
        .collect()
}

#[test]
fn a_command_repeats_the_samples_of_as_many_commands_as_it_is_configured_for() {
    let none = commands(&mut packer(3, 0), 1..=9);
    assert_eq!(none, [[1, 2, 3], [4, 5, 6], [7, 8, 9]]);
    let one = commands(&mut packer(3, 1), 1..=9);
    assert_eq!(one, [vec![1, 2, 3], (1..=6).collect(), (4..=9).collect()]);
    let two = commands(&mut packer(2, 2), 1..=8);
    assert_eq!(
        two[1..],
        [vec![1, 2, 3, 4], (1..=6).collect(), (3..=8).collect()]
    );
}

#[test]
fn where_the_hand_feels_the_tool_each_sample_goes_alone() {
    let default = CommandConfig::default();
    let tdpa = CommandConfig {
        repeat_samples: 1,
        ..default
    }
    .for_architecture(Architecture::Tdpa);
    let alone = commands(&mut CommandPacker::new(tdpa), 1..=4);
    assert_eq!(alone, [[1], [2], [3], [4]]);
    assert_eq!(default.for_architecture(Architecture::Mmt), default);
}

#[test]
fn a_command_holds_its_new_samples_and_as_many_repeats_as_there_is_room_for() {
    let full = commands(&mut packer(32, 1), 1..=64);
    assert_eq!(full[1], (33..=64).collect::<Vec<_>>());
    let most = commands(&mut packer(20, 1), 1..=60);
    assert_eq!(
        most[2],
        (29..=60).collect::<Vec<_>>(),
        "twelve repeats and twenty new ones"
    );
    assert_eq!(packer(20, 1).config.samples_at_most(), 32);
    assert_eq!(packer(10, 1).config.samples_at_most(), 20);
}

#[test]
fn stamps_that_go_back_are_new_and_leave_no_mixed_command() {
    let mut packer = packer(2, 1);
    let all = commands(&mut packer, [5, 6, 3, 4, 7, 8]);
    // 3 and 4 begin a command that the stamps before do not fit
    assert_eq!(all, [vec![5, 6], vec![3, 4], vec![3, 4, 7, 8]]);
}

#[test]
fn a_stamp_off_the_grid_begins_a_new_command_and_does_not_end_them() {
    let mut packer = packer(3, 0);
    let mut made = Vec::new();
    for ms in 1..=2 {
        packer.push(sample(ms), 1.0);
    }
    for ms in 3..=8 {
        let mut late = sample(ms);
        late.stamp = late.stamp.offset_by(37_000);
        packer.push(late, 1.0);
        made.extend(packer.take_full(1.0));
    }
    assert_eq!(made.len(), 2);
    assert!(packer.drops().contains(&("samples_off_grid", 2)));
}

#[test]
fn congestion_spaces_the_samples_leaves_the_repeats_out_and_goes() {
    let mut packer = packer(3, 1);
    assert_eq!(commands(&mut packer, 1..=3).len(), 1);
    let all = stretched(&mut packer, 3000..=3020, 3.0);
    // the first sample of the stretch is packed, then every third
    assert_eq!(all, [vec![3000, 3003, 3006], vec![3009, 3012, 3015]]);
    assert_eq!(packer.skipped, 14);
    let all = commands(&mut packer, 20_000..=20_010);
    assert_eq!(all.last().unwrap().len(), 6, "repeats are back");
}
