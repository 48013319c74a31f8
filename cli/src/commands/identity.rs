//! `mmt identity`: the tokens of a slave, which a slave that runs takes notice of.

use std::fmt;
use std::path::{Path, PathBuf};

use mmt_shared::io::identity_file::{
    Changed, IdentityError, advertised, default_directory, load_existing, revoke, rotate,
};
use mmt_shared::pairing::{Created, NamedToken, Pairing, TokenName, Tokens};
use mmt_shared::wire::Role;
use serde::Serialize;

use crate::args::{
    IdentityArguments, IdentityCommand, IdentityListArguments, RevokeArguments, RotateArguments,
};
use crate::failure::Failure;
use crate::output::{note, print, print_json};

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// What becomes of those who are there with a token that lets nobody in any more.
const OF_THOSE_WITHIN: &str = "Who operates with it goes on (--take-over with another token ends that), who looks on with it is shown no more";

/// Runs `mmt identity`.
///
/// # Errors
/// Wrong input, or an identity that cannot be read or written.
pub(crate) fn run(arguments: &IdentityArguments) -> Result<(), Failure> {
    match &arguments.command {
        IdentityCommand::List(arguments) => list(arguments),
        IdentityCommand::Rotate(arguments) => make(arguments),
        IdentityCommand::Revoke(arguments) => take_away(arguments),
    }
}

/// The directory of the identity: the one given, or the user's.
///
/// # Errors
/// None is given, and the user has none.
pub(super) fn directory(given: Option<&Path>) -> Result<PathBuf, Failure> {
    match given {
        Some(directory) => Ok(directory.to_owned()),
        None => default_directory().map_err(Failure::usage),
    }
}

/// A token as it may be shown.
#[derive(Debug, Serialize)]
struct Shown {
    name: TokenName,
    role: Role,
    /// Null of a token that was made before moments were kept.
    created: Option<Created>,
}

impl From<&NamedToken> for Shown {
    fn from(of: &NamedToken) -> Self {
        Self {
            name: of.name.clone(),
            role: of.role,
            created: of.created.clone(),
        }
    }
}

fn shown(tokens: &Tokens) -> Vec<Shown> {
    tokens.iter().map(Shown::from).collect()
}

/// What `mmt identity list` prints.
#[derive(Debug, Serialize)]
struct Listing {
    version: &'static str,
    command: &'static str,
    file: PathBuf,
    pin: String,
    tokens: Vec<Shown>,
}

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "file  {}\npin   {}\n", self.file.display(), self.pin)?;
        let longest = self.tokens.iter().map(|of| of.name.as_str().len()).max();
        let width = longest.unwrap_or(0).max(4);
        write!(f, "{:width$}  {:8}  created", "name", "role")?;
        for Shown {
            name,
            role,
            created,
        } in &self.tokens
        {
            write!(f, "\n{name:width$}  {:8}  ", role.name())?;
            match created {
                Some(moment) => write!(f, "{moment}")?,
                None => write!(f, "unknown")?,
            }
        }
        Ok(())
    }
}

fn list(arguments: &IdentityListArguments) -> Result<(), Failure> {
    let directory = directory(arguments.identity.as_deref())?;
    let (identity, file) = load_existing(&directory).map_err(|error| failure(&error))?;
    let listing = Listing {
        version: VERSION,
        command: "identity list",
        file,
        pin: identity.pin().to_string(),
        tokens: shown(identity.tokens()),
    };
    if arguments.json {
        print_json(&listing)?;
    } else {
        print(&listing)?;
    }
    warn_of_nobody(identity.tokens());
    Ok(())
}

/// What `mmt identity rotate --json` prints. It holds the secret.
#[derive(Serialize)]
struct Made {
    version: &'static str,
    command: &'static str,
    #[serde(flatten)]
    token: Shown,
    /// Whether an old token of that name is worthless now.
    replaced: bool,
    pin: String,
    pairing: String,
}

fn make(arguments: &RotateArguments) -> Result<(), Failure> {
    let directory = directory(arguments.of.identity.as_deref())?;
    // before anything is changed
    load_existing(&directory).map_err(|error| failure(&error))?;
    let address = arguments.address.clone();
    let address = address.or_else(|| advertised(&directory)).ok_or_else(|| {
        let what = "nothing here shows where the slave listens, and a pairing string names that";
        Failure::usage(what).remedy("give --address HOST:PORT, or start `mmt slave` once")
    })?;
    let changed = rotate(&directory, &arguments.name, arguments.role);
    let Changed {
        token,
        replaced,
        pin,
        tokens,
    } = changed.map_err(|error| failure(&error))?;
    let pairing = Pairing {
        address,
        pin,
        token: token.token,
    };
    if arguments.of.json {
        print_json(&Made {
            version: VERSION,
            command: "identity rotate",
            token: Shown::from(&token),
            replaced,
            pin: pin.to_string(),
            pairing: pairing.to_string(),
        })?;
    } else {
        print(&pairing)?;
    }
    let (name, role) = (&token.name, token.role.name());
    note(if replaced {
        format!(
            "{name} has a new token, of an {role}; the old one lets nobody in any more. {OF_THOSE_WITHIN}"
        )
    } else {
        format!("{name} has a token, of an {role}")
    });
    warn_of_nobody(&tokens);
    Ok(())
}

/// What `mmt identity revoke --json` prints.
#[derive(Debug, Serialize)]
struct Revoked {
    version: &'static str,
    command: &'static str,
    #[serde(flatten)]
    token: Shown,
    /// The tokens that are left.
    tokens: Vec<Shown>,
}

fn take_away(arguments: &RevokeArguments) -> Result<(), Failure> {
    let directory = directory(arguments.of.identity.as_deref())?;
    let changed = revoke(&directory, &arguments.name).map_err(|error| failure(&error))?;
    if arguments.of.json {
        print_json(&Revoked {
            version: VERSION,
            command: "identity revoke",
            token: Shown::from(&changed.token),
            tokens: shown(&changed.tokens),
        })?;
    }
    note(format_args!(
        "the token of {} lets nobody in any more. {OF_THOSE_WITHIN}",
        changed.token.name
    ));
    warn_of_nobody(&changed.tokens);
    Ok(())
}

/// Nobody is locked out without a word.
fn warn_of_nobody(tokens: &Tokens) {
    if tokens.of_operator().is_none() {
        note(
            "no token of an operator is left: nobody can operate until `mmt identity rotate` makes one",
        );
    }
}

fn failure(error: &IdentityError) -> Failure {
    match error {
        IdentityError::NoSuchToken { .. } => {
            Failure::usage(error).remedy("give a name that `mmt identity list` shows")
        }
        _ => Failure::usage(error),
    }
}
