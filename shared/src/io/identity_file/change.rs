//! What changes an identity that is kept: its tokens, one at a time, and the address that its slave is reached at.
//!
//! A change puts a new file in the place of the old one, so that whoever reads meets one of the two, whole. Key and
//! certificate stay as they are.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::{FILE_NAME, Found, IdentityError, file_error, load};
use crate::io::identity::{GenerateError, created_now, with_tokens};
use crate::pairing::{Address, NamedToken, Pin, Token, TokenName, Tokens};
use crate::wire::Role;

/// Name of the file that has the slave's address. It is no secret.
const ADDRESS_NAME: &str = "address";

/// A change that was made.
#[derive(Clone, Debug)]
pub struct Changed {
    /// The token that was made or taken away.
    pub token: NamedToken,
    /// Whether the token took the place of another one.
    pub replaced: bool,
    /// The tokens as they are now.
    pub tokens: Tokens,
    /// The slave's pin, which no change touches.
    pub pin: Pin,
}

/// Makes a token of this name, in the place of the one that has the name if there is one; of that one it keeps the role unless
/// `role` is given.
///
/// # Errors
/// There is no identity, it cannot be read or written, or it has as many tokens as it may.
pub fn rotate(
    directory: &Path,
    name: &TokenName,
    role: Option<Role>,
) -> Result<Changed, IdentityError> {
    let token = Token::generate().map_err(GenerateError::from)?;
    change(directory, |path, tokens| {
        let replaced = tokens.put(name, role, created_now(), token);
        let replaced = replaced.map_err(|source| IdentityError::Unchanged {
            path: path.to_owned(),
            source,
        })?;
        let made = tokens.get(name).cloned();
        Ok((made.ok_or_else(|| no_such(path, name, tokens))?, replaced))
    })
}

/// Takes the token of this name away.
///
/// # Errors
/// There is no identity, it cannot be read or written, or has no token of this name.
pub fn revoke(directory: &Path, name: &TokenName) -> Result<Changed, IdentityError> {
    change(directory, |path, tokens| {
        let gone = tokens.remove(name);
        Ok((gone.ok_or_else(|| no_such(path, name, tokens))?, false))
    })
}

/// Keeps the address that the slave's pairing string names, for the pairing strings of later tokens.
///
/// # Errors
/// The file system refuses.
pub fn advertise(directory: &Path, address: &Address) -> Result<(), IdentityError> {
    let (path, text) = (directory.join(ADDRESS_NAME), format!("{address}\n"));
    if fs::read_to_string(&path).is_ok_and(|found| found == text) {
        return Ok(());
    }
    let written = put(directory, &path, &text, None);
    written.map_err(|error| file_error("write", &path, error))
}

/// The address that was kept last; none if there is none that can be read.
#[must_use]
pub fn advertised(directory: &Path) -> Option<Address> {
    let text = fs::read_to_string(directory.join(ADDRESS_NAME)).ok()?;
    text.trim_end().parse().ok()
}

/// What a change did: to which token, and whether that one has taken the place of another.
type Done = (NamedToken, bool);

fn change(
    directory: &Path,
    how: impl FnOnce(&Path, &mut Tokens) -> Result<Done, IdentityError>,
) -> Result<Changed, IdentityError> {
    let none = || IdentityError::None {
        directory: directory.to_owned(),
    };
    // through a link to the file itself, so that the link stays
    let path = match fs::canonicalize(directory.join(FILE_NAME)) {
        Ok(path) => path,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(none()),
        Err(error) => return Err(file_error("find", &directory.join(FILE_NAME), error)),
    };
    let home = path.parent().unwrap_or(directory);
    let _only = only(home)?;
    let found = load(&path)?.ok_or_else(none)?;
    let mut tokens = found.identity.tokens().clone();
    let (token, replaced) = how(&path, &mut tokens)?;
    let written = put(
        home,
        &path,
        &with_tokens(&found.text, &tokens),
        Some(&found),
    );
    written.map_err(|error| file_error("replace", &path, error))?;
    Ok(Changed {
        token,
        replaced,
        tokens,
        pin: found.identity.pin(),
    })
}

/// Waits until no other process changes what is in `directory`, and keeps them out until it is dropped.
fn only(directory: &Path) -> Result<File, IdentityError> {
    let locked = File::open(directory).and_then(|open| open.lock().map(|()| open));
    locked.map_err(|error| file_error("lock", directory, error))
}

/// Puts `text` in the place of `path`, with mode 0600, for the owner of what stood there.
fn put(home: &Path, path: &Path, text: &str, before: Option<&Found>) -> io::Result<()> {
    let mut file = NamedTempFile::new_in(home)?;
    if let Some(Found { metadata, .. }) = before {
        let own = file.as_file().metadata()?;
        // root changes the identity of a service, which must be able to read it afterwards
        if (own.uid(), own.gid()) != (metadata.uid(), metadata.gid()) {
            fchown(file.as_file(), Some(metadata.uid()), Some(metadata.gid()))?;
        }
    }
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist(path)?;
    // the name as well: a token that was revoked must not come back with a power cut
    File::open(home)?.sync_all()
}

