//! Ends that nobody wished for: a session that failed, a haptic thread that panics or hangs.

use super::*;
use crate::io::haptic::HapticLoop;
use crate::io::open::Opening;
use crate::io::session::operate;

#[tokio::test]
async fn a_master_whose_session_failed_keeps_what_lets_it_in_again_at_once() {
    for (ending, keeps) in [(Ending::Failed, true), (Ending::Interrupted, false)] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("resume");
        let fake = Fake::new();
        let mut options = scripted(&fake);
        options.resume = ResumeFile::open(&path).unwrap();
        let mut master = start(options, TIMEOUTS);
        let mut slave = Session::welcomed(&fake).await;
        slave.say_farewell(ending, totals()).await;
        master.end().await.unwrap();
        let again = ResumeFile::open(&path).unwrap().unwrap();
        assert_eq!(again.secret().is_some(), keeps, "{ending:?}");
    }
}

/// What becomes of a session whose haptic thread does this in its first tick; the slave is sent a farewell without a report.
async fn ended_by(
    body: impl FnOnce() -> HapticLoop + Send + 'static,
) -> Result<MasterReport, MasterHostError> {
    let fake = Fake::new();
    let options = scripted(&fake);
    let opening = Opening::of_operator(&options, Vec2::new(-0.45, 0.0));
    let (opened, mut slave) = tokio::join!(open(&opening, &TIMEOUTS), Session::welcomed(&fake));
    let (_stop, stop) = watch::channel(Wish::GoOn);
    let (live, _shown) = watch::channel(MasterLive::default());
    let clock = Clock::start();
    let opened = opened.unwrap();
    let ending = operate(
        &options,
        opened,
        clock,
        |_, mut ticker| {
            ticker.wait();
            body()
        },
        stop,
        live,
        &TIMEOUTS,
    );
    let (ended, farewell) = tokio::join!(ending, slave.serve());
    assert_eq!((farewell.ending, farewell.report), (Ending::Failed, None));
    timeout(FOR_EVER, slave.connection.closed()).await.unwrap();
    ended
}

#[tokio::test]
async fn a_panic_in_the_haptic_thread_is_an_error_and_closes_the_connection() {
    // no backtrace: where the host is busy, writing one takes so long that the watchdog sees a tick that hangs
    let panics = || std::panic::resume_unwind(Box::new("on purpose"));
    let ended = ended_by(panics).await;
    assert!(matches!(ended, Err(MasterHostError::Panicked)));
}

#[tokio::test]
async fn a_tick_that_hangs_is_an_error_and_closes_the_connection() {
    let hangs = || {
        loop {
            std::thread::park();
        }
    };
    assert!(matches!(ended_by(hangs).await, Err(MasterHostError::Hung)));
}
