//! A master of the tests: what the protocol's document demands, and no more.

use std::error::Error;
use std::time::Duration;

use bytes::Bytes;
use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::connect::connect;
use mmt_shared::io::quic::{Traffic, client_endpoint};
use mmt_shared::io::socket;
use mmt_shared::io::stream::{read_frame, write_frame};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::{HipCounts, HipSample};
use mmt_shared::model::tool::HandPort;
use mmt_shared::model::update::Update;
use mmt_shared::pairing::{Pairing, Token};
use mmt_shared::report::{MasterHalf, ReceivedUpdates, SlaveHalf};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{
    Claim, Command, DATAGRAM_MAX, Ending, Farewell, Hello, Label, Message, RawState, Refusal, Role,
    STREAM_MESSAGE_MAX, SampleBlock, Side, StreamMessage, Welcome,
};
use quinn::{Connection, Endpoint, RecvStream, SendStream};
use tokio::time::{interval, timeout};

/// Longer than any healthy test needs on any host.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);
const PACKED: u8 = 10;
pub(super) const TRAFFIC: Traffic = Traffic {
    datagram_max: 400,
    rate_cap: RateCap {
        bytes_per_s: 300_000,
    },
};

pub(super) struct Master {
    pub(super) connection: Connection,
    pub(super) link: DatagramChannel,
    pub(super) updates: Vec<Update<RawState>>,
    pub(super) architecture: Architecture,
    pub(super) claim: Claim,
    pub(super) role: Role,
    pub(super) scene_hz: u8,
    _endpoint: Endpoint,
    send: SendStream,
    receive: RecvStream,
    clock: Clock,
    stamp: Time,
    pub(super) hip: Vec2,
}

pub(super) async fn patiently<T>(future: impl Future<Output = T>) -> T {
    timeout(PATIENCE, future).await.unwrap()
}

impl Master {
    /// Connects and opens the stream; sends nothing yet.
    pub(super) async fn connect(pairing: &Pairing) -> Self {
        Self::try_connect(pairing).await.unwrap()
    }

    /// The same, if it is let in so far.
    pub(super) async fn try_connect(pairing: &Pairing) -> Result<Self, Box<dyn Error>> {
        let address = pairing.address.to_string().parse().unwrap();
        let own = socket::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let endpoint = client_endpoint(socket::for_quic(own).unwrap()).unwrap();
        let connection = connect(&endpoint, address, pairing.pin, TRAFFIC, PATIENCE);
        let connection = connection.await?;
        let (send, receive) = connection.open_bi().await?;
        let clock = Clock::start();
        Ok(Self {
            connection,
            link: DatagramChannel::new(Side::Master, clock.now()),
            updates: Vec::new(),
            architecture: Architecture::Mmt,
            scene_hz: 0,
            claim: Claim::IfFree,
            role: Role::Operator,
            _endpoint: endpoint,
            send,
            receive,
            clock,
            stamp: Time::from_millis(1),
            hip: Vec2::new(-0.25, 0.02),
        })
    }

    /// Connects and is welcomed.
    pub(super) async fn operate(pairing: &Pairing) -> (Self, Welcome<RawState>) {
        let mut master = Self::connect(pairing).await;
        let welcome = master.hello(pairing.token, 1000.0).await.unwrap();
        (master, welcome)
    }

