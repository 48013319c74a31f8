//! The folder of a blind comparison: who takes part, in which order, and what was answered.
//!
//! Every line is appended and on the disk before the study goes on, so that a program that ends at any moment loses nothing:
//! what is open is gone on with. Nothing names a person.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use mmt_shared::pairing::Token;

/// First line of the participants.
const PARTICIPANTS: &str = "participant,order,began_unix_s";
/// First line of the results.
const RESULTS: &str =
    "participant,condition,configuration,part,answer,duration_s,record,answered_unix_s";
/// What codes are made of: no letter that looks like a number.
const LETTERS: &[u8; 32] = b"ABCDEFGHJKLMNPQRSTUVWXYZ23456789";
/// Letters of a code.
const CODE: usize = 5;

/// One of the two configurations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    /// The first that was named.
    A,
    /// The second.
    B,
}

impl Condition {
    /// Its name in files.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// The order in which a participant meets them.
const ORDERS: [(&str, [Condition; 2]); 2] = [
    ("AB", [Condition::A, Condition::B]),
    ("BA", [Condition::B, Condition::A]),
];

/// Somebody who takes part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Participant {
    /// Drawn, and known to nobody else.
    pub(super) code: String,
    /// What they meet first and then.
    pub(super) order: [Condition; 2],
    /// Parts that they have answered.
    pub(super) answered: usize,
}

impl Participant {
    /// The condition of the part that comes; none if both are answered.
    pub(super) fn next(&self) -> Option<Condition> {
        self.order.get(self.answered).copied()
    }
}

/// An answer to a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer<'a> {
    /// 1 to 7.
    pub(super) answer: u8,
    /// The file of the condition.
    pub(super) configuration: &'a Path,
    /// How long the box was pushed, s.
    pub(super) duration_s: f64,
    /// The part's record.
    pub(super) record: &'a Path,
    /// Seconds since 1970.
    pub(super) now_unix_s: u64,
}

/// A study's folder.
#[derive(Debug)]
pub(super) struct Study {
    folder: PathBuf,
    participants: Vec<Participant>,
}

impl Study {
    /// Opens a folder, or makes one, for a study with these texts: its configurations, its consent and its question.
    ///
    /// # Errors
    /// It cannot be read or written, or it holds a study with other texts.
    pub(super) fn open(folder: &Path, texts: &[(&str, &str)]) -> io::Result<Self> {
        std::fs::create_dir_all(folder.join("records"))?;
        for (name, text) in texts {
            keep(&folder.join(name), text)?;
        }
        let mut study = Self {
            folder: folder.to_owned(),
            participants: Vec::new(),
        };
        for line in lines(&study.file("participants.csv"), PARTICIPANTS)? {
            study.participants.extend(participant(&line));
        }
        for line in lines(&study.file("results.csv"), RESULTS)? {
            let code = line.split(',').next().unwrap_or_default();
            let whole = line.split(',').count() == RESULTS.split(',').count();
            let who = study.participants.iter_mut().find(|one| one.code == code);
            if let Some(who) = who.filter(|_| whole) {
                who.answered += 1;
            }
        }
        Ok(study)
    }

    /// Who began last and has not answered both parts.
    pub(super) fn unfinished(&self) -> Option<&Participant> {
        let last = self.participants.last()?;
        last.next().is_some().then_some(last)
    }

    /// How many have answered both parts.
    pub(super) fn whole(&self) -> usize {
        let whole = self.participants.iter().filter(|one| one.next().is_none());
        whole.count()
    }

    /// Somebody new, in the order that fewer have had; where both have been as often the code decides.
    ///
    /// # Errors
    /// It cannot be written, or there is no randomness.
    pub(super) fn enter(&mut self, now_unix_s: u64) -> io::Result<Participant> {
        let drawn = Token::generate().map_err(io::Error::other)?;
        let (code, coin) = code(&drawn.reveal().to_string(), &self.codes());
        let had = |order| {
            self.participants
                .iter()
                .filter(|one| one.order == order)
                .count()
        };
        let [first, second] = ORDERS;
        let is_second = match had(first.1).cmp(&had(second.1)) {
            std::cmp::Ordering::Less => false,
            std::cmp::Ordering::Greater => true,
            std::cmp::Ordering::Equal => coin,
        };
        let (name, order) = if is_second { second } else { first };
        append(
            &self.file("participants.csv"),
            &format!("{code},{name},{now_unix_s}"),
        )?;
        let entered = Participant {
            code,
            order,
            answered: 0,
        };
        self.participants.push(entered.clone());
        Ok(entered)
    }

