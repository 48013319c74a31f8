//! tshark with the protocol's dissector: captures made of messages, and what tshark says of captures.
//!
//! The only module that starts it. Judges nothing: what a capture should show is the tests' business.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use thiserror::Error;

use crate::harness::root;

/// Port of the slave in a capture that [`write_capture`] made; the dissector's default.
pub(crate) const SLAVE_PORT: u16 = 4433;
/// Port of the master whose messages stand in datagrams.
pub(crate) const DATAGRAM_PORT: u16 = 4001;
/// Port of the master whose messages stand behind their length, as on the stream.
pub(crate) const STREAM_PORT: u16 = 4002;

/// Link type of packets that begin with their IP header (`LINKTYPE_RAW`, tcpdump.org).
const RAW_IP: u32 = 101;

/// Why tshark printed nothing.
#[derive(Debug, Error)]
pub(crate) enum TsharkError {
    /// It is not installed.
    #[error("tshark does not start: {0}")]
    Missing(std::io::Error),
    /// A file could not be written or a directory made.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// It failed, or the dissector did.
    #[error("tshark failed: {0}")]
    Failed(String),
}

/// A field of a message as tshark shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    /// Its value as text.
    pub(crate) show: String,
    /// Its bytes in hexadecimal digits.
    pub(crate) bytes: String,
}

/// What tshark found in a packet: by name, without `mmt.`, every occurrence in its order.
pub(crate) type Fields = BTreeMap<String, Vec<Field>>;

/// One UDP datagram of a capture, over IPv4, between two ports of one host.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packet<'a> {
    /// Port of the sender.
    pub(crate) from: u16,
    /// Port of the receiver.
    pub(crate) to: u16,
    /// The payload.
    pub(crate) payload: &'a [u8],
}

/// Writes a capture (pcap) of these datagrams, one a millisecond. No checksums: they are 0.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_capture(path: &Path, packets: &[Packet<'_>]) -> Result<(), TsharkError> {
    let mut file = Vec::new();
    // magic, version 2.4 in two halves of 16 bits, time zone, accuracy, longest packet, link type
    for word in [0xa1b2_c3d4, 4 << 16 | 2, 0, 0, 65535, RAW_IP] {
        file.extend(u32::to_le_bytes(word));
    }
    for (at, packet) in (0_u32..).zip(packets) {
        let ip = ipv4(packet);
        let length = u32::try_from(ip.len()).unwrap_or(u32::MAX);
        for word in [at / 1000, at % 1000 * 1000, length, length] {
            file.extend(word.to_le_bytes());
        }
        file.extend(ip);
    }
    std::fs::write(path, file).map_err(|source| TsharkError::File {
        path: path.to_owned(),
        source,
    })
}

/// The datagram behind its IPv4 and UDP headers (RFC 791, RFC 768).
fn ipv4(packet: &Packet<'_>) -> Vec<u8> {
    let length = |headers| u16::try_from(packet.payload.len() + headers).unwrap_or(u16::MAX);
    let mut bytes = vec![0x45, 0];
    bytes.extend(length(28).to_be_bytes());
    // no fragment, 64 hops, UDP, no checksum, loopback to loopback
    bytes.extend([0, 0, 0, 0, 64, 17, 0, 0, 127, 0, 0, 1, 127, 0, 0, 1]);
    bytes.extend(packet.from.to_be_bytes());
    bytes.extend(packet.to.to_be_bytes());
    bytes.extend(length(8).to_be_bytes());
    bytes.extend([0, 0]);
    bytes.extend(packet.payload);
    bytes
}

/// The options that make tshark take the two masters of [`write_capture`] for what they are.
#[must_use]
pub(crate) fn decode_as() -> Vec<String> {
    let pairs = [(DATAGRAM_PORT, "mmt"), (STREAM_PORT, "mmt_stream")];
    let options = pairs.map(|(port, name)| format!("udp.port=={port},{name}"));
    let options = options.into_iter();
    options.flat_map(|rule| ["-d".to_owned(), rule]).collect()
}

