//! No input breaks what a decoder or a file reader promises, and no sequence of operations what a session promises.
//!
//! The targets are those of `mmt_tests::fuzz`. An ordinary test run takes a million inputs over all decoders and ten thousand
//! sequences; `.ci/fuzz` runs the same at length. `MMT_FUZZ_INPUTS`, `MMT_FUZZ_SEQUENCES`, `MMT_FUZZ_SEED`, `MMT_FUZZ_THREADS`
//! and `MMT_FUZZ_TARGETS` (names with commas between) change the extent, `MMT_FUZZ_TABLE` names a file for the table.
//! `MMT_FUZZ_CAREFUL` keeps each input in a file before it is run, for what ends the process. The result depends on seed and
//! extent, and not on the threads.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::disallowed_macros,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stderr,
    reason = "a test reads files, its environment and a clock, and may panic"
)]

mod counting_allocator;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use mmt_tests::fuzz::{Failure, Mutator, Outcome, Plan, Ran, TARGETS, Target, Watch, drive};

use counting_allocator::peak_of;

/// Inputs over all decoders, and sequences of the session, where nobody asks for others.
const INPUTS: u64 = 1_000_000;
const SEQUENCES: u64 = 10_000;
/// Inputs of a target that run one after the other, each beginning with its seeds.
const SHARD: u64 = 200_000;
const SHARD_OF_SEQUENCES: u64 = 5000;

fn asked(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.replace('_', "").parse().unwrap())
}

fn wants(target: &Target) -> bool {
    std::env::var("MMT_FUZZ_TARGETS").map_or(true, |names| {
        names.split(',').any(|name| name == target.name)
    })
}

/// A file below the folder for what tests leave.
fn left(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn careful(target: &'static str, input: &[u8]) {
    std::fs::write(left(&format!("fuzz-{target}-last")), input).unwrap();
}

fn watch() -> Watch {
    let before = if std::env::var("MMT_FUZZ_CAREFUL").is_ok() {
        careful
    } else {
        |_, _: &[u8]| ()
    };
    Watch {
        before,
        measured: peak_of,
    }
}

/// The inputs of a target that are kept in the repository, with their files.
fn kept(target: &Target) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target.name);
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
        .into_iter()
        .map(|file| (file.clone(), std::fs::read(file).unwrap()))
        .collect()
}

/// Keeps an input that failed, and names the command that runs it again.
fn told(failure: &Failure) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    failure
        .input
        .iter()
        .for_each(|byte| hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    let path = left(&format!("fuzz-{}-{hash:016x}", failure.target));
    std::fs::write(&path, &failure.input).unwrap();
    let again = "cargo test -p mmt-tests --test fuzz -- every_input_that_is_kept_holds";
    format!(
        "{failure}\nagain: MMT_FUZZ_INPUT={}={} {again}\n",
        failure.target,
        path.display()
    )
}

/// A part of a target's inputs.
struct Part {
    target: Target,
    plan: Plan,
}

/// What all parts of a target came to, and the seconds that they took, of one core.
struct Row {
    target: Target,
    ran: Ran,
    seconds: f64,
}

/// The parts of all these inputs.
fn parts(targets: &[Target], inputs: u64, shard: u64) -> Vec<Part> {
    let seed = asked("MMT_FUZZ_SEED", 1);
    let shares: u64 = targets
        .iter()
        .map(|target| u64::from(target.share.max(1)))
        .sum();
    let mut parts = Vec::new();
    for target in targets {
        let mut left = (inputs * u64::from(target.share.max(1))).div_ceil(shares);
        for number in 0.. {
            let inputs = left.min(shard);
            left -= inputs;
            parts.push(Part {
                target: *target,
                plan: Plan {
                    seed,
                    shard: number,
                    inputs,
                },
            });
            if left == 0 {
                break;
            }
        }
    }
    parts
}

/// Runs all parts, on as many threads as were asked for; what failed is told.
fn run(parts: Vec<Part>) -> (Vec<Row>, Vec<String>) {
    let threads = asked("MMT_FUZZ_THREADS", 1);
    let rows: Mutex<Vec<Row>> = Mutex::default();
    let failures: Mutex<Vec<String>> = Mutex::default();
    let parts = Mutex::new(parts.into_iter());
    let work = || {
        loop {
            let Some(Part { target, plan }) = parts.lock().unwrap().next() else {
                return;
            };
            let known: Vec<Vec<u8>> = kept(&target).into_iter().map(|(_, input)| input).collect();
            let began = Instant::now();
            let ran = drive(&target, &plan, &known, &watch());
            let seconds = began.elapsed().as_secs_f64();
            let ran = ran.unwrap_or_else(|failure| {
                let told = told(&failure);
                eprintln!("{told}");
                failures.lock().unwrap().push(told);
                Ran::default()
            });
            let mut rows = rows.lock().unwrap();
            match rows.iter_mut().find(|row| row.target.name == target.name) {
                Some(row) => (row.ran, row.seconds) = (row.ran.plus(ran), row.seconds + seconds),
                None => rows.push(Row {
                    target,
                    ran,
                    seconds,
                }),
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            // sequences go deep in a build that is hardly optimized
            std::thread::Builder::new()
                .stack_size(16 << 20)
                .spawn_scoped(scope, work)
                .unwrap();
        }
    });
    let mut rows = rows.into_inner().unwrap();
    let place = |row: &Row| {
        TARGETS
            .iter()
            .position(|target| target.name == row.target.name)
    };
    rows.sort_by_key(place);
    (rows, failures.into_inner().unwrap())
}

