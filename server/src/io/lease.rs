//! Who may operate: one master at a time, until its session ends or another's claim holds.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use mmt_shared::pairing::Token;
use mmt_shared::wire::Claim;
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

/// A session that has to go may take this long to end: its loop, or what a crowded host makes of it.
const GOES_WITHIN: Duration = Duration::from_secs(5);

/// The right to operate. Others are refused as long as it lives.
pub(super) struct Lease {
    _only: OwnedSemaphorePermit,
    resume: Token,
    taken_over: Arc<Notify>,
}

impl Lease {
    /// With this its holder resumes after it was started again.
    pub(super) fn resume(&self) -> Token {
        self.resume
    }

    /// Keeps others out for so long after the session, so that its master finds the slave free when its link is back.
    pub(super) async fn outlive(self, time: Duration) {
        // it makes no difference which of the two ends it
        let _ = timeout(time, self.taken_over()).await;
    }

    /// Waits until another master's claim holds.
    pub(super) async fn taken_over(&self) {
        self.taken_over.notified().await;
    }
}

/// Gives the one lease away.
#[derive(Clone)]
pub(super) struct Leases {
    free: Arc<Semaphore>,
    newest: Arc<Mutex<Option<Holder>>>,
}

/// Who has the lease, or had it last.
#[derive(Clone)]
struct Holder {
    secret: Token,
    taken_over: Arc<Notify>,
}

impl Leases {
    pub(super) fn new() -> Self {
        Self {
            free: Arc::new(Semaphore::new(1)),
            newest: Arc::default(),
        }
    }

    /// The lease, with `resume` as its secret. Where another master has it, that one's session ends if `claim` holds;
    /// none otherwise.
    pub(super) async fn claim(&self, claim: &Claim, resume: Token) -> Option<Lease> {
        let free = Arc::clone(&self.free);
        let only = if let Ok(only) = Arc::clone(&free).try_acquire_owned() {
            only
        } else {
            self.loser_to(claim)?.notify_one();
            timeout(GOES_WITHIN, free.acquire_owned())
                .await
                .ok()?
                .ok()?
        };
        let taken_over = Arc::new(Notify::new());
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        *newest = Some(Holder {
            secret: resume,
            taken_over: Arc::clone(&taken_over),
        });
        Some(Lease {
            _only: only,
            resume,
            taken_over,
        })
    }

    /// How to end the session that has to go for a claim; none if the claim does not hold.
    fn loser_to(&self, claim: &Claim) -> Option<Arc<Notify>> {
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        let holder = newest.as_ref()?;
        let holds = match claim {
            Claim::IfFree => false,
            Claim::Resume(secret) => *secret == holder.secret,
            Claim::TakeOver => true,
        };
        holds.then(|| Arc::clone(&holder.taken_over))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Token = Token::new([1; 32]);
    const OTHER: Token = Token::new([2; 32]);

    #[tokio::test]
    async fn only_a_claim_that_holds_ends_the_holders_session() {
        let leases = Leases::new();
        let first = leases.claim(&Claim::Resume(OTHER), ONE).await.unwrap();
        assert!(
            first.resume() == ONE,
            "whoever comes to a free slave gets it"
        );
        for claim in [Claim::IfFree, Claim::Resume(OTHER)] {
            assert!(leases.claim(&claim, OTHER).await.is_none());
        }
        for (claim, secret) in [(Claim::Resume(ONE), OTHER), (Claim::TakeOver, ONE)] {
            let leases = Leases::new();
            let first = leases.claim(&Claim::IfFree, ONE).await.unwrap();
            let (second, ()) = tokio::join!(leases.claim(&claim, secret), async move {
                first.taken_over().await;
                drop(first);
            });
            assert!(second.unwrap().resume() == secret);
        }
    }
}