    pub(super) async fn hello(
        &mut self,
        token: Token,
        k_p: f64,
    ) -> Result<Welcome<RawState>, Refusal> {
        let hello = Hello {
            token,
            role: self.role,
            claim: self.claim,
            coupling: Coupling::for_stiffness(k_p),
            samples_per_command: PACKED,
            architecture: self.architecture,
            scene_hz: self.scene_hz,
            hip: self.hip,
            program: Label::clipped("test"),
        };
        self.say(&encoded(&StreamMessage::Hello(hello))).await;
        match StreamMessage::decode(&self.hear().await, Side::Slave) {
            Ok(StreamMessage::Welcome(welcome)) => Ok(welcome),
            Ok(StreamMessage::Refused(refusal)) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// Writes bytes as they are, and ends the stream.
    pub(super) async fn write(&mut self, bytes: &[u8]) {
        self.send.write_all(bytes).await.unwrap();
        self.send.finish().unwrap();
    }

    pub(super) async fn say(&mut self, message: &[u8]) {
        write_frame(&mut self.send, message, PATIENCE)
            .await
            .unwrap();
    }

    async fn hear(&mut self) -> Vec<u8> {
        let frame = read_frame(&mut self.receive, STREAM_MESSAGE_MAX, PATIENCE).await;
        frame.unwrap()
    }

    /// Pushes to the right at 0.2 m/s with a command every 10 ms.
    pub(super) async fn push(&mut self, commands: u32) {
        let mut turns = interval(TICK * u32::from(PACKED));
        let mut left = commands;
        while left > 0 {
            tokio::select! {
                _ = turns.tick() => {
                    self.send_command();
                    left -= 1;
                }
                datagram = self.connection.read_datagram() => self.take(&datagram.unwrap()),
            }
        }
    }

    /// Sends a heartbeat.
    pub(super) fn beat(&mut self) {
        let mut out = [0; DATAGRAM_MAX];
        let now = self.clock.now();
        let length = self.link.encode(now, Message::Heartbeat, &mut out);
        let bytes = Bytes::copy_from_slice(&out[..length.unwrap().unwrap()]);
        self.connection.send_datagram(bytes).unwrap();
    }

    /// Reads one datagram.
    pub(super) async fn read(&mut self) {
        let datagram = self.connection.read_datagram().await.unwrap();
        self.take(&datagram);
    }

    /// Reads until the slave has sent `heartbeats` heartbeats.
    pub(super) async fn listen(&mut self, heartbeats: u64) {
        let before = self.link.counts().received.heartbeats;
        while self.link.counts().received.heartbeats < before + heartbeats {
            self.read().await;
        }
    }

    fn take(&mut self, datagram: &Bytes) {
        let opened = self.link.handle(self.clock.now(), datagram);
        if let Some(Message::Update(update)) = opened.map(|opened| opened.message) {
            self.updates.push(update);
        }
    }

    fn send_command(&mut self) {
        let mut samples = SampleBlock::default();
        for _ in 0..PACKED {
            self.stamp += TICK;
            self.hip.x += 0.0002;
            let (stamp, hip) = (self.stamp, HipCounts::nearest(self.hip));
            samples
                .push(HipSample {
                    stamp,
                    hip,
                    ..HipSample::default()
                })
                .unwrap();
        }
        let newest_update = self.updates.last().map_or(0, |update| update.sequence);
        let command = Command {
            newest_update,
            samples,
            port: self.architecture.feels_tool().then(HandPort::default),
        };
        let mut out = [0; DATAGRAM_MAX];
        let now = self.clock.now();
        let length = self.link.encode(now, Message::Command(command), &mut out);
        let bytes = Bytes::copy_from_slice(&out[..length.unwrap().unwrap()]);
        self.connection.send_datagram(bytes).unwrap();
    }

    pub(super) fn send_raw(&self, bytes: &'static [u8]) {
        self.connection
            .send_datagram(Bytes::from_static(bytes))
            .unwrap();
    }

    /// Sends its farewell and reads the slave's: its report.
    pub(super) async fn farewell(mut self) -> (Ending, SlaveHalf) {
        self.say_farewell().await;
        let theirs = self.hear_farewell().await;
        self.connection.close(0u32.into(), b"");
        self._endpoint.wait_idle().await;
        theirs
    }

    pub(super) async fn say_farewell(&mut self) {
        let half = MasterHalf {
            updates: ReceivedUpdates {
                applied: Some(7),
                ..ReceivedUpdates::default()
            },
            ..MasterHalf::default()
        };
        let farewell = Farewell {
            ending: Ending::Finished,
            report: &serde_json::to_vec(&half).unwrap(),
        };
        self.say(&encoded(&StreamMessage::Farewell(farewell))).await;
    }

    pub(super) async fn hear_farewell(&mut self) -> (Ending, SlaveHalf) {
        match StreamMessage::decode(&self.hear().await, Side::Slave) {
            Ok(StreamMessage::Farewell(Farewell { ending, report })) => {
                (ending, serde_json::from_slice(report).unwrap())
            }
            other => panic!("{other:?}"),
        }
    }
}

fn encoded(message: &StreamMessage<'_>) -> Vec<u8> {
    let mut out = [0; STREAM_MESSAGE_MAX];
    let length = message.encode(&mut out).unwrap();
    out[..length].to_vec()
}