/// The table of what ran, as other tables of the project are written.
fn table(title: &str, rows: &[Row]) -> String {
    let head = [
        "target", "inputs", "seconds", "accepted", "refused", "sorts", "peak_kb",
    ]
    .map(str::to_owned);
    let mut lines = vec![head];
    let of = |name: &str, ran: &Ran, seconds: f64| {
        let numbers = [
            ran.accepted,
            ran.refused,
            ran.marks,
            ran.peak.div_ceil(1024),
        ]
        .map(|number| number.to_string());
        let [accepted, refused, sorts, peak] = numbers;
        [
            name.to_owned(),
            ran.inputs().to_string(),
            format!("{seconds:.0}"),
            accepted,
            refused,
            sorts,
            peak,
        ]
    };
    lines.extend(
        rows.iter()
            .map(|row| of(row.target.name, &row.ran, row.seconds)),
    );
    if rows.len() > 1 {
        let sum = rows
            .iter()
            .fold(Ran::default(), |sum, row| sum.plus(row.ran));
        lines.push(of("all", &sum, rows.iter().map(|row| row.seconds).sum()));
    }
    let width = |column: usize| lines.iter().map(|line| line[column].len()).max().unwrap();
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let mut text = format!("{title}\n");
    for line in &lines {
        let cells =
            line.iter()
                .zip(&widths)
                .enumerate()
                .map(|(column, (cell, width))| match column {
                    0 => format!("{cell:<width$}"),
                    _ => format!("{cell:>width$}"),
                });
        // a row of the table
        let _ = writeln!(text, "  {}", cells.collect::<Vec<_>>().join("   "));
    }
    text
}

fn show(title: &str, rows: &[Row]) {
    if rows.is_empty() {
        return;
    }
    let table = table(title, rows);
    eprintln!("{table}");
    if let Ok(path) = std::env::var("MMT_FUZZ_TABLE") {
        let before = std::fs::read_to_string(&path).unwrap_or_default();
        std::fs::write(path, format!("{before}{table}\n")).unwrap();
    }
}

#[test]
fn no_input_breaks_the_promise_of_a_decoder_or_a_file_reader() {
    let targets: Vec<Target> = TARGETS
        .iter()
        .filter(|target| !target.is_session() && wants(target))
        .copied()
        .collect();
    let (rows, failures) = run(parts(&targets, asked("MMT_FUZZ_INPUTS", INPUTS), SHARD));
    show("Inputs of every decoder and file reader", &rows);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    // every target has inputs of both kinds
    for row in &rows {
        assert!(
            row.ran.accepted > 0 && row.ran.refused > 0,
            "{}: {:?}",
            row.target.name,
            row.ran
        );
    }
}

