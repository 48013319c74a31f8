//! `mmt demo --blind A.toml B.toml`: two configurations are felt in random order, and a question is asked on each.
//!
//! Neither the page nor the terminal shows which is which.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use mmt_client::io::SessionEnd;
use mmt_client::io::console::{Order, StudyWish};
use mmt_shared::wire::Ending;
use serde_json::{Value, json};

use super::round::{LOOK, Round};
use super::setting::Setting;
use super::study::{Answer, Condition, Participant, Study};
use crate::args::DemoArguments;
use crate::commands::console::SessionConsole;
use crate::commands::device::Device;
use crate::commands::netem::wrap::Emulation;
use crate::commands::record::Record;
use crate::commands::viewer::Viewer;
use crate::failure::Failure;
use crate::input::read_text;
use crate::log::Messages;
use crate::output::{note, print};
use crate::stop::Stop;
use crate::view::Caption;

/// Answers go from 1 to this.
const ANSWER_MAX: u8 = 7;

/// Where a participant stands.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Stage {
    /// Reads what they are to agree to.
    Consent,
    /// May begin the next part.
    Ready,
    /// Has felt a part, kept in this file, and is asked.
    Asked(PathBuf),
    /// Has answered both.
    Done,
}

/// A comparison at work.
struct Comparison<'a> {
    arguments: &'a DemoArguments,
    /// A and B.
    settings: [Setting; 2],
    files: [&'a Path; 2],
    consent: String,
    study: Study,
    stage: Stage,
    who: Option<Participant>,
}

/// Runs `mmt demo --blind`.
///
/// # Errors
/// A file is wrong, the folder cannot be written, or a host could not start.
pub(super) fn run(
    arguments: &DemoArguments,
    files: [&PathBuf; 2],
    messages: &Messages,
) -> Result<(), Failure> {
    let mut comparison = Comparison::new(arguments, files.map(PathBuf::as_path))?;
    let stop = Stop::on_signals()?;
    let Some(mut console) = SessionConsole::start(&arguments.console, true, stop.emergency())?
    else {
        return Err(Failure::usage("a blind comparison needs its console"));
    };
    console.blindfold();
    // messages of the hosts name schemes and networks
    messages.keep();
    note(format_args!("study: {}", arguments.study.display()));
    comparison.show(&mut console, None);
    while !stop.asked() {
        match console.next_order() {
            Some(Order::Study(StudyWish::Begin)) if comparison.stage == Stage::Ready => {
                let ended = comparison.part(&mut console, messages, &stop)?;
                comparison.show(&mut console, ended);
            }
            Some(Order::Study(wish)) => {
                comparison.step(wish)?;
                comparison.show(&mut console, None);
            }
            Some(_) => {}
            None => std::thread::sleep(LOOK),
        }
    }
    let results = arguments.study.join("results.csv");
    let (whole, shown) = (comparison.study.whole(), results.display());
    print(format_args!(
        "participants who answered both parts: {whole}\nanswers: {shown}"
    ))
}