/// Standard output of tshark with the dissector on a capture, with no settings but the `options`.
///
/// # Errors
/// It is missing, fails, or the dissector fails in it.
pub(crate) fn tshark(capture: &Path, options: &[String]) -> Result<String, TsharkError> {
    // an empty directory of settings of its own: a person's must change nothing
    let settings = capture.with_extension("settings");
    std::fs::create_dir_all(&settings).map_err(|source| TsharkError::File {
        path: settings.clone(),
        source,
    })?;
    let script = root().join("docs/protocol/mmt.lua");
    let output = Command::new("tshark")
        .env("WIRESHARK_CONFIG_DIR", &settings)
        .arg("-X")
        .arg(format!("lua_script:{}", script.display()))
        .arg("-r")
        .arg(capture)
        .args(options)
        .output()
        .map_err(TsharkError::Missing)?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let printed = String::from_utf8_lossy(&output.stderr);
    let fault = ["Lua Error", "Lua:", "lua_script"];
    if !output.status.success()
        || fault
            .iter()
            .any(|f| text.contains(f) || printed.contains(f))
    {
        return Err(TsharkError::Failed(format!("{printed}\n{text}")));
    }
    Ok(text)
}

/// The fields of the messages in each packet of a capture.
///
/// # Errors
/// As [`tshark`].
pub(crate) fn dissect(capture: &Path, options: &[String]) -> Result<Vec<Fields>, TsharkError> {
    let format = ["-T".to_owned(), "pdml".to_owned()];
    let text = tshark(capture, &[options, &format[..]].concat())?;
    Ok(text.split("<packet>").skip(1).map(fields_of).collect())
}

/// The fields of a packet in PDML, which has one to a line.
fn fields_of(packet: &str) -> Fields {
    let mut fields = Fields::new();
    for line in packet.lines() {
        let name = attribute(line, "field name").unwrap_or_default();
        let Some(name) = name.strip_prefix("mmt.") else {
            continue;
        };
        let field = Field {
            show: attribute(line, "show").unwrap_or_default(),
            bytes: attribute(line, "value").unwrap_or_default(),
        };
        fields.entry(name.to_owned()).or_default().push(field);
    }
    fields
}

/// The value of an attribute in a line of XML.
fn attribute(line: &str, name: &str) -> Option<String> {
    let (_, tail) = line.split_once(&format!("{name}=\""))?;
    let (value, _) = tail.split_once('"')?;
    let plain = [
        ("&quot;", "\""),
        ("&apos;", "'"),
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&amp;", "&"),
    ];
    let plain = plain.iter();
    Some(plain.fold(value.to_owned(), |text, (from, to)| text.replace(from, to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_a_field_is_taken_apart() {
        let line = r#"<field name="mmt.a.b" showname="b: &quot;x&amp;lt;" size="2" show="&quot;x&amp;lt;" value="2278"/>"#;
        let fields = fields_of(&format!(
            "{line}\n<field name=\"udp.port\" show=\"1\"/>\n{line}"
        ));
        let field = Field {
            show: "\"x&lt;".to_owned(),
            bytes: "2278".to_owned(),
        };
        let expected = Fields::from([("a.b".to_owned(), vec![field.clone(), field])]);
        assert_eq!(fields, expected);
    }

    #[test]
    fn a_datagram_stands_behind_its_headers() {
        let packet = Packet {
            from: 1,
            to: 0x0203,
            payload: b"xy",
        };
        let bytes = ipv4(&packet);
        assert_eq!(bytes.len(), 30);
        assert_eq!(bytes.get(2..4), Some(&[0, 30][..]));
        assert_eq!(
            bytes.get(20..),
            Some(&[0, 1, 2, 3, 0, 10, 0, 0, b'x', b'y'][..])
        );
    }
}
