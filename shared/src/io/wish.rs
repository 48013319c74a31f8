//! Whether a run is to end, and why. Hosts and sessions watch it.

use tokio::sync::watch;

/// What is wanted of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wish {
    /// It goes on.
    #[default]
    GoOn,
    /// A person, the system or the program asks for the end.
    End,
    /// A thread of this process panicked: the run ends in order, as failed.
    Fail,
}

impl Wish {
    /// Whether it is the end.
    pub const fn ends(self) -> bool {
        !matches!(self, Self::GoOn)
    }
}

/// Returns once the run is to end, and why; where the sender is gone nobody can ask any more. Cancel-safe.
pub async fn asked_to_stop(stop: &mut watch::Receiver<Wish>) -> Wish {
    let wish = stop.wait_for(|wish| wish.ends()).await;
    wish.map_or(Wish::End, |wish| *wish)
}
