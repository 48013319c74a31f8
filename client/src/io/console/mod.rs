//! The operator's console: a page in a browser that shows a session and hands over what a person does.
//!
//! It runs on a thread and a runtime of its own and shares one bounded ring with the haptic loop, which the loop never
//! waits for. Each viewer gets the newest frame that it has time for. One viewer operates; all may stop. The page
//! computes no force.

mod admission;
mod assets;
mod message;
mod shared;
mod viewer;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use axum::extract::ws::{Utf8Bytes, WebSocketUpgrade};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::serve::ListenerExt;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::secret::NoRandomness;
use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, interval};

use crate::io::hand_events::{HandEvents, hand_events};
use crate::operator::pointer::HandEvent;
use admission::{Admission, Refusal, Ticket};
use assets::{Assets, PAGE};
pub use message::{FromPage, NetworkWish, Order, SessionWish, StudyWish};
use shared::Shared;
pub use shared::Source;

/// Between two frames of the page: 62 a second.
const FRAME: Duration = Duration::from_millis(16);
/// Events that may wait for the loop: at 1000 a second, a second in which it stands.
const EVENTS_MAX: usize = 1024;
/// Orders that may wait for the command: far more than a person gives while it is busy.
const ORDERS_MAX: usize = 256;
/// The longest message of a page, bytes: a second of readings.
const MESSAGE_MAX: usize = 64 * 1024;
/// Viewers at one time.
const VIEWERS_MAX: usize = 32;

/// Where a console is to be found.
#[derive(Clone, Debug)]
pub struct ConsoleOptions {
    /// Where it listens; port 0 lets the system choose.
    pub listen: SocketAddr,
    /// The address by which other hosts reach this one, named where it listens at every address.
    pub for_others: Option<IpAddr>,
    /// Where the page's files come from while somebody works on them; the program's own if absent.
    pub assets: Option<PathBuf>,
}

