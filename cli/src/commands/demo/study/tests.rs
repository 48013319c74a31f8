//! What a study keeps: order and balance, codes, and what a cut leaves.

use super::*;

const TEXTS: [(&str, &str); 2] = [("A.toml", "seed = 1\n"), ("B.toml", "seed = 2\n")];

fn answer(record: &Path) -> Answer<'_> {
    Answer {
        answer: 5,
        configuration: Path::new("configurations/near,far.toml"),
        duration_s: 20.0,
        record,
        now_unix_s: 7,
    }
}

#[test]
fn orders_are_balanced_over_who_began_however_often_the_program_is_started() {
    let folder = tempfile::tempdir().unwrap();
    let mut codes = BTreeSet::new();
    for _ in 0..20 {
        let mut study = Study::open(folder.path(), &TEXTS).unwrap();
        let entered = study.enter(1).unwrap();
        assert_eq!(entered.code.len(), CODE);
        assert!(codes.insert(entered.code), "a code twice");
        let had = |order| {
            study
                .participants
                .iter()
                .filter(|one| one.order == order)
                .count()
        };
        assert!(had(ORDERS[0].1).abs_diff(had(ORDERS[1].1)) <= 1);
    }
    let study = Study::open(folder.path(), &TEXTS).unwrap();
    let first = |order| {
        study
            .participants
            .iter()
            .filter(|one| one.order == order)
            .count()
    };
    assert_eq!((first(ORDERS[0].1), first(ORDERS[1].1)), (10, 10));
}

#[test]
fn a_code_that_is_taken_is_not_given_again() {
    let drawn = "00112233445566778899aabbccddeeff";
    let (first, coin) = code(drawn, &BTreeSet::new());
    let (second, _) = code(drawn, &BTreeSet::from([first.as_str()]));
    assert!(coin && first != second && second.len() == CODE);
}

#[test]
fn a_study_that_was_cut_off_goes_on_where_it_was_and_loses_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let mut study = Study::open(folder.path(), &TEXTS).unwrap();
    let mut who = study.enter(1).unwrap();
    let record = study.record(&who);
    assert!(record.ends_with(format!("records/{}-1.mcap", who.code)));
    std::fs::write(&record, "").unwrap();
    assert!(
        study
            .record(&who)
            .ends_with(format!("records/{}-1-2.mcap", who.code))
    );
    study.keep(&mut who, answer(&record)).unwrap();
    // the program ends here, in the middle of the second answer
    let results = folder.path().join("results.csv");
    let before = std::fs::read_to_string(&results).unwrap();
    let torn = format!("{before}{},B,near", who.code);
    std::fs::write(&results, torn).unwrap();

    let mut study = Study::open(folder.path(), &TEXTS).unwrap();
    let mut open = study.unfinished().unwrap().clone();
    assert_eq!(
        (open.code.as_str(), open.order, open.answered),
        (who.code.as_str(), who.order, 1)
    );
    assert_eq!(open.next(), Some(who.order[1]));
    study.keep(&mut open, answer(&record)).unwrap();
    assert_eq!((open.next(), study.whole()), (None, 1));
    assert!(study.unfinished().is_none());
    let after = std::fs::read_to_string(&results).unwrap();
    assert!(
        after.starts_with(&before) && after.lines().count() == 3,
        "{after}"
    );
    let study = Study::open(folder.path(), &TEXTS).unwrap();
    assert!(study.unfinished().is_none() && study.whole() == 1);
    for line in after.lines() {
        assert_eq!(line.split(',').count(), 8, "{line}");
    }
}

#[test]
fn a_folder_of_another_study_is_refused_and_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    Study::open(folder.path(), &TEXTS).unwrap();
    let other = [("A.toml", "seed = 3\n")];
    let error = Study::open(folder.path(), &other).unwrap_err();
    assert!(error.to_string().contains("another study"), "{error}");
    let there = std::fs::read_to_string(folder.path().join("A.toml")).unwrap();
    assert_eq!(there, "seed = 1\n");
}
