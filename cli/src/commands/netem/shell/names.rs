//! Name servers for a command whose loopback is not the host's.

use std::ffi::OsString;
use std::net::IpAddr;
use std::path::Path;
use std::process::Command;

use crate::output::note;

/// Where programs find the addresses of name servers.
const SERVERS: &str = "/etc/resolv.conf";
/// Those that systemd's resolver on loopback asks itself.
const BEHIND: &str = "/run/systemd/resolve/resolv.conf";
/// Puts one in the place of the other, in a view of the files of its own, and goes on as what follows.
const IN_ITS_PLACE: &str = r#"mount --bind "$1" "$2" && shift 2 && exec "$@""#;

/// A command of these words that reaches a name server, if one is to be had.
pub(super) fn command_with_names(words: &[OsString]) -> Command {
    let servers = std::fs::read_to_string(SERVERS).unwrap_or_default();
    if !only_on_loopback(&servers) {
        return plain(words);
    }
    if !Path::new(BEHIND).is_file() {
        note("the command resolves no names: the only name server is on the host's own loopback");
        return plain(words);
    }
    let mut command = Command::new("unshare");
    command
        .args(["--mount", "sh", "-c", IN_ITS_PLACE, "sh", BEHIND, SERVERS])
        .args(words);
    command
}

/// A command of these words.
pub(super) fn plain(words: &[OsString]) -> Command {
    let (program, rest) = words.split_first().unzip();
    let mut command = Command::new(program.unwrap_or(&OsString::new()));
    command.args(rest.unwrap_or_default());
    command
}

/// Whether a list of name servers has some, and all of them are on loopback.
fn only_on_loopback(list: &str) -> bool {
    let servers = list
        .lines()
        .filter_map(|line| line.strip_prefix("nameserver"));
    let mut addresses = servers.filter_map(|server| server.trim().parse::<IpAddr>().ok());
    let mut any = false;
    let all = addresses.all(|address| {
        any = true;
        address.is_loopback()
    });
    any && all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resolver_on_loopback_is_distinguished_from_one_that_can_be_reached() {
        let stub = "# systemd\nnameserver 127.0.0.53\noptions edns0\nsearch .\n";
        assert!(only_on_loopback(stub));
        assert!(only_on_loopback("nameserver ::1\nnameserver 127.0.0.1\n"));
        assert!(!only_on_loopback(
            "nameserver 127.0.0.53\nnameserver 192.0.2.1\n"
        ));
        assert!(!only_on_loopback("search example.org\n"));
    }
}
