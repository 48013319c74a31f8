//! The arguments of `mmt identity`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use mmt_shared::pairing::{Address, TokenName};
use mmt_shared::wire::Role;

use super::{help, values};

/// Arguments of `mmt identity`.
#[derive(Debug, Args)]
pub(crate) struct IdentityArguments {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: IdentityCommand,
}

/// What can be done to an identity.
#[derive(Debug, Subcommand)]
pub(crate) enum IdentityCommand {
    /// The tokens by name, role and age, and the pin; no secret
    #[command(after_help = help::IDENTITY_LIST)]
    List(IdentityListArguments),
    /// Make a new token and print its pairing string; the old token of that name is worthless from then on
    #[command(after_help = help::IDENTITY_ROTATE)]
    Rotate(RotateArguments),
    /// Make a token worthless
    #[command(after_help = help::IDENTITY_REVOKE)]
    Revoke(RevokeArguments),
}

/// Where the identity is kept, and how it is printed.
#[derive(Debug, Args)]
pub(crate) struct IdentityListArguments {
    /// Directory of the identity, as of `mmt slave` [default: $XDG_STATE_HOME/mmt]
    #[arg(long, value_name = "DIR")]
    pub(crate) identity: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `mmt identity rotate`.
#[derive(Debug, Args)]
pub(crate) struct RotateArguments {
    /// Whose token: up to 32 letters of a-z, A-Z, 0-9 and . _ -
    #[arg(long, value_name = "NAME", default_value_t = TokenName::first())]
    pub(crate) name: TokenName,
    /// What its holder may be [default: what the old one of that name may, else operator]
    #[arg(long, value_name = "ROLE", value_parser = role())]
    pub(crate) role: Option<Role>,
    /// HOST:PORT of the slave in the pairing string [default: where a slave of this identity last listened]
    #[arg(long, value_name = "HOST:PORT", value_parser = values::address)]
    pub(crate) address: Option<Address>,
    /// Where it is kept, and how it is printed.
    #[command(flatten)]
    pub(crate) of: IdentityListArguments,
}

/// Arguments of `mmt identity revoke`.
#[derive(Debug, Args)]
pub(crate) struct RevokeArguments {
    /// The token's name, as `mmt identity list` shows it
    #[arg(value_name = "NAME")]
    pub(crate) name: TokenName,
    /// Where it is kept, and how it is printed.
    #[command(flatten)]
    pub(crate) of: IdentityListArguments,
}

/// A role by its name.
fn role() -> impl TypedValueParser<Value = Role> {
    PossibleValuesParser::new(Role::ALL.map(Role::name))
        .try_map(|name| Role::by_name(&name).ok_or("no such role"))
}
