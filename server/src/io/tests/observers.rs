//! Observers beside the session, with real sockets.

use mmt_shared::io::identity_file::{load_or_create, revoke, rotate};
use mmt_shared::io::transport::CLOSE_REVOKED;
use mmt_shared::model::update::Update;
use mmt_shared::wire::{RawState, Role};

use super::*;

/// An observer that looks on.
async fn observer(host: &Running, token: Token) -> Master {
    let mut observer = Master::connect(&host.pairing).await;
    observer.role = Role::Observer;
    observer.scene_hz = 60;
    let welcome = patiently(observer.hello(token, 50.0)).await.unwrap();
    assert!(welcome.resume == Token::new([0; 32]), "not the operator's");
    observer
}

/// What an observer is answered.
async fn answer(host: &Running, token: Token) -> Result<(), Refusal> {
    let mut observer = Master::connect(&host.pairing).await;
    observer.role = Role::Observer;
    observer.claim = Claim::TakeOver;
    patiently(observer.hello(token, 50.0)).await.map(|_| ())
}

/// Reads until it has been sent the update that the operator was sent last.
async fn catch_up(observer: &mut Master, operator: &Master) {
    let newest = operator.updates.last().unwrap();
    while observer.updates.last().map(body) != Some(body(newest)) {
        patiently(observer.read()).await;
        observer.beat();
    }
}

/// An update without its number: an observer's are counted anew.
fn body(update: &Update<RawState>) -> Update<RawState> {
    Update {
        sequence: 0,
        ..*update
    }
}

/// Pushes for a second while these live; then reads what the slave had to say about it.
async fn push(operator: &mut Master, observers: &mut [Master]) {
    for _ in 0..10 {
        patiently(operator.push(10)).await;
        observers.iter_mut().for_each(Master::beat);
    }
    patiently(operator.listen(2)).await;
}

#[tokio::test]
async fn two_observers_see_the_operators_updates_and_scenes_and_its_report_is_as_without_them() {
    let host = run(options());
    let token = host.pairing.token;
    let (mut operator, _) = patiently(Master::operate(&host.pairing)).await;
    let mut observers = [observer(&host, token).await, observer(&host, token).await];
    // neither reads while it pushes: who is slow holds nobody up
    push(&mut operator, &mut observers).await;
    for observer in &mut observers {
        catch_up(observer, &operator).await;
        let heard: Vec<u32> = observer.updates.iter().map(|of| of.sequence).collect();
        assert!(heard.is_sorted(), "{heard:?}");
        // where the host stands still for a while, QUIC drops old ones of those that then leave at once
        let heard = observer.updates.iter().map(body);
        let foreign = heard.filter(|of| !operator.updates.iter().map(body).any(|own| own == *of));
        let (foreign, all) = (foreign.count(), observer.updates.len());
        assert!(all > 1 && foreign * 10 <= all, "{foreign} of {all}");
        assert!(observer.link.counts().received.scenes > 0);
        assert_eq!(observer.link.counts().received.tools, 0);
    }
    // one vanishes, one falls silent
    let [gone, silent] = observers;
    gone.connection.close(9u32.into(), b"gone");
    patiently(operator.push(20)).await;
    let (ending, half) = patiently(operator.farewell()).await;
    assert_eq!(ending, Ending::Finished);
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.messages.up.commands, half.session.received.commands);
    assert_eq!(report.messages.down.scenes, Some(0), "the operator's alone");
    drop(silent);
}

