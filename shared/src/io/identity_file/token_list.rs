//! The tokens that a running slave takes: those that the identity's file has when somebody comes.
//!
//! The file is looked at before each hello is judged, beside the network's thread and for no longer than [`LOOK_MAX`], so that
//! no disk holds up a session. A file that cannot be read changes nothing; one that is gone lets nobody in.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use std::{fs, io};

use tokio::sync::Mutex as Turn;
use tokio::time::timeout;

use super::kept::Seen;
use super::{IdentityError, load};
use crate::io::identity::Identity;
use crate::pairing::{Pin, Token, TokenName, Tokens};
use crate::wire::Role;

/// How long a look at the file may take; then what was seen last counts.
const LOOK_MAX: Duration = Duration::from_millis(250);

/// What a token gives its holder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Granted {
    /// The token's name.
    pub name: TokenName,
    /// What its holder may be.
    pub role: Role,
}

/// The tokens of a running slave. Clones are the same.
#[derive(Clone, Debug)]
pub struct TokenList {
    inner: Arc<Inner>,
    /// One look at a time: where a disk stands still, one thread waits for it and not one for each hello.
    turn: Arc<Turn<()>>,
}

#[derive(Debug)]
struct Inner {
    /// None of an identity that is kept nowhere: its tokens never change.
    path: Option<PathBuf>,
    pin: Pin,
    known: Mutex<Known>,
}

#[derive(Debug)]
struct Known {
    tokens: Tokens,
    /// The state of the file that they come from; none once it is gone.
    seen: Option<Seen>,
    /// The newest state of the file that could not be read: one message for each is enough.
    unreadable: Option<Seen>,
}

impl TokenList {
    /// The tokens of this identity, and those that its file has later on.
    #[must_use]
    pub fn of(identity: &Identity) -> Self {
        let kept = identity.kept();
        Self {
            inner: Arc::new(Inner {
                path: kept.map(|kept| kept.path.clone()),
                pin: identity.pin(),
                known: Mutex::new(Known {
                    tokens: identity.tokens().clone(),
                    seen: kept.map(|kept| kept.seen),
                    unreadable: None,
                }),
            }),
            turn: Arc::default(),
        }
    }

    /// What this token gives its holder at this moment; none if it is nobody's. Call it inside of a tokio runtime.
    pub async fn grants(&self, token: &Token) -> Option<Granted> {
        if self.inner.path.is_some() {
            // what is not seen in time is seen by whoever comes next
            let _ = timeout(LOOK_MAX, self.look()).await;
        }
        let known = self.inner.lock();
        let found = known.tokens.find(token)?;
        Some(Granted {
            name: found.name.clone(),
            role: found.role,
        })
    }

    async fn look(&self) {
        let turn = Arc::clone(&self.turn).lock_owned().await;
        let inner = Arc::clone(&self.inner);
        let looked = tokio::task::spawn_blocking(move || {
            inner.look();
            drop(turn);
        });
        // nobody else ends it
        let _ = looked.await;
    }
}