#[test]
fn no_sequence_of_operations_breaks_the_promise_of_a_session() {
    let targets: Vec<Target> = TARGETS
        .iter()
        .filter(|target| target.is_session() && wants(target))
        .copied()
        .collect();
    let (rows, failures) = run(parts(
        &targets,
        asked("MMT_FUZZ_SEQUENCES", SEQUENCES),
        SHARD_OF_SEQUENCES,
    ));
    show("Sequences of operations on a session", &rows);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Those that once broke a promise among them; and one of your own, `MMT_FUZZ_INPUT=TARGET=FILE`.
#[test]
fn every_input_that_is_kept_holds() {
    let mut wrong = Vec::new();
    let mut judge = |target: &Target, file: &Path, input: Vec<u8>| {
        let plan = Plan {
            seed: 1,
            shard: 0,
            inputs: 1,
        };
        let alone = Target {
            seeds: Vec::new,
            ..*target
        };
        match drive(&alone, &plan, &[input], &watch()) {
            Ok(ran) => eprintln!(
                "{} {}: {}",
                target.name,
                file.display(),
                if ran.accepted > 0 {
                    "accepted"
                } else {
                    "refused"
                }
            ),
            Err(failure) => wrong.push(format!("{}: {failure}", file.display())),
        }
    };
    for target in TARGETS {
        kept(target)
            .into_iter()
            .for_each(|(file, input)| judge(target, &file, input));
    }
    if let Ok(own) = std::env::var("MMT_FUZZ_INPUT") {
        let (name, file) = own.split_once('=').unwrap();
        let target = Target::named(name).unwrap();
        judge(&target, Path::new(file), std::fs::read(file).unwrap());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn valid_inputs_are_taken_by_every_target() {
    let mut wrong = Vec::new();
    for target in TARGETS {
        let seeds = (target.seeds)();
        let plan = Plan {
            seed: 1,
            shard: 0,
            inputs: seeds.len() as u64,
        };
        match drive(target, &plan, &[], &watch()) {
            Ok(ran) if ran.accepted > 0 => {}
            Ok(ran) => wrong.push(format!("{}: {ran:?}", target.name)),
            Err(failure) => wrong.push(failure.to_string()),
        }
        let longest = seeds.iter().map(Vec::len).max().unwrap_or_default();
        if longest > target.longest {
            wrong.push(format!("{}: a seed of {longest} bytes", target.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A reader of numbers with a fault: what is subnormal it does not bear.
fn faulty(input: &[u8]) -> Outcome {
    let text = std::str::from_utf8(input).unwrap_or_default();
    let Ok(number) = text.trim().parse::<f64>() else {
        return Outcome::refused(&"no number");
    };
    assert!(!number.is_subnormal(), "{number} is too small");
    Outcome::taken(0)
}

const FAULTY: Target = Target {
    name: "faulty",
    about: "a fault",
    run: faulty,
    seeds: || vec![b"12.5".to_vec()],
    words: &[],
    longest: 100,
    share: 1,
    room_kb: 64,
};

const UNWATCHED: Watch = Watch {
    before: |_, _| (),
    measured: |work| {
        work();
        0
    },
};

#[test]
fn a_planted_fault_is_found_and_its_input_fails_again() {
    let plan = Plan {
        seed: 1,
        shard: 0,
        inputs: 100_000,
    };
    let failure = drive(&FAULTY, &plan, &[], &UNWATCHED).unwrap_err();
    assert!(failure.why.contains("too small"), "{failure}");
    assert_eq!(drive(&FAULTY, &plan, &[], &UNWATCHED).unwrap_err(), failure);
    let alone = Plan { inputs: 2, ..plan };
    let again = drive(&FAULTY, &alone, &[failure.input], &UNWATCHED);
    assert_eq!(again.unwrap_err().number, 2);
}

#[test]
fn memory_out_of_proportion_is_a_failure_and_what_is_taken_is_counted() {
    let plan = Plan {
        seed: 1,
        shard: 0,
        inputs: 1,
    };
    let greedy = |_: &[u8]| {
        assert_eq!(vec![7_u8; 1 << 20].iter().max(), Some(&7));
        Outcome::taken(0)
    };
    let greedy = drive(
        &Target {
            run: greedy,
            ..FAULTY
        },
        &plan,
        &[],
        &watch(),
    );
    assert!(greedy.unwrap_err().why.contains("memory"));
    let ran = drive(
        &FAULTY,
        &Plan { inputs: 20, ..plan },
        &[b"x".to_vec()],
        &watch(),
    )
    .unwrap();
    assert_eq!(ran.inputs(), 20);
    assert!(ran.accepted > 0 && ran.refused > 0 && ran.marks == 2);
    assert_eq!(
        drive(
            &FAULTY,
            &Plan { inputs: 20, ..plan },
            &[b"x".to_vec()],
            &watch()
        ),
        Ok(ran)
    );
}

fn mutated(shard: u64, pool: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let mut mutator = Mutator::new(1, "test", shard, &["word"], 200);
    let mut out = Vec::new();
    let mut next = || {
        mutator.next(pool, &[0], &mut out);
        out.clone()
    };
    (0..20_000).map(|_| next()).collect()
}

#[test]
fn mutations_are_a_function_of_seed_name_and_shard_and_keep_to_their_length() {
    let pool = [b"delay 50ms 5.5ms".to_vec(), vec![7; 64], Vec::new()];
    let first = mutated(0, &pool);
    assert_eq!(first, mutated(0, &pool));
    assert_ne!(first, mutated(1, &pool));
    assert!(first.iter().all(|input| input.len() <= 200));
}

#[test]
fn subnormals_words_varints_and_changes_of_several_bytes_are_among_the_mutations() {
    let pool = [b"delay 50ms 5.5ms".to_vec(), vec![7; 64]];
    let inputs = mutated(0, &pool);
    let holds = |part: &[u8]| {
        inputs
            .iter()
            .any(|input| input.windows(part.len()).any(|window| window == part))
    };
    for part in [
        &5e-324_f64.to_le_bytes()[..],
        &f64::NAN.to_le_bytes(),
        &(-0.0_f64).to_le_bytes(),
        &f64::MAX.to_le_bytes(),
        b"word",
        &[0xff, 0xff, 0xff, 0xff, 0x0f],
        b"5e-324ms",
        "🦀".as_bytes(),
    ] {
        assert!(holds(part), "{part:?}");
    }
    let subnormal = |input: &Vec<u8>| {
        let doubles = input
            .chunks_exact(8)
            .map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap()));
        doubles.filter(|double| double.is_subnormal()).count()
    };
    assert!(inputs.iter().map(subnormal).sum::<usize>() > 100);
    let differing =
        |input: &&Vec<u8>| input.len() == 64 && input.iter().filter(|byte| **byte != 7).count() > 4;
    assert!(inputs.iter().filter(differing).count() > 500);
}
