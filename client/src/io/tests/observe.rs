//! An observer as a host: what it shows, and how it ends.

use mmt_netem::io::socket::SocketExtras;
use mmt_shared::io::transport::CLOSE_REVOKED;
use mmt_shared::model::tool::Scene;
use mmt_shared::wire::{Claim, Role};
use tokio::task::JoinHandle;

use super::*;
use crate::observer::{COUPLING, ObserverLive};

type Observed = Result<(ObserverReport, SessionEnd), MasterHostError>;

struct Looking {
    stop: watch::Sender<Wish>,
    live: watch::Receiver<ObserverLive>,
    task: JoinHandle<Observed>,
}

fn look_on(fake: &Fake) -> Looking {
    let options = ObserverOptions {
        pairing: fake.pairing(),
        transport: Transport::Quic,
        duration: None,
        scene_hz: 30,
        netem: LinkConfig::default(),
        netem_seed: 1,
        netem_extras: SocketExtras::default(),
    };
    let (stop, stopped) = watch::channel(Wish::GoOn);
    let (shown, live) = watch::channel(ObserverLive::default());
    Looking {
        stop,
        live,
        task: tokio::spawn(observe(options, stopped, shown)),
    }
}

impl Looking {
    /// Waits for the welcome, which a close of the slave could overtake.
    async fn begun(&mut self) {
        let begun = self.live.wait_for(|live| live.footprint.is_some());
        timeout(FOR_EVER, begun).await.unwrap().unwrap();
    }

    async fn ended(self) -> Observed {
        timeout(FOR_EVER, self.task).await.unwrap().unwrap()
    }
}

#[tokio::test]
async fn an_observer_asks_for_nothing_but_to_see_shows_it_and_reports_what_came() {
    let fake = Fake::new();
    let mut looking = look_on(&fake);
    let mut slave = Session::welcomed(&fake).await;
    let hello = slave.hello;
    assert_eq!((hello.role, hello.scene_hz), (Role::Observer, 30));
    assert!(hello.coupling == COUPLING && hello.claim == Claim::IfFree);
    let scene = Scene {
        answers: Time::ZERO,
        object: Pose::default(),
        tool: Vec2::new(-0.3, 0.0),
        force: Vec2::zeros(),
    };
    slave.tell(Message::Scene(scene));
    let seen = |live: &ObserverLive| live.updates.iter().sum::<u64>() > 1 && live.scene.is_some();
    while !seen(&looking.live.borrow_and_update()) {
        slave.serve_for(Duration::from_millis(20)).await;
    }
    let live = *looking.live.borrow();
    assert_eq!((live.scene, live.params[0]), (Some(scene), 0.7));
    assert!(slave.stamps.is_empty(), "no command, no sample");
    looking.stop.send_replace(Wish::End);
    let theirs = slave.serve().await;
    assert_eq!(theirs.ending, Ending::Interrupted);
    slave
        .say_farewell(Ending::Interrupted, SlaveHalf::default())
        .await;
    let (report, why) = looking.ended().await.unwrap();
    assert_eq!(why, SessionEnd::Stopped);
    assert!(report.own.updates.applied > Some(1) && report.other.is_some());
    assert_eq!(report.own.session.received.scenes, Some(1));
    assert_eq!(report.own.session.sent.commands, Some(0));
}

#[tokio::test]
async fn each_end_of_an_observer_has_its_reason() {
    let fake = Fake::new();
    let mut looking = look_on(&fake);
    let slave = Session::welcomed(&fake).await;
    looking.begun().await;
    slave.connection.close(CLOSE_REVOKED, b"");
    let (report, why) = looking.ended().await.unwrap();
    assert_eq!((why, report.ending), (SessionEnd::Revoked, Ending::Failed));
    assert!(why.to_string().contains("replaced or revoked"));

    let mut looking = look_on(&fake);
    let slave = Session::welcomed(&fake).await;
    looking.begun().await;
    slave.connection.close(9u32.into(), b"");
    let (_, why) = looking.ended().await.unwrap();
    assert_eq!(why, SessionEnd::ConnectionLost);

    let looking = look_on(&fake);
    let mut slave = Session::welcomed(&fake).await;
    slave
        .say_farewell(Ending::Interrupted, SlaveHalf::default())
        .await;
    let theirs = slave.serve().await;
    assert_eq!(
        theirs.ending,
        Ending::Interrupted,
        "the ending that was given"
    );
    let (report, why) = looking.ended().await.unwrap();
    assert_eq!(why, SessionEnd::SlaveEnded(Ending::Interrupted));
    assert!(report.other.is_some());
}

#[tokio::test]
async fn an_observer_that_is_refused_receives_what_an_observer_can_do() {
    for (refusal, words) in [
        (Refusal::Busy, "as many observers"),
        (Refusal::WrongRole, "admits no observers"),
        (Refusal::WrongToken, "does not know the token"),
    ] {
        let fake = Fake::new();
        let looking = look_on(&fake);
        let mut slave = Session::connected(&fake).await;
        slave.refuse(refusal).await;
        let error = looking.ended().await.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