impl Inner {
    fn lock(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the file if it is not as it was seen last.
    fn look(&self) {
        let Some(path) = &self.path else {
            return;
        };
        let seen = match fs::metadata(path) {
            Ok(metadata) => Some(Seen::of(&metadata)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            // such as no descriptor left: nothing is known of the file
            Err(_) => return,
        };
        if seen == self.lock().seen {
            return;
        }
        match load(path) {
            Ok(Some(found)) => {
                let (identity, seen) = (found.identity, Seen::of(&found.metadata));
                self.take(identity.tokens().clone(), Some(seen));
                if identity.pin() != self.pin {
                    tracing::error!(
                        "{} has another key now, and this slave shows the old one: start it again",
                        path.display()
                    );
                }
            }
            Ok(None) => {
                self.take(Tokens::default(), None);
                tracing::error!(
                    "{} is gone: nobody is let in any more; start this slave again for a new identity",
                    path.display()
                );
            }
            Err(error) => self.complain(seen, &error),
        }
    }

    fn take(&self, tokens: Tokens, seen: Option<Seen>) {
        let shown: Vec<String> = tokens
            .iter()
            .map(|of| format!("{} ({})", of.name, of.role.name()))
            .collect();
        tracing::info!("the tokens have changed; they are: {}", shown.join(", "));
        let mut known = self.lock();
        (known.tokens, known.seen, known.unreadable) = (tokens, seen, None);
    }

    fn complain(&self, seen: Option<Seen>, error: &IdentityError) {
        let mut known = self.lock();
        if known.unreadable != seen {
            known.unreadable = seen;
            drop(known);
            tracing::error!("the tokens stay as they were: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    use super::*;
    use crate::io::identity_file::{FILE_NAME, load_or_create, revoke, rotate};

    fn name(text: &str) -> TokenName {
        text.parse().unwrap()
    }

    fn kept() -> (tempfile::TempDir, TokenList, Token) {
        let home = tempfile::tempdir().unwrap();
        let identity = load_or_create(home.path()).unwrap();
        let first = identity.tokens().of_operator().unwrap().token;
        let list = TokenList::of(&identity);
        (home, list, first)
    }

    async fn role(list: &TokenList, token: &Token) -> Option<Role> {
        list.grants(token).await.map(|granted| granted.role)
    }

    #[tokio::test]
    async fn a_token_counts_from_the_moment_it_is_made_to_the_moment_it_is_revoked() {
        let (home, list, first) = kept();
        assert_eq!(role(&list, &first).await, Some(Role::Operator));
        let made = rotate(home.path(), &name("eve"), Some(Role::Observer)).unwrap();
        let granted = list.grants(&made.token.token).await.unwrap();
        assert_eq!((granted.name, granted.role), (name("eve"), Role::Observer));
        assert_eq!(role(&list, &first).await, Some(Role::Operator));
        let second = rotate(home.path(), &name("operator"), None).unwrap();
        assert_eq!(role(&list, &first).await, None);
        assert_eq!(role(&list, &second.token.token).await, Some(Role::Operator));
        revoke(home.path(), &name("eve")).unwrap();
        assert_eq!(role(&list, &made.token.token).await, None);
    }

    fn write(path: &Path, text: &str, mode: u32) {
        fs::write(path, text).unwrap();
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    }

    #[tokio::test]
    async fn a_file_that_cannot_be_read_changes_nothing_and_one_that_is_gone_lets_nobody_in() {
        let (home, list, first) = kept();
        let path = home.path().join(FILE_NAME);
        let text = fs::read_to_string(&path).unwrap();
        let other = rotate(home.path(), &name("other"), None)
            .unwrap()
            .token
            .token;
        let both = fs::read_to_string(&path).unwrap();
        for (text, mode) in [("nonsense", 0o600), (both.as_str(), 0o644)] {
            write(&path, text, mode);
            assert_eq!(role(&list, &first).await, Some(Role::Operator));
            assert_eq!(role(&list, &other).await, None, "it was never read");
        }
        write(&path, &both, 0o600);
        assert_eq!(role(&list, &other).await, Some(Role::Operator));
        fs::remove_file(&path).unwrap();
        assert_eq!(role(&list, &first).await, None);
        write(&path, &text, 0o600);
        assert_eq!(role(&list, &first).await, Some(Role::Operator));
    }

    #[tokio::test]
    async fn an_identity_that_is_kept_nowhere_keeps_its_tokens() {
        let identity = Identity::ephemeral().unwrap();
        let first = identity.tokens().of_operator().unwrap().token;
        let list = TokenList::of(&identity);
        assert_eq!(role(&list, &first).await, Some(Role::Operator));
        assert_eq!(role(&list, &Token::new([0; 32])).await, None);
    }
}
