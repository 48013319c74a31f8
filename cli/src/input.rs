//! Files given by name: read whole, with a bound, and with the name in every complaint. And the lines of stdin, with a bound too.

use std::fs::File;
use std::io::{self, BufRead, ErrorKind, Read};
use std::path::Path;

use crate::failure::Failure;

/// No input is longer, bytes: 200 times the longest recording known.
const BYTES_MAX: u64 = 512 << 20;

/// No line of stdin is longer, bytes.
const LINE_MAX: u64 = 1 << 16;

/// The next line of `from`, without its end; none when there is none any more. What is wrong with a line is an error of kind
/// [`ErrorKind::InvalidData`], after which the lines go on.
///
/// # Errors
/// The line is too long or no UTF-8; or it cannot be read.
pub(crate) fn read_line(from: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    from.take(LINE_MAX + 1).read_until(b'\n', &mut line)?;
    if line.is_empty() {
        return Ok(None);
    }
    let ended = line.pop_if(|last| *last == b'\n').is_some();
    if line.len() as u64 > LINE_MAX {
        if !ended {
            from.skip_until(b'\n')?;
        }
        return Err(invalid(format!("a line is longer than {LINE_MAX} bytes")));
    }
    let text = String::from_utf8(line);
    text.map(Some)
        .map_err(|_| invalid("a line is no text: it is not UTF-8".to_owned()))
}

fn invalid(what: String) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, what)
}

/// The text of a file; `what` it should be is named in the error.
///
/// # Errors
/// It cannot be opened or read, is too long, or is no UTF-8.
pub(crate) fn read_text(path: &Path, what: &str) -> Result<String, Failure> {
    read_bounded(path, what, BYTES_MAX)
}

/// The bytes of a file; `what` it should be is named in the error.
///
/// # Errors
/// It cannot be opened or read, or is too long.
pub(crate) fn read_bytes(path: &Path, what: &str) -> Result<Vec<u8>, Failure> {
    bytes_bounded(path, what, BYTES_MAX)
}

fn read_bounded(path: &Path, what: &str, bytes_max: u64) -> Result<String, Failure> {
    let bytes = bytes_bounded(path, what, bytes_max)?;
    String::from_utf8(bytes).map_err(|error| {
        let (shown, at) = (path.display(), error.utf8_error().valid_up_to());
        let what = format!("{what} {shown} is no text: byte {at} is not UTF-8");
        Failure::usage(what).remedy("check that it is the right file")
    })
}

fn bytes_bounded(path: &Path, what: &str, bytes_max: u64) -> Result<Vec<u8>, Failure> {
    let shown = path.display();
    let unreadable = |error: std::io::Error| {
        let failure = Failure::usage(format!("cannot read {what} {shown}: {error}"));
        match error.kind() {
            ErrorKind::NotFound => failure.remedy("check the path"),
            ErrorKind::PermissionDenied => failure.remedy("give yourself the right to read it"),
            _ => failure.remedy("give the path of a file"),
        }
    };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(bytes_max + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > bytes_max {
        let what = format!("{what} {shown} is longer than {bytes_max} bytes");
        return Err(Failure::usage(what).remedy("check that it is the right file"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_a_bound_and_go_on_after_a_bad_one() {
        let long = "x".repeat(LINE_MAX as usize);
        let text = format!("one\n\n{long}\n{long}y\nafter\nlast");
        let mut from = text.as_bytes();
        let mut next = || read_line(&mut from);
        for line in ["one", "", long.as_str()] {
            assert_eq!(next().unwrap().as_deref(), Some(line));
        }
        assert_eq!(next().unwrap_err().kind(), ErrorKind::InvalidData);
        assert_eq!(next().unwrap().as_deref(), Some("after"));
        assert_eq!(next().unwrap().as_deref(), Some("last"));
        assert_eq!(next().unwrap(), None);
        let mut from = &b"\xff\nafter\n"[..];
        assert!(read_line(&mut from).is_err());
        assert_eq!(read_line(&mut from).unwrap().as_deref(), Some("after"));
    }

    #[test]
    fn what_cannot_be_read_is_named_with_the_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let complaint = |path: &Path| read_bounded(path, "the file", 4).unwrap_err().to_string();
        assert!(complaint(&path).contains("a.txt"), "{}", complaint(&path));
        assert!(complaint(folder.path()).contains("the path of a file"));
        std::fs::write(&path, [b'a', 0xff]).unwrap();
        assert!(complaint(&path).contains("byte 1 is not UTF-8"));
        std::fs::write(&path, "12345").unwrap();
        assert!(complaint(&path).contains("longer than 4 bytes"));
        std::fs::write(&path, "1234").unwrap();
        assert_eq!(read_bounded(&path, "the file", 4), Ok("1234".to_owned()));
    }
}
