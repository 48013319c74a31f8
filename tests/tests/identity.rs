//! A slave's tokens change while it runs, and nothing that anybody keeps or reads afterwards holds a secret.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts processes, waits for what they write and reads what they left"
)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::harness::in_real_time;
use crate::harness::process::{Ended, PROGRAM, Running};
use rustix::process::Signal;

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);

/// Two hosts in one folder: `identity` is the slave's, `state` the user's, and `out` has all that they are asked to keep.
struct Hosts {
    folder: tempfile::TempDir,
    /// What was printed, by whom.
    printed: Vec<(String, String)>,
}

impl Hosts {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("out")).unwrap();
        Self {
            folder,
            printed: Vec::new(),
        }
    }

    fn place(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// Starts a command that says all it has to say.
    fn start(&self, arguments: &[&str]) -> Running {
        let mut command = Command::new(PROGRAM);
        command
            .args(arguments)
            .env("XDG_STATE_HOME", self.folder.path().join("state"))
            .env("MMT_LOG", "trace");
        Running::start(command).unwrap()
    }

    fn slave(&self) -> (Running, String) {
        let (identity, record) = (self.place("identity"), self.place("out/slave.mcap"));
        let keeps = ["--identity", &identity, "--record", &record, "--json"];
        let mut slave = self.start(&[&["slave", "--listen", "127.0.0.1:0"], &keeps[..]].concat());
        let pairing = slave.first_line(GENEROUS).unwrap();
        (slave, pairing)
    }

    /// A master of this name that operates for a while.
    fn master(&self, name: &str, pairing: &str, duration: &str) -> Running {
        let [record, packets] = ["mcap", "csv"].map(|of| self.place(&format!("out/{name}.{of}")));
        self.start(&[
            "master",
            pairing,
            "--duration",
            duration,
            "--json",
            "--record",
            &record,
            "--netem-record",
            &packets,
        ])
    }

    /// Keeps what a command has printed, and whether it ended as it should.
    fn ended(&mut self, who: &str, ended: Ended, code: i32) -> Ended {
        assert_eq!(
            ended.status.code(),
            Some(code),
            "{who}: {}",
            last(&ended.err)
        );
        self.printed.push((who.to_owned(), ended.out.join("\n")));
        self.printed.push((who.to_owned(), ended.err.clone()));
        ended
    }

    /// What `mmt identity` prints; what it is for is left out of what was printed.
    fn identity(&mut self, arguments: &[&str]) -> String {
        let directory = self.place("identity");
        let all = [&["identity"], arguments, &["--identity", &directory]].concat();
        let mut ended = self.start(&all).end(GENEROUS).unwrap();
        let out = ended.out.join("\n");
        if arguments[0] == "rotate" {
            ended.out.clear();
        }
        self.ended(&all[..2].join(" "), ended, 0);
        out
    }

    /// The secret with which a master that is killed resumes; empty while none operates.
    fn resume_secret(&self) -> String {
        let mut kept = files(&self.folder.path().join("state"));
        kept.retain(|path| path.display().to_string().contains("resume-"));
        std::fs::read_to_string(&kept[0]).unwrap()
    }

    /// A master is refused, with these words.
    fn refuses(&mut self, who: &str, pairing: &str, words: &str) {
        let ended = self.master(who, pairing, "1s").end(GENEROUS).unwrap();
        let ended = self.ended(who, ended, 3);
        assert!(ended.err.contains(words), "{who}: {}", last(&ended.err));
    }
}

/// The end of a long text.
fn last(text: &str) -> String {
    let lines: Vec<&str> = text.lines().rev().take(12).collect();
    lines.into_iter().rev().collect::<Vec<_>>().join("\n")
}

fn token(pairing: &str) -> String {
    pairing
        .trim_end()
        .rsplit_once("token=")
        .unwrap()
        .1
        .to_owned()
}

fn bytes_of_hex(digits: &str) -> Vec<u8> {
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap();
    (0..digits.len()).step_by(2).map(byte).collect()
}

fn bytes_of_base64(text: &str) -> Vec<u8> {
    const DIGITS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let sextets = text.chars().filter_map(|c| DIGITS.find(c));
    let bits: Vec<usize> = sextets
        .flat_map(|sextet| (0..6).rev().map(move |bit| sextet >> bit & 1))
        .collect();
    let byte = |bits: &[usize]| bits.iter().fold(0, |byte, bit| byte * 2 + bit) as u8;
    bits.chunks_exact(8).map(byte).collect()
}

/// A secret in all the forms that it could be printed in.
struct Secret {
    name: &'static str,
    forms: Vec<Vec<u8>>,
}

impl Secret {
    fn new(name: &'static str, bytes: &[u8]) -> Self {
        let hex: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        let listed = format!("{bytes:?}");
        let listed = listed.trim_matches(['[', ']']).to_owned();
        let texts = [hex.to_uppercase(), hex, listed];
        let forms = texts.into_iter().map(String::into_bytes);
        Self {
            name,
            forms: forms.chain([bytes.to_vec()]).collect(),
        }
    }