fn no_such(path: &Path, name: &TokenName, tokens: &Tokens) -> IdentityError {
    let known: Vec<&str> = tokens.iter().map(|of| of.name.as_str()).collect();
    IdentityError::NoSuchToken {
        path: PathBuf::from(path),
        name: name.to_string(),
        known: if known.is_empty() {
            "none".to_owned()
        } else {
            known.join(", ")
        },
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::io::identity_file::{load_existing, load_or_create};

    fn name(text: &str) -> TokenName {
        text.parse().unwrap()
    }

    fn home() -> tempfile::TempDir {
        let home = tempfile::tempdir().unwrap();
        load_or_create(home.path()).unwrap();
        home
    }

    #[test]
    fn a_token_is_made_replaced_and_revoked_and_the_slave_stays_the_same() {
        let home = home();
        let (before, path) = load_existing(home.path()).unwrap();
        let role = Some(Role::Observer);
        let made = rotate(home.path(), &name("alice"), role).unwrap();
        assert!(!made.replaced && made.token.role == Role::Observer);
        let again = rotate(home.path(), &name("alice"), None).unwrap();
        assert!(again.replaced && again.token.role == Role::Observer);
        let (now, _) = load_existing(home.path()).unwrap();
        assert_eq!((now.pin(), now.key()), (before.pin(), before.key()));
        assert_eq!(now.tokens(), &again.tokens);
        assert!(now.tokens().find(&made.token.token).is_none());
        assert_eq!(now.tokens().find(&again.token.token), Some(&again.token));
        assert_eq!(now.tokens().of_operator(), before.tokens().of_operator());
        revoke(home.path(), &name("operator")).unwrap();
        revoke(home.path(), &name("alice")).unwrap();
        let (nobody, _) = load_existing(home.path()).unwrap();
        assert_eq!(nobody.tokens(), &Tokens::default());
        let mode = fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        // neither the file that was replaced nor a new one that never took its place is left
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_identity_of_before_tokens_had_names_is_changed_as_any_other() {
        let home = home();
        let (made, path) = load_existing(home.path()).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let token = made.tokens().of_operator().unwrap().token;
        let line = format!("token: {}\n", token.reveal());
        let old = text.replace(&made.tokens().reveal(), &line);
        assert_ne!(old, text);
        fs::write(&path, old).unwrap();
        let (read, _) = load_existing(home.path()).unwrap();
        assert_eq!(read.tokens().of_operator().unwrap().token, token);
        rotate(home.path(), &name("operator"), None).unwrap();
        let (read, _) = load_existing(home.path()).unwrap();
        assert!(read.tokens().find(&token).is_none());
        assert_eq!((read.tokens().iter().count(), read.pin()), (1, made.pin()));
    }

    #[test]
    fn a_name_that_no_token_has_is_refused_with_those_that_there_are() {
        let home = home();
        let text = revoke(home.path(), &name("bob")).unwrap_err().to_string();
        assert!(
            text.contains("name bob") && text.contains("are: operator"),
            "{text}"
        );
    }

    #[test]
    fn an_identity_that_is_not_there_is_not_made_by_a_change() {
        let home = tempfile::tempdir().unwrap();
        for error in [
            rotate(home.path(), &name("a"), None).unwrap_err(),
            revoke(home.path(), &name("a")).unwrap_err(),
        ] {
            assert!(error.to_string().contains("--identity"), "{error}");
        }
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 0);
    }

    #[test]
    fn changes_at_once_are_all_made() {
        let home = home();
        let names: Vec<TokenName> = (0..8).map(|n| name(&format!("n{n}"))).collect();
        std::thread::scope(|scope| {
            for name in &names {
                scope.spawn(|| rotate(home.path(), name, None).unwrap());
            }
        });
        let (now, _) = load_existing(home.path()).unwrap();
        assert!(names.iter().all(|name| now.tokens().get(name).is_some()));
    }

    #[test]
    fn a_link_to_an_identity_stays_a_link() {
        let (kept, linked) = (home(), tempfile::tempdir().unwrap());
        let link = linked.path().join(FILE_NAME);
        std::os::unix::fs::symlink(kept.path().join(FILE_NAME), &link).unwrap();
        rotate(linked.path(), &name("alice"), None).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        let (now, _) = load_existing(kept.path()).unwrap();
        assert!(now.tokens().get(&name("alice")).is_some());
    }

    #[test]
    fn the_address_of_the_slave_is_kept_for_the_strings_of_later_tokens() {
        let home = home();
        assert_eq!(advertised(home.path()), None);
        for text in ["robot.example.org:4433", "[2001:db8::1]:9"] {
            let address: Address = text.parse().unwrap();
            advertise(home.path(), &address).unwrap();
            assert_eq!(advertised(home.path()), Some(address));
        }
        fs::write(home.path().join(ADDRESS_NAME), "no address").unwrap();
        assert_eq!(advertised(home.path()), None);
    }
}
