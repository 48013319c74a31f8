//! The 1 kHz thread: it owns the slave and does nothing but tick it.
//!
//! It never waits for the network: samples come out of a bounded ring, updates and looks go into latest-wins
//! mailboxes. It locks nothing and logs nothing after its first deadline.

use std::io;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::realtime::{self, RealTime};
use mmt_shared::io::schedule::Tick;
use mmt_shared::io::ticker::{Ticker, TickerReport};
use mmt_shared::io::truth::TruthSender;
use mmt_shared::io::wake::{self, Waker, Wakeup};
use mmt_shared::metrics::UpdateCounts;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::tool::{HandPort, Scene, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::time::{TICK, Time};
use rtrb::{Consumer, Producer, RingBuffer};
use tokio::sync::oneshot;
use triple_buffer::{Input, Output, triple_buffer};

use super::SlaveLive;
use crate::slave::{Slave, SlaveTick};

/// Samples that may wait for the next tick: a second of them, twice what play-out keeps.
const SAMPLES_WAITING: usize = 1024;

/// What the thread hands back when it ends.
pub(super) struct Finished {
    /// The slave as the session left it.
    pub(super) slave: Slave,
    /// Ticks, with and without contact; what was sent is counted by who sends.
    pub(super) ticks: UpdateCounts,
    /// Updates that a newer one overtook before they could be sent.
    pub(super) superseded: u64,
    /// How the loop kept its time.
    pub(super) ticker: TickerReport,
}

/// A HIP sample on its way to the thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrived {
    /// When it arrived.
    pub(super) at: Time,
    pub(super) sample: HipSample,
    /// The newest update that the master had then.
    pub(super) newest_update: u32,
    /// By how much congestion stretches what the slave says.
    pub(super) stretch: f64,
    /// What the hand's port says, with the last sample of a command.
    pub(super) port: Option<HandPort>,
}

/// What a tick has to tell, besides updates, to whoever asks.
#[derive(Clone, Copy, Debug)]
pub(super) struct News {
    /// Where the hand feels the tool.
    pub(super) tool: Option<Tool>,
    pub(super) scene: Scene,
}

/// Tokio's side of the thread. Dropping it ends the thread.
pub(super) struct Worker {
    pub(super) samples: Producer<Arrived>,
    pub(super) updates: Output<Option<Update>>,
    pub(super) news: Output<Option<News>>,
    pub(super) looks: Output<SlaveLive>,
    pub(super) wakeup: Wakeup,
    /// Closed without a word if the thread panicked.
    pub(super) finished: oneshot::Receiver<Finished>,
    stop: Arc<AtomicBool>,
}

/// The thread's side.
pub(super) struct Inside {
    samples: Consumer<Arrived>,
    updates: Input<Option<Update>>,
    news: Input<Option<News>>,
    looks: Input<SlaveLive>,
    waker: Waker,
    stop: Arc<AtomicBool>,
}

impl Worker {
    /// Starts the thread with a slave, and with the way that its true poses take to the report.
    pub(super) fn start(
        clock: Clock,
        slave: Slave,
        truth: Option<TruthSender>,
    ) -> io::Result<Self> {
        let ticker = Ticker::new(clock, TICK);
        Self::start_with(move |inside| {
            tell(&realtime::request());
            inside.run(ticker, slave, truth)
        })
    }

    /// Starts a thread that does `work`.
    pub(super) fn start_with(
        work: impl FnOnce(Inside) -> Finished + Send + 'static,
    ) -> io::Result<Self> {
        let (samples_in, samples) = RingBuffer::new(SAMPLES_WAITING);
        let (updates, updates_out) = triple_buffer(&None);
        let (news, news_out) = triple_buffer(&None);
        let (looks, looks_out) = triple_buffer(&SlaveLive::default());
        let (waker, wakeup) = wake::pair()?;
        let stop = Arc::new(AtomicBool::new(false));
        let (done, finished) = oneshot::channel();
        let inside = Inside {
            samples,
            updates,
            news,
            looks,
            waker,
            stop: Arc::clone(&stop),
        };
        let body = move || {
            // Nobody listens any more if the session was dropped.
            let _ = done.send(work(inside));
        };
        thread::Builder::new()
            .name("mmt-slave".into())
            .spawn(body)?;
        Ok(Self {
            samples: samples_in,
            updates: updates_out,
            news: news_out,
            looks: looks_out,
            wakeup,
            finished,
            stop,
        })
    }

