//! Shows a run while it goes on: the dashboard on a terminal, else a plain line a second on stderr. The keys are the same.

use std::io;
use std::time::{Duration, Instant};

use mmt_client::io::MasterLive;
use mmt_client::observer::ObserverLive;
use mmt_server::io::SlaveLive;

use crate::log::Messages;
use crate::output::note;
use crate::stop::Stop;
use crate::view::{Caption, History, Keyboard, Screen, Snapshot, Wish, line, render};

/// Time between two frames: 20 a second are as much as an eye can use.
const LOOK: Duration = Duration::from_millis(50);
/// Scenes a second that a dashboard asks for: one a frame.
const SCENE_HZ: u8 = 20;
/// Time between two plain lines.
const LINE: Duration = Duration::from_secs(1);

/// Who shows it.
pub(super) struct Viewer {
    caption: Caption,
    history: History,
    screen: Option<Screen>,
    /// Without a dashboard; none where the keys do nothing.
    keyboard: Option<Keyboard>,
    /// When the run began to connect.
    began: Instant,
    next_line: Instant,
    stop: Stop,
}

impl Viewer {
    /// A viewer; if `dashboard`, with a dashboard on a terminal that has room for it, and with its keys on a smaller one.
    pub(super) fn new(caption: Caption, dashboard: bool, messages: &Messages, stop: &Stop) -> Self {
        let drawn = dashboard && Screen::has_room();
        let viewer = Self {
            caption,
            history: History::default(),
            screen: drawn.then(|| Screen::take(messages)).flatten(),
            keyboard: None,
            began: Instant::now(),
            next_line: Instant::now() + LINE,
            stop: stop.clone(),
        };
        if dashboard && Screen::is_there() {
            viewer.with_keys()
        } else {
            viewer
        }
    }

    /// The same with the keys of the dashboard where there is none, if stdin is a terminal.
    pub(super) fn with_keys(self) -> Self {
        let keyboard = self.screen.is_none().then(Keyboard::take).flatten();
        if keyboard.is_some() {
            note("keys: space sets the emergency stop, c clears it, q ends the run");
        }
        Self { keyboard, ..self }
    }

    /// The same run goes on with other settings.
    pub(super) fn caption(&mut self, caption: Caption) {
        self.caption = caption;
        self.began = Instant::now();
    }

    /// How many scenes a second are looked at, with a dashboard or without one.
    pub(super) fn scene_hz(dashboard: bool) -> u8 {
        if dashboard && Screen::has_room() {
            SCENE_HZ
        } else {
            0
        }
    }

    /// Shows both sides, reads the keys, and returns when it is time for the next frame.
    pub(super) fn look(&mut self, slave: Option<SlaveLive>, master: Option<MasterLive>) {
        let tried_s = self.began.elapsed().as_secs_f64();
        self.turn(Snapshot::new(slave, master, tried_s));
    }

    /// Shows what an observer sees, reads the keys, and returns when it is time for the next frame.
    pub(super) fn look_on(&mut self, observer: ObserverLive) {
        let tried_s = self.began.elapsed().as_secs_f64();
        self.turn(Snapshot::of_observer(observer, tried_s));
    }

    fn turn(&mut self, now: Snapshot) {
        self.history.push(now);
        match self.show() {
            Ok(Some(Wish::End)) => self.stop.ask(),
            // an observer stops nothing
            Ok(Some(Wish::Stop | Wish::Clear)) if now.observer.is_some() => {}
            Ok(Some(Wish::Stop)) => self.stop.emergency().set(true),
            Ok(Some(Wish::Clear)) => self.stop.emergency().set(false),
            Ok(None) => {}
            Err(error) => {
                (self.screen, self.keyboard) = (None, None);
                tracing::warn!("the terminal is not used any more: {error}");
            }
        }
    }

    /// Shows the newest and waits a frame for a key.
    fn show(&mut self) -> io::Result<Option<Wish>> {
        if let Some(screen) = &mut self.screen {
            let (caption, history) = (&self.caption, &self.history);
            screen.draw(|frame, messages| render(frame, caption, history, messages))?;
            return screen.wish(LOOK);
        }
        self.line();
        if let Some(keyboard) = &mut self.keyboard {
            return keyboard.wish(LOOK);
        }
        std::thread::sleep(LOOK);
        Ok(None)
    }

    fn line(&mut self) {
        let now = Instant::now();
        // nothing is shown of a side that nobody is connected to
        let quiet = self.history.newest() == Snapshot::default();
        if now >= self.next_line && !quiet {
            // after a pause of this process there is no burst of lines
            self.next_line = now + LINE;
            note(line(&self.caption, &self.history));
        }
    }
}
