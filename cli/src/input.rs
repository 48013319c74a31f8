//! Files given by name: read whole, with a bound, and with the name in every complaint.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use crate::failure::Failure;

/// No input is longer, bytes: 200 times the longest recording known.
const BYTES_MAX: u64 = 512 << 20;

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