    /// Keeps the answer to the participant's next part.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn keep(&mut self, who: &mut Participant, answer: Answer) -> io::Result<()> {
        let Some(condition) = who.next() else {
            return Ok(());
        };
        let configuration = answer.configuration.file_name().unwrap_or_default();
        let configuration = configuration
            .to_string_lossy()
            .replace([',', '"', '\n'], "_");
        let record = answer.record.file_name().unwrap_or_default();
        let line = format!(
            "{},{},{configuration},{},{},{:.1},records/{},{}",
            who.code,
            condition.name(),
            who.answered + 1,
            answer.answer,
            answer.duration_s,
            record.to_string_lossy(),
            answer.now_unix_s
        );
        append(&self.file("results.csv"), &line)?;
        who.answered += 1;
        let known = self
            .participants
            .iter_mut()
            .find(|one| one.code == who.code);
        if let Some(known) = known {
            known.answered = who.answered;
        }
        Ok(())
    }

    /// A file for the record of the participant's next part that is not there yet. Its name does not show the condition.
    pub(super) fn record(&self, who: &Participant) -> PathBuf {
        let name = format!("{}-{}", who.code, who.answered + 1);
        let folder = self.folder.join("records");
        let again = (2..).map(|n| folder.join(format!("{name}-{n}.mcap")));
        let mut names = std::iter::once(folder.join(format!("{name}.mcap"))).chain(again);
        names.find(|path| !path.exists()).unwrap_or(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn codes(&self) -> BTreeSet<&str> {
        let codes = self.participants.iter().map(|one| one.code.as_str());
        codes.collect()
    }
}

/// A code that is not taken and a coin, of hexadecimal digits that were drawn.
fn code(drawn: &str, taken: &BTreeSet<&str>) -> (String, bool) {
    let digits: Vec<usize> = drawn
        .chars()
        .filter_map(|digit| Some(digit.to_digit(16)? as usize))
        .collect();
    let letters: Vec<char> = digits
        .chunks_exact(2)
        .filter_map(|pair| LETTERS.get((pair.first()? * 16 + pair.last()?) % LETTERS.len()))
        .map(|letter| char::from(*letter))
        .collect();
    let codes = letters
        .windows(CODE)
        .map(|letters| letters.iter().collect::<String>());
    let mut codes = codes.filter(|code| !taken.contains(code.as_str()));
    let coin = digits.last().is_some_and(|digit| digit % 2 == 1);
    (codes.next().unwrap_or_else(|| drawn.to_owned()), coin)
}

fn participant(line: &str) -> Option<Participant> {
    let mut cells = line.split(',');
    let (code, order, _began) = (cells.next()?, cells.next()?, cells.next()?);
    let (_, order) = ORDERS.into_iter().find(|(name, _)| *name == order)?;
    Some(Participant {
        code: code.to_owned(),
        order,
        answered: 0,
    })
}

/// Writes a text that is not there; one that is there must be the same.
fn keep(path: &Path, text: &str) -> io::Result<()> {
    match std::fs::read_to_string(path) {
        Ok(there) if there == text => Ok(()),
        Ok(_) => Err(io::Error::other(format!(
            "{} is another: this folder holds another study",
            path.display()
        ))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let mut file = File::create_new(path)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()
        }
        Err(error) => Err(error),
    }
}

/// The whole lines of a table below its first one, which is written if the file is not there.
fn lines(path: &Path, first: &str) -> io::Result<Vec<String>> {
    match std::fs::read_to_string(path) {
        Ok(text) => {
            if text.lines().next() != Some(first) {
                let what = format!("{} does not begin with {first}", path.display());
                return Err(io::Error::other(what));
            }
            // a line that was cut off when the machine went down is none
            let whole = text
                .rfind('\n')
                .map_or("", |end| text.get(..=end).unwrap_or(""));
            if whole.len() < text.len() {
                OpenOptions::new()
                    .write(true)
                    .open(path)?
                    .set_len(whole.len() as u64)?;
            }
            Ok(whole.lines().skip(1).map(str::to_owned).collect())
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            append(path, first)?;
            Ok(Vec::new())
        }
        Err(error) => Err(error),
    }
}

/// A line at the end of a file, on the disk when this returns.
fn append(path: &Path, line: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().create(true).append(true).open(path)?;
    file.write_all(format!("{line}\n").as_bytes())?;
    file.sync_all()
}

#[cfg(test)]
mod tests;
