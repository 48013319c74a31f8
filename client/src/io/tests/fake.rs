//! A slave as small as the protocol allows.

use mmt_shared::pairing::Pairing;
use std::net::SocketAddr;

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::farewell::ReceivedFarewell;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::quic::{Traffic, server_endpoint};
use mmt_shared::io::socket;
use mmt_shared::io::stream::{read_frame, write_frame};
use mmt_shared::io::transport::{Connection, Listener, RecvStream, SendStream};
use mmt_shared::model::geometry::{BoxFootprint, Pose};
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::model::update::Update;
use mmt_shared::report::MasterHalf;
use mmt_shared::time::Time;
use mmt_shared::wire::{
    DATAGRAM_MAX, Farewell, Hello, Label, Message, STREAM_MESSAGE_MAX, Side, StreamMessage, Welcome,
};

use super::*;

/// A slave's endpoint.
pub(super) struct Fake {
    pub(super) identity: Identity,
    pub(super) address: SocketAddr,
    pub(super) listener: Listener,
}

impl Fake {
    pub(super) fn new() -> Self {
        let identity = Identity::ephemeral().unwrap();
        let socket = socket::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let traffic = Traffic {
            datagram_max: 300,
            rate_cap: RateCap {
                bytes_per_s: 250_000,
            },
        };
        let socket = socket::for_quic(socket).unwrap();
        let endpoint = server_endpoint(socket, &identity, traffic).unwrap();
        Self {
            address: endpoint.local_addr().unwrap(),
            identity,
            listener: Listener::new(endpoint),
        }
    }

    pub(super) fn pairing(&self) -> Pairing {
        let token: Token = self.identity.tokens().of_operator().unwrap().token;
        Pairing {
            address: self.address.to_string().parse().unwrap(),
            pin: self.identity.pin(),
            token,
        }
    }
}

/// The slave's end of a session.
pub(super) struct Session {
    pub(super) connection: Connection,
    pub(super) hello: Hello,
    /// Stamps of all samples, in the order of their arrival.
    pub(super) stamps: Vec<u64>,
    send: SendStream,
    receive: Option<RecvStream>,
    link: DatagramChannel,
    clock: Clock,
    sequence: u32,
}

pub(super) fn state(coupling: &Coupling) -> ModelState {
    let params = ModelParams::of_square(0.7, 3.0, 2.0, 0.4, coupling).unwrap();
    let (footprint, pose) = (BoxFootprint::square(0.4), Pose::default());
    ModelState::try_new(params, footprint, pose, Twist::default(), coupling).unwrap()
}

pub(super) fn welcome_for(coupling: Coupling) -> Welcome {
    Welcome {
        settings: Mode::Recommended.model_settings(coupling),
        state: state(&coupling),
        tool: Vec2::new(-0.45, 0.0),
        tool_force_max_n: TOOL_FORCE_MAX_N,
        resume: Token::new([0; 32]),
        scheme: Label::clipped("none"),
        program: Label::clipped("fake"),
    }
}

impl Session {
    /// A master that has sent its hello.
    pub(super) async fn connected(fake: &Fake) -> Self {
        let handshake = timeout(FOR_EVER, fake.listener.next()).await.unwrap();
        let connection = handshake.unwrap().finish().await.unwrap();
        let (send, mut receive) = connection.accept_bi().await.unwrap();
        let message = read_frame(&mut receive, STREAM_MESSAGE_MAX, FOR_EVER).await;
        let message = message.unwrap();
        let message = StreamMessage::decode(&message, Side::Master).unwrap();
        let StreamMessage::Hello(hello) = message else {
            panic!("{message:?} instead of a hello");
        };
        let hello = hello.accept().unwrap();
        assert!(fake.identity.tokens().find(&hello.token).is_some());
        let clock = Clock::start();
        Self {
            connection,
            hello,
            stamps: Vec::new(),
            send,
            receive: Some(receive),
            link: DatagramChannel::new(Side::Slave, clock.now()),
            clock,
            sequence: 0,
        }
    }

    /// A master that has been welcomed.
    pub(super) async fn welcomed(fake: &Fake) -> Self {
        let mut session = Self::connected(fake).await;
        session.welcome(session.hello.coupling).await;
        session
    }

    pub(super) async fn welcome(&mut self, coupling: Coupling) {
        self.say(&StreamMessage::Welcome((&welcome_for(coupling)).into()))
            .await;
    }

    pub(super) async fn refuse(&mut self, refusal: Refusal) {
        self.say(&StreamMessage::Refused(refusal)).await;
    }

    pub(super) async fn say_farewell(&mut self, ending: Ending, totals: SlaveHalf) {
        let report = &serde_json::to_vec(&totals).unwrap();
        self.say(&StreamMessage::Farewell(Farewell { ending, report }))
            .await;
    }

    async fn say(&mut self, message: &StreamMessage<'_>) {
        let mut out = [0; STREAM_MESSAGE_MAX];
        let length = message.encode(&mut out).unwrap();
        write_frame(&mut self.send, &out[..length], FOR_EVER)
            .await
            .unwrap();
    }

    /// Takes samples in and sends an update every 20 ms, until the master sends its farewell.
    pub(super) async fn serve(&mut self) -> ReceivedFarewell<MasterHalf> {
        timeout(FOR_EVER, self.serve_until_farewell())
            .await
            .unwrap()
    }

    /// The same for a time.
    pub(super) async fn serve_for(&mut self, time: Duration) {
        let end = Instant::now() + time;
        while Instant::now() < end {
            self.turn(Duration::from_millis(20)).await;
        }
    }

    async fn serve_until_farewell(&mut self) -> ReceivedFarewell<MasterHalf> {
        let mut receive = self.receive.take().unwrap();
        let message =
            tokio::spawn(
                async move { read_frame(&mut receive, STREAM_MESSAGE_MAX, FOR_EVER).await },
            );
        while !message.is_finished() {
            self.turn(Duration::from_millis(20)).await;
        }
        let message = message.await.unwrap().unwrap();
        match StreamMessage::decode(&message, Side::Master).unwrap() {
            StreamMessage::Farewell(Farewell { ending, report }) => ReceivedFarewell {
                ending,
                report: serde_json::from_slice(report).ok(),
            },
            other => panic!("{other:?} instead of a farewell"),
        }
    }

    async fn turn(&mut self, time: Duration) {
        let end = Instant::now() + time;
        while let Ok(Ok(bytes)) =
            tokio::time::timeout_at(end, self.connection.read_datagram()).await
        {
            let opened = self.link.handle(self.clock.now(), &bytes);
            if let Some(Message::Command(command)) = opened.map(|opened| opened.message) {
                let stamps = command.samples.as_slice().iter();
                self.stamps
                    .extend(stamps.map(|sample| sample.stamp.as_nanos()));
            }
        }
        sleep(Duration::from_millis(1)).await;
        self.update();
    }

    fn update(&mut self) {
        self.sequence += 1;
        let update = Update {
            sequence: self.sequence,
            cause: Cause::Timer,
            answers: Time::from_nanos(self.stamps.last().copied().unwrap_or(0)),
            touched_face: None,
            state: state(&self.hello.coupling),
        };
        self.tell(Message::Update((&update).into()));
    }

    /// Sends a message on its own datagram.
    pub(super) fn tell(&mut self, message: Message) {
        let mut out = [0; DATAGRAM_MAX];
        let length = self.link.encode(self.clock.now(), message, &mut out);
        let bytes = out[..length.unwrap().unwrap()].to_vec();
        // a master that has gone does not matter here
        let _ = self.connection.send_datagram(bytes.into());
    }
}
