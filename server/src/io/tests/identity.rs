//! Whose token lets whom in, while the slave runs.

use mmt_shared::io::identity_file::{load_or_create, revoke, rotate};
use mmt_shared::pairing::TokenName;
use mmt_shared::wire::Role;

use super::*;

fn name(text: &str) -> TokenName {
    text.parse().unwrap()
}

/// A host whose identity is kept in this directory.
fn kept_in(home: &tempfile::TempDir) -> Running {
    run(SlaveOptions {
        identity: load_or_create(home.path()).unwrap(),
        ..options()
    })
}

/// What the slave answers to a master with this token.
async fn answer(host: &Running, token: Token) -> Result<(), Refusal> {
    let mut master = Master::connect(&host.pairing).await;
    master.hello(token, 1000.0).await.map(|_| ())
}

#[tokio::test]
async fn a_token_that_is_replaced_or_revoked_lets_nobody_in_and_the_session_it_began_goes_on() {
    let home = tempfile::tempdir().unwrap();
    let host = kept_in(&home);
    let first = host.pairing.token;
    let (mut master, welcome) = patiently(Master::operate(&host.pairing)).await;
    let second = rotate(home.path(), &name("operator"), None).unwrap();
    let second = second.token.token;
    patiently(master.push(20)).await;
    // the token is judged before the lease: the one is unknown, the other comes at the wrong time
    let unknown = patiently(answer(&host, first)).await;
    assert_eq!(unknown, Err(Refusal::WrongToken));
    assert_eq!(patiently(answer(&host, second)).await, Err(Refusal::Busy));
    // not even with the secret of the session that goes on
    let mut again = Master::connect(&host.pairing).await;
    again.claim = Claim::Resume(welcome.resume);
    let refused = patiently(again.hello(first, 1000.0)).await;
    assert_eq!(refused, Err(Refusal::WrongToken));
    revoke(home.path(), &name("operator")).unwrap();
    let revoked = patiently(answer(&host, second)).await;
    assert_eq!(revoked, Err(Refusal::WrongToken));
    patiently(master.push(20)).await;
    let (ending, _) = patiently(master.farewell()).await;
    assert_eq!(ending, Ending::Finished);
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    let commands = report.messages.up.commands;
    assert!(commands > Some(20), "before and after: {commands:?}");
    let drops = report.drops.unwrap();
    assert_eq!(drops.get("masters_wrong_token"), Some(&3));
}

#[tokio::test]
async fn the_holder_of_another_token_ends_the_session_of_a_revoked_one_by_taking_over() {
    let home = tempfile::tempdir().unwrap();
    let host = kept_in(&home);
    let (mut revoked, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(revoked.push(5)).await;
    let other = rotate(home.path(), &name("other"), None).unwrap();
    revoke(home.path(), &name("operator")).unwrap();
    let mut next = Master::connect(&host.pairing).await;
    next.claim = Claim::TakeOver;
    let welcome = patiently(next.hello(other.token.token, 1000.0)).await;
    assert!(welcome.is_ok(), "{welcome:?}");
    patiently(revoked.connection.closed()).await;
    patiently(next.farewell()).await;
    host.end().await;
}

#[tokio::test]
async fn a_token_of_an_observer_operates_nothing_and_is_refused_by_name() {
    let home = tempfile::tempdir().unwrap();
    let host = kept_in(&home);
    let eve = rotate(home.path(), &name("eve"), Some(Role::Observer)).unwrap();
    for claim in [Claim::IfFree, Claim::TakeOver] {
        let mut master = Master::connect(&host.pairing).await;
        master.claim = claim;
        let refused = patiently(master.hello(eve.token.token, 1000.0)).await;
        assert_eq!(refused, Err(Refusal::WrongRole));
    }
    let (master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert_eq!(drops.get("masters_wrong_role"), Some(&2));
}

#[tokio::test]
async fn a_slave_that_nobody_could_operate_does_not_start() {
    let home = tempfile::tempdir().unwrap();
    load_or_create(home.path()).unwrap();
    revoke(home.path(), &name("operator")).unwrap();
    let identity = load_or_create(home.path()).unwrap();
    let bound = SlaveHost::bind(SlaveOptions {
        identity,
        ..options()
    });
    assert!(matches!(bound, Err(SlaveHostError::NoOperator)));
}
