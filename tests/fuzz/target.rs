//! The targets of `mmt_tests::fuzz` under libFuzzer; `MMT_FUZZ_TARGET` names the one that runs.
//!
//! With `MMT_FUZZ_SEEDS` it runs none: it writes the seeds and the words of all of them to that folder and prints a
//! line each, with name and longest input.
#![no_main]

use std::io::Write as _;
use std::path::Path;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use mmt_tests::fuzz::{TARGETS, Target};

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("MMT_FUZZ_TARGET").unwrap_or_default();
    let names = || {
        TARGETS
            .iter()
            .map(|target| target.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    Target::named(&name)
        .unwrap_or_else(|| panic!("MMT_FUZZ_TARGET is {name:?}, not one of {}", names()))
});

fuzz_target!(
    init: {
        if let Ok(folder) = std::env::var("MMT_FUZZ_SEEDS") {
            for target in TARGETS {
                write(target, Path::new(&folder)).unwrap();
                println!("{} {}", target.name, target.longest);
            }
            std::process::exit(0);
        }
        LazyLock::force(&TARGET);
    },
    |input: &[u8]| {
        (TARGET.run)(input);
    }
);

/// Writes the seeds of a target as libFuzzer's corpus and its words as a dictionary.
fn write(target: &Target, folder: &Path) -> std::io::Result<()> {
    let seeds = folder.join(target.name);
    std::fs::create_dir_all(&seeds)?;
    for (number, seed) in (target.seeds)().iter().enumerate() {
        std::fs::write(seeds.join(format!("seed-{number}")), seed)?;
    }
    let mut words = std::fs::File::create(folder.join(format!("{}.dict", target.name)))?;
    for word in target.words {
        let bytes: String = word.bytes().map(|byte| format!("\\x{byte:02x}")).collect();
        writeln!(words, "\"{bytes}\"")?;
    }
    Ok(())
}