/// A console could not start.
#[derive(Debug, thiserror::Error)]
pub enum ConsoleError {
    /// The address cannot be had.
    #[error("the console cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: io::Error,
    },
    /// No token.
    #[error(transparent)]
    Token(#[from] NoRandomness),
    /// No thread or no runtime.
    #[error("no thread for the console: {0}")]
    Thread(#[source] io::Error),
}

/// A console at work; it ends with the process.
pub struct Console {
    address: String,
    shared: Arc<Shared>,
    orders: mpsc::Receiver<Order>,
}

impl Console {
    /// Starts to serve. Pages set and clear `emergency`, which is to be that of the sessions that are shown.
    ///
    /// # Errors
    /// See [`ConsoleError`].
    pub fn start(options: ConsoleOptions, emergency: EmergencyStop) -> Result<Self, ConsoleError> {
        let ticket = Ticket::generate()?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(ConsoleError::Thread)?;
        let listen = options.listen;
        let unheard = |source| ConsoleError::Listen {
            address: listen,
            source,
        };
        let bound = runtime.block_on(tokio::net::TcpListener::bind(listen));
        let listener = bound.map_err(unheard)?;
        let local = listener.local_addr().map_err(unheard)?;
        let (send, orders) = mpsc::channel(ORDERS_MAX);
        let shared = Arc::new(Shared {
            admission: Admission::new(listen.ip(), ticket.clone()),
            assets: Assets::new(options.assets),
            stage: Mutex::default(),
            frame: watch::Sender::new(Utf8Bytes::from_static("{}")),
            about: watch::Sender::new(Utf8Bytes::from_static("{}")),
            operator: watch::Sender::new(None),
            orders: send,
            emergency,
        });
        let served = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("mmt-console".to_owned())
            .spawn(move || runtime.block_on(serve(listener, served)))
            .map_err(ConsoleError::Thread)?;
        let reached = reached(local, options.for_others);
        let address = format!("http://{reached}/?token={}", ticket.reveal());
        Ok(Self {
            address,
            shared,
            orders,
        })
    }

    /// What a person opens in a browser. It holds the token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The way of a person's events to the loop of a session that begins; the one before gets none any more.
    pub fn events(&self) -> HandEvents {
        let (events, to_loop) = hand_events(EVENTS_MAX);
        self.shared.stage().events = Some(events);
        to_loop
    }

    /// Shows what `source` gives, a JSON object, in each frame from now on.
    pub fn show(&self, source: Source) {
        self.shared.stage().source = Some(source);
    }

    /// Shows what changes seldom, a JSON object.
    pub fn show_about(&self, about: String) {
        self.shared.about.send_replace(about.into());
    }

    /// From now on no page gives the hand to the script.
    pub fn refuse_script(&self) {
        self.shared.stage().no_script = true;
    }

    /// From now on every page only looks on: none operates, stops, or has anything done.
    pub fn look_on(&self) {
        self.shared.stage().looks_on = true;
    }

    /// Gives the loop an event; lost where no loop runs.
    pub fn give(&self, event: HandEvent) {
        self.shared.stage().give(event);
    }

    /// What a viewer asks for.
    pub fn next_order(&mut self) -> Option<Order> {
        self.orders.try_recv().ok()
    }

    /// How many look on now.
    pub fn viewers(&self) -> usize {
        self.shared.stage().viewers
    }
}

/// Where a console that listens at `local` is reached, also by others if they can: nobody opens a wildcard.
fn reached(local: SocketAddr, for_others: Option<IpAddr>) -> SocketAddr {
    if !local.ip().is_unspecified() {
        return local;
    }
    let own = for_others.unwrap_or(Ipv4Addr::LOCALHOST.into());
    (own, local.port()).into()
}

async fn serve(listener: tokio::net::TcpListener, shared: Arc<Shared>) {
    tokio::spawn(frames(Arc::clone(&shared)));
    let routes = Router::new()
        .route("/", get(page))
        .route("/{file}", get(file))
        .route("/ws", get(socket))
        .with_state(shared);
    let listener = listener.tap_io(|stream| {
        // a frame that waits for an acknowledgement is an old frame
        let _ = stream.set_nodelay(true);
    });
    if let Err(error) = axum::serve(listener, routes).await {
        tracing::error!(%error, "the console ends");
    }
}

/// Makes the frames, while anybody looks on.
async fn frames(shared: Arc<Shared>) {
    let mut beat = interval(FRAME);
    beat.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        beat.tick().await;
        let mut stage = shared.stage();
        if stage.viewers == 0 {
            continue;
        }
        if let Some(source) = &mut stage.source {
            let frame = source();
            drop(stage);
            shared.frame.send_replace(frame.into());
        }
    }
}

type Served = State<Arc<Shared>>;

async fn page(State(shared): Served, headers: HeaderMap, uri: Uri) -> Response {
    match shared.admission.page(&headers, &uri) {
        Ok(()) => shared.assets.answer(PAGE),
        Err(refusal) => refuse(refusal),
    }
}

async fn file(State(shared): Served, headers: HeaderMap, Path(name): Path<String>) -> Response {
    match shared.admission.file(&headers) {
        // the page itself needs the token
        Ok(()) if name != PAGE => shared.assets.answer(&name),
        Ok(()) => refuse(Refusal::Token),
        Err(refusal) => refuse(refusal),
    }
}

async fn socket(
    State(shared): Served,
    headers: HeaderMap,
    uri: Uri,
    upgrade: WebSocketUpgrade,
) -> Response {
    if let Err(refusal) = shared.admission.socket(&headers, &uri) {
        return refuse(refusal);
    }
    if shared.stage().viewers >= VIEWERS_MAX {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many viewers").into_response();
    }
    upgrade
        .max_message_size(MESSAGE_MAX)
        .on_upgrade(|socket| viewer::serve(shared, socket))
}

fn refuse(refusal: Refusal) -> Response {
    (StatusCode::FORBIDDEN, refusal.to_string()).into_response()
}

#[cfg(test)]
mod tests;
