//! Shows a run while it goes on: the dashboard on a terminal, else a plain line a second on stderr.

use std::time::{Duration, Instant};

use mmt_client::io::MasterLive;
use mmt_server::io::SlaveLive;

use crate::log::Messages;
use crate::output::note;
use crate::stop::Stop;
use crate::view::{Caption, History, Screen, Snapshot, Wish, line, render};

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
    /// When the run began to connect.
    began: Instant,
    next_line: Instant,
    stop: Stop,
}

impl Viewer {
    /// A viewer; with a dashboard if `dashboard` and if there is a terminal for it.
    pub(super) fn new(caption: Caption, dashboard: bool, messages: &Messages, stop: &Stop) -> Self {
        Self {
            caption,
            history: History::default(),
            screen: dashboard.then(|| Screen::take(messages)).flatten(),
            began: Instant::now(),
            next_line: Instant::now() + LINE,
            stop: stop.clone(),
        }
    }

    /// The same run goes on with other settings.
    pub(super) fn caption(&mut self, caption: Caption) {
        self.caption = caption;
        self.began = Instant::now();
    }

    /// How many scenes a second are looked at, with a dashboard or without one.
    pub(super) fn scene_hz(dashboard: bool) -> u8 {
        if dashboard && Screen::is_there() {
            SCENE_HZ
        } else {
            0
        }
    }

    /// Shows both sides, reads the keys, and returns when it is time for the next frame.
    pub(super) fn look(&mut self, slave: Option<SlaveLive>, master: Option<MasterLive>) {
        let tried_s = self.began.elapsed().as_secs_f64();
        self.history.push(Snapshot::new(slave, master, tried_s));
        let Some(screen) = &mut self.screen else {
            std::thread::sleep(LOOK);
            self.line();
            return;
        };
        let (caption, history) = (&self.caption, &self.history);
        let drawn = screen.draw(|frame, messages| render(frame, caption, history, messages));
        match drawn.and_then(|()| screen.wish(LOOK)) {
            Ok(Some(Wish::End)) => self.stop.ask(),
            Ok(Some(Wish::Stop)) => self.stop.emergency().set(true),
            Ok(Some(Wish::Clear)) => self.stop.emergency().set(false),
            Ok(None) => {}
            Err(error) => {
                self.screen = None;
                tracing::warn!("the live view ends: {error}");
            }
        }
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