    /// Asks the thread to end after its tick; then `finished` tells.
    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// The newest update that has not been fetched yet.
    pub(super) fn fresh_update(&mut self) -> Option<Update> {
        let fresh = self.updates.update();
        self.updates.output_buffer().filter(|_| fresh)
    }

    /// The newest state of the tool, if it has not been fetched yet.
    pub(super) fn fresh_tool(&mut self) -> Option<Tool> {
        let fresh = self.news.update();
        let news = self.news.output_buffer().filter(|_| fresh);
        news.and_then(|news| news.tool)
    }

    /// The newest news, fetched before or not; none before the first tick.
    pub(super) fn newest(&mut self) -> Option<News> {
        *self.news.read()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop();
    }
}

/// What was not granted is worth a line by default: deadlines will slip.
fn tell(obtained: &RealTime) {
    let granted = [&obtained.fifo, &obtained.memory, &obtained.slack];
    match granted.into_iter().all(|of| of.granted()) {
        true => tracing::info!("slave loop: {obtained}"),
        false => tracing::warn!("slave loop: {obtained}"),
    }
}

impl Inside {
    fn run(
        mut self,
        mut ticker: Ticker,
        mut slave: Slave,
        mut truth: Option<TruthSender>,
    ) -> Finished {
        let mut ticks = UpdateCounts::default();
        let mut superseded = 0;
        ticker.run(|tick| {
            if let Some(done) = self.turn(tick, &mut slave) {
                ticks.tick(done.in_contact);
                if let Some(truth) = &mut truth {
                    truth.send(done.stamp, done.truth);
                }
                superseded += u64::from(self.hand_over(&slave, &done));
            }
            match self.stop.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        Finished {
            slave,
            ticks,
            superseded,
            ticker: ticker.report(),
        }
    }

    /// One tick, at its deadline: the stamp is free of wake-up jitter.
    fn turn(&mut self, tick: Tick, slave: &mut Slave) -> Option<SlaveTick> {
        while let Ok(arrived) = self.samples.pop() {
            slave.handle_sample(arrived.at, &arrived.sample, arrived.newest_update);
            slave.stretch(arrived.stretch);
            if let Some(port) = &arrived.port {
                slave.handle_hand_port(port);
            }
        }
        slave.tick(tick.deadline)
    }

    /// Leaves the look, the news of the tool and the update; whether an update was overtaken.
    fn hand_over(&mut self, slave: &Slave, tick: &SlaveTick) -> bool {
        *self.looks.input_buffer_mut() = look(slave, tick);
        self.looks.publish();
        let (tool, scene) = (slave.tool_state(tick), slave.scene(tick));
        *self.news.input_buffer_mut() = Some(News { tool, scene });
        self.news.publish();
        let mut overtook = false;
        if tick.update.is_some() {
            *self.updates.input_buffer_mut() = tick.update;
            overtook = self.updates.publish();
        }
        if tick.update.is_some() || tool.is_some() {
            self.waker.wake();
        }
        overtook
    }
}

/// What the thread knows; the link's numbers are added outside.
fn look(slave: &Slave, tick: &SlaveTick) -> SlaveLive {
    let estimate = slave.estimate();
    SlaveLive {
        connected: true,
        f_s: tick.f_s,
        f_shadow: tick.f_shadow,
        estimate: [estimate.m, estimate.b, estimate.c],
        tool: tick.tool,
        truth: tick.truth,
        footprint: Some(slave.environment().footprint()),
        in_contact: tick.in_contact,
        ..SlaveLive::default()
    }
}