    /// Whether a half of it is in there, which is more than anybody may know.
    fn is_in(&self, text: &[u8]) -> bool {
        let halves = self
            .forms
            .iter()
            .flat_map(|form| form.chunks(form.len().div_ceil(2)));
        let mut halves = halves.filter(|half| half.len() >= 12);
        halves.any(|half| holds(text, half))
    }
}

fn holds(text: &[u8], part: &[u8]) -> bool {
    let starts = text
        .iter()
        .enumerate()
        .filter(|(_, byte)| **byte == part[0]);
    let mut starts = starts.map(|(at, _)| at);
    starts.any(|at| text[at..].starts_with(part))
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let inside = std::fs::read_dir(folder)
        .unwrap()
        .map(|of| of.unwrap().path());
    let each = |path: PathBuf| {
        if path.is_dir() {
            files(&path)
        } else {
            vec![path]
        }
    };
    inside.flat_map(each).collect()
}

/// The private key of an identity, and its 32 bytes that count: the last ones (RFC 8410, section 7), or those before the public
/// key.
fn private_key(identity: &str) -> Vec<u8> {
    let (_, after) = identity.split_once("PRIVATE KEY-----").unwrap();
    let (body, _) = after.split_once("-----END").unwrap();
    let der = bytes_of_base64(body);
    // OCTET STRING of 34 bytes that holds an OCTET STRING of 32
    let at = der.windows(4).position(|of| of == [0x04, 0x22, 0x04, 0x20]);
    der[at.unwrap() + 4..][..32].to_vec()
}

/// Every secret that there is in the folder, with the place that has it by right.
fn secrets(hosts: &Hosts, tokens: &[(&'static str, &str)]) -> Vec<Secret> {
    let kept = std::fs::read_to_string(hosts.place("identity/identity.pem")).unwrap();
    let mut all = vec![Secret::new("private key", &private_key(&kept))];
    for (name, pairing) in tokens {
        all.push(Secret::new(name, &bytes_of_hex(&token(pairing))));
        assert!(
            all.last().unwrap().is_in(pairing.as_bytes()),
            "the search finds"
        );
    }
    let resume = hosts.resume_secret();
    assert_eq!(resume.len(), 64, "the master was killed in mid-session");
    all.push(Secret::new("resume", &bytes_of_hex(&resume)));
    all
}

#[test]
fn tokens_change_while_a_session_goes_on_and_nothing_that_is_kept_holds_a_secret() {
    in_real_time(|| {
        let mut hosts = Hosts::new();
        let (slave, first) = hosts.slave();
        let mut operating = hosts.master("first", &first, "4s");
        let begins = |line: &str| line.contains("the session begins");
        operating.wait_for_line(GENEROUS, begins).unwrap();
        let second = hosts.identity(&["rotate"]);
        let observer = ["rotate", "--name", "eve", "--role", "observer"];
        let eve = hosts.identity(&observer);
        let bob = hosts.identity(&["rotate", "--name", "bob"]);
        hosts.refuses("old", &first, "replaced or revoked");
        hosts.refuses("eve", &eve, "look on and not operate");
        let ended = operating.end(GENEROUS).unwrap();
        let ended = hosts.ended("first", ended, 0);
        assert_eq!(ended.document(0).unwrap()["ending"], "finished");
        hosts.identity(&["revoke", "bob"]);
        hosts.refuses("bob", &bob, "replaced or revoked");
        let listed = hosts.identity(&["list", "--json"]);
        assert!(
            listed.contains("eve") && !listed.contains("bob"),
            "{listed}"
        );
        let stranger = first.replace(&token(&first), &"5e".repeat(32));
        hosts.refuses("stranger", &stranger, "does not know the token");
        let mut killed = hosts.master("killed", &second, "60s");
        killed.wait_for_line(GENEROUS, begins).unwrap();
        let end = Instant::now() + GENEROUS;
        while hosts.resume_secret().len() < 64 && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(10));
        }
        killed.signal(Signal::KILL).unwrap();
        let killed = killed.end(GENEROUS).unwrap();
        hosts.printed.push(("killed".to_owned(), killed.err));
        slave.interrupt().unwrap();
        let mut ended = slave.end(GENEROUS).unwrap();
        assert_eq!(ended.out.remove(0), first, "printed this once");
        hosts.ended("slave", ended, 0);

        let tokens = [("first", &*first), ("second", &second), ("eve", &eve)];
        let secrets = secrets(&hosts, &[&tokens[..], &[("bob", &*bob)]].concat());
        let by_right = |path: &Path| {
            let path = path.display().to_string();
            path.ends_with("identity.pem") || path.contains("resume-")
        };
        let kept = files(hosts.folder.path());
        let records = kept
            .iter()
            .filter(|path| path.extension() == Some("mcap".as_ref()));
        assert!(records.count() >= 3, "{kept:?}");
        for secret in &secrets {
            for (who, text) in &hosts.printed {
                assert!(
                    !secret.is_in(text.as_bytes()),
                    "{} in what {who} printed",
                    secret.name
                );
            }
            for path in kept.iter().filter(|path| !by_right(path)) {
                let bytes = std::fs::read(path).unwrap();
                assert!(
                    !secret.is_in(&bytes),
                    "{} in {}",
                    secret.name,
                    path.display()
                );
            }
        }
    });
}
