//! Who operates: one master at a time, and what becomes of one that is lost.

use super::*;

#[tokio::test]
async fn a_second_master_is_refused_while_one_operates_and_let_in_afterwards() {
    let host = run(options());
    let (first, _) = patiently(Master::operate(&host.pairing)).await;
    let mut second = Master::connect(&host.pairing).await;
    let refused = patiently(second.hello(host.pairing.token, 1000.0)).await;
    assert_eq!(refused.unwrap_err(), Refusal::Busy);
    patiently(first.farewell()).await;
    let third = patiently(eventually_welcome(&host.pairing)).await;
    patiently(third.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert!(drops.get("masters_busy") >= Some(&1));
}

/// The lease of the session before is free a moment after its farewell.
async fn eventually_welcome(pairing: &Pairing) -> Master {
    loop {
        let mut master = Master::connect(pairing).await;
        match master.hello(pairing.token, 1000.0).await {
            Ok(_) => return master,
            Err(refusal) => assert_eq!(refusal, Refusal::Busy),
        }
        sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test]
async fn a_lost_connection_ends_the_session_and_the_next_master_is_served() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(5)).await;
    master.connection.close(9u32.into(), b"gone");
    drop(master);
    let mut next = patiently(eventually_welcome(&host.pairing)).await;
    patiently(next.push(5)).await;
    patiently(async {
        while !host.live.borrow().connected {
            sleep(Duration::from_millis(1)).await;
        }
    })
    .await;
    patiently(next.farewell()).await;
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.messages.up.commands, Some(5), "of the last session");
}

#[tokio::test]
async fn a_master_that_vanishes_without_a_word_loses_its_lease() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(5)).await;
    // it lives, and sends nothing any more
    let next = patiently(eventually_welcome(&host.pairing)).await;
    patiently(next.farewell()).await;
    drop(master);
    assert!(host.end().await.is_some());
}

#[tokio::test]
async fn a_master_that_was_killed_resumes_at_once_and_finds_the_world_as_it_left_it() {
    let host = run(SlaveOptions {
        once: true,
        ..options()
    });
    let (mut killed, welcome) = patiently(Master::operate(&host.pairing)).await;
    patiently(killed.push(100)).await;
    for claim in [Claim::IfFree, Claim::Resume(Token::new([1; 32]))] {
        let mut other = Master::connect(&host.pairing).await;
        other.claim = claim;
        let refused = patiently(other.hello(host.pairing.token, 1000.0)).await;
        assert_eq!(refused, Err(Refusal::Busy));
    }
    for claim in [Claim::Resume(welcome.resume), Claim::TakeOver] {
        let mut next = Master::connect(&host.pairing).await;
        next.claim = claim;
        let again = patiently(next.hello(host.pairing.token, 1000.0))
            .await
            .unwrap();
        // the tool is where it was pushed to, and not where the hello has the HIP
        assert!(again.tool.x > welcome.tool.x + 0.1, "{}", again.tool);
        assert!(again.resume != welcome.resume);
        let closed = patiently(killed.connection.closed()).await;
        let quinn::ConnectionError::ApplicationClosed(close) = closed else {
            panic!("{closed}")
        };
        assert_eq!(close.error_code, CLOSE_TAKEN_OVER);
        killed = next;
    }
    patiently(killed.farewell()).await;
    // a session that was taken over is not the first that was over
    assert!(host.served().await.is_some());
}

#[tokio::test]
async fn a_master_that_falls_silent_is_disengaged_and_resumes() {
    let host = run(options());
    let (mut silent, welcome) = patiently(Master::operate(&host.pairing)).await;
    patiently(silent.push(100)).await;
    let (ending, half) = patiently(silent.hear_farewell()).await;
    assert_eq!(ending, Ending::Failed);
    assert_eq!(half.session.drops.get("samples_disengaged"), Some(&0));
    silent.connection.close(0u32.into(), b"");
    let mut other = Master::connect(&host.pairing).await;
    let refused = patiently(other.hello(host.pairing.token, 1000.0)).await;
    assert_eq!(refused, Err(Refusal::Busy));
    let mut again = Master::connect(&host.pairing).await;
    again.claim = Claim::Resume(welcome.resume);
    let resumed = patiently(again.hello(host.pairing.token, 1000.0)).await;
    assert!(resumed.unwrap().tool.x > welcome.tool.x);
    host.end().await;
}