#[tokio::test]
async fn an_observers_commands_move_nothing_and_are_counted() {
    let host = run(options());
    let token = host.pairing.token;
    let mut other = observer(&host, token).await;
    // nobody operates
    patiently(other.push(20)).await;
    let (mut operator, welcome) = patiently(Master::operate(&host.pairing)).await;
    assert_eq!(
        (welcome.tool.x, welcome.tool.y),
        (-0.25, 0.02),
        "its hello's"
    );
    patiently(other.push(100)).await;
    patiently(operator.listen(2)).await;
    let (_, half) = patiently(operator.farewell()).await;
    assert_eq!(half.session.received.commands, Some(0));
    assert_eq!(half.updates.sent, Some(0), "nothing was played");
    let (mut next, welcome) = patiently(Master::operate(&host.pairing)).await;
    assert_eq!((welcome.tool.x, welcome.tool.y), (-0.25, 0.02));
    patiently(next.push(5)).await;
    patiently(next.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    let refused = drops.get("observer_commands_refused");
    assert!((20..=120).contains(refused.unwrap()), "{refused:?}");
}

#[tokio::test]
async fn an_observer_comes_before_any_operator_and_sees_one_after_the_other() {
    let emergency = EmergencyStop::default();
    let host = run(SlaveOptions {
        emergency: emergency.clone(),
        ..options()
    });
    let token = host.pairing.token;
    let mut observer = observer(&host, token).await;
    patiently(observer.listen(3)).await;
    assert_eq!(observer.link.stopped_by(), None);
    emergency.set(true);
    patiently(observer.listen(3)).await;
    assert_eq!(observer.link.stopped_by(), Some(Side::Slave));
    emergency.set(false);
    for _ in 0..2 {
        let mut operator = patiently(eventually(&host.pairing)).await;
        push(&mut operator, std::slice::from_mut(&mut observer)).await;
        catch_up(&mut observer, &operator).await;
        patiently(operator.farewell()).await;
    }
    let heard: Vec<u32> = observer.updates.iter().map(|of| of.sequence).collect();
    assert!(heard.is_sorted(), "one count for both sessions: {heard:?}");
    // the host ends: a farewell, and no more
    host.stop.send_replace(Wish::End);
    let (ending, half) = patiently(observer.hear_farewell()).await;
    assert_eq!(ending, Ending::Interrupted);
    assert!(half.session.sent.updates > Some(0));
    observer.say_farewell().await;
    observer.connection.close(0u32.into(), b"");
    assert!(host.served().await.is_some());
}

/// An operator that goes on from where the tool is. The lease of the session before is free a moment after its farewell.
async fn eventually(pairing: &Pairing) -> Master {
    loop {
        let mut master = Master::connect(pairing).await;
        if let Ok(welcome) = master.hello(pairing.token, 1000.0).await {
            master.hip = welcome.tool;
            return master;
        }
        sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn no_more_observers_look_on_than_the_host_admits_and_none_keeps_an_operator_out() {
    let host = run(SlaveOptions {
        observers: 1,
        ..options()
    });
    let token = host.pairing.token;
    let first = observer(&host, token).await;
    assert_eq!(answer(&host, token).await, Err(Refusal::Busy));
    let (operator, _) = patiently(Master::operate(&host.pairing)).await;
    assert_eq!(answer(&host, token).await, Err(Refusal::Busy));
    // its place is free once it has left
    patiently(first.farewell()).await;
    patiently(async { while answer(&host, token).await.is_err() {} }).await;
    patiently(operator.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert!(drops.get("observers_full") >= Some(&2), "{drops:?}");
    assert_eq!(drops.get("masters_busy"), Some(&0));
    let none = run(SlaveOptions {
        observers: 0,
        ..options()
    });
    let token = none.pairing.token;
    assert_eq!(answer(&none, token).await, Err(Refusal::WrongRole));
    none.end().await;
}

#[tokio::test]
async fn an_observer_whose_token_is_revoked_is_shown_no_more_and_the_session_goes_on() {
    let home = tempfile::tempdir().unwrap();
    let host = run(SlaveOptions {
        identity: load_or_create(home.path()).unwrap(),
        ..options()
    });
    let eve = "eve".parse().unwrap();
    let token = rotate(home.path(), &eve, Some(Role::Observer)).unwrap();
    let token = token.token.token;
    let (mut operator, _) = patiently(Master::operate(&host.pairing)).await;
    let watched = observer(&host, token).await;
    let other = observer(&host, host.pairing.token).await;
    revoke(home.path(), &eve).unwrap();
    let quinn::ConnectionError::ApplicationClosed(close) =
        patiently(watched.connection.closed()).await
    else {
        panic!("not closed by the slave")
    };
    assert_eq!(close.error_code, CLOSE_REVOKED);
    assert_eq!(answer(&host, token).await, Err(Refusal::WrongToken));
    patiently(operator.push(20)).await;
    assert_eq!(other.connection.close_reason(), None, "its token counts");
    patiently(operator.farewell()).await;
    patiently(other.farewell()).await;
    host.end().await;
}

#[tokio::test]
async fn a_silent_observer_is_left_and_sends_nothing_to_the_session() {
    let host = run(options());
    let mut observer = observer(&host, host.pairing.token).await;
    // it lives, and sends nothing any more
    let (ending, _) = patiently(observer.hear_farewell()).await;
    assert_eq!(ending, Ending::Failed);
    let (operator, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(operator.farewell()).await;
    assert_eq!(host.end().await.unwrap().ending, Some("finished"));
}