impl<'a> Comparison<'a> {
    fn new(arguments: &'a DemoArguments, files: [&'a Path; 2]) -> Result<Self, Failure> {
        let settings = files.map(|file| {
            Setting::new(&DemoArguments {
                config: Some(file.to_owned()),
                ..arguments.clone()
            })
        });
        // whatever is wrong with either is found before anybody agrees to anything
        for setting in &settings {
            setting.config()?;
        }
        let consent = arguments.consent.as_deref();
        let consent = consent.map_or(Ok(String::new()), |path| read_text(path, "the consent"))?;
        let [a, b] = files.map(|file| read_text(file, "the configuration"));
        let texts = [
            ("A.toml", a?),
            ("B.toml", b?),
            ("consent.txt", consent.clone()),
            ("question.txt", arguments.question.clone()),
        ];
        let texts = texts.each_ref().map(|(name, text)| (*name, text.as_str()));
        let study = Study::open(&arguments.study, &texts).map_err(|error| {
            Failure::usage(format!("the study {}: {error}", arguments.study.display())).remedy(
                "give --study a folder that may be written, and a new one for another study",
            )
        })?;
        Ok(Self {
            arguments,
            settings,
            files,
            consent,
            study,
            stage: Stage::Consent,
            who: None,
        })
    }

    /// Does what the page asks for, where it is the time for it.
    fn step(&mut self, wish: StudyWish) -> Result<(), Failure> {
        match (wish, self.stage.clone()) {
            (StudyWish::Agree, Stage::Consent) => {
                let entered = self.study.enter(now_unix_s()).map_err(Failure::failed)?;
                note(format_args!("participant {} begins", entered.code));
                self.who = Some(entered);
                self.stage = Stage::Ready;
            }
            (StudyWish::Resume, Stage::Consent) => {
                if let Some(open) = self.study.unfinished() {
                    note(format_args!("participant {} goes on", open.code));
                    self.who = Some(open.clone());
                    self.stage = Stage::Ready;
                }
            }
            (StudyWish::Answer(answer), Stage::Asked(record)) => self.answered(answer, &record)?,
            (StudyWish::Next, Stage::Done) => {
                self.who = None;
                self.stage = Stage::Consent;
            }
            // a page that is late, or a button pressed twice
            _ => {}
        }
        Ok(())
    }

    fn answered(&mut self, answer: u8, record: &Path) -> Result<(), Failure> {
        let Some(who) = &mut self.who else {
            return Ok(());
        };
        let (Some(condition), 1..=ANSWER_MAX) = (who.next(), answer) else {
            return Ok(());
        };
        let [a, b] = self.files;
        let kept = Answer {
            answer,
            configuration: match condition {
                Condition::A => a,
                Condition::B => b,
            },
            duration_s: self.arguments.duration.as_secs_f64(),
            record,
            now_unix_s: now_unix_s(),
        };
        self.study.keep(who, kept).map_err(Failure::failed)?;
        note(format_args!(
            "participant {} has answered part {}",
            who.code, who.answered
        ));
        self.stage = if who.next().is_some() {
            Stage::Ready
        } else {
            Stage::Done
        };
        Ok(())
    }

    /// The person feels the next configuration; what they read if it broke and has to be done again.
    fn part(
        &mut self,
        console: &mut SessionConsole,
        messages: &Messages,
        stop: &Stop,
    ) -> Result<Option<&'static str>, Failure> {
        let Some((who, condition)) = self.who.as_ref().and_then(|who| Some((who, who.next()?)))
        else {
            return Ok(None);
        };
        let path = self.study.record(who);
        let record = Record::start(Some(&path))?;
        console.show_about([("study", self.stage_shown("part"))]);
        let [a, b] = &mut self.settings;
        let setting = match condition {
            Condition::A => a,
            Condition::B => b,
        };
        let stiffness = setting.config()?.stiffness_n_per_m;
        let device = Device::start(&self.arguments.device, stiffness)?;
        let mut round = Round {
            setting,
            emulation: &Emulation::default(),
            record: &record,
            device: &device,
            stop,
            dashboard: false,
            viewer: &mut Viewer::new(Caption::default(), false, messages, stop),
            console: Some(console),
            blind: true,
            again: None,
        };
        let ended = round.session();
        record.finish()?;
        let end = ended?.and_then(|(_, end)| end);
        if stop.asked() || end.map(SessionEnd::ending) != Some(Ending::Finished) {
            return Ok(Some("This part broke off. Please do it again."));
        }
        self.stage = Stage::Asked(path);
        Ok(None)
    }

    /// Shows the page where the participant stands.
    fn show(&self, console: &mut SessionConsole, trouble: Option<&str>) {
        let stage = match self.stage {
            Stage::Consent => "consent",
            Stage::Ready => "ready",
            Stage::Asked(_) => "question",
            Stage::Done => "done",
        };
        console.show_about([
            ("state", json!("waiting")),
            ("note", json!(trouble)),
            ("study", self.stage_shown(stage)),
        ]);
    }

    fn stage_shown(&self, stage: &str) -> Value {
        let who = self.who.as_ref();
        json!({
            "stage": stage,
            "consent": self.consent,
            "question": self.arguments.question,
            "answers": ANSWER_MAX,
            "duration_s": self.arguments.duration.as_secs_f64(),
            "code": who.map(|who| &who.code),
            "part": who.map(|who| who.answered + 1),
            "unfinished": self.study.unfinished().map(|open| &open.code),
        })
    }
}

fn now_unix_s() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.unwrap_or(Duration::ZERO).as_secs()
}
