//! Where an identity is kept, and the state of its file.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// A state of the file. Another one differs in it: a change replaces the file, and an editor changes its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    device: u64,
    inode: u64,
    bytes: u64,
    mode: u32,
    changed_s: i64,
    changed_ns: i64,
}

impl Seen {
    pub(super) fn of(metadata: &Metadata) -> Self {
        Self {
            device: metadata.dev(),
            inode: metadata.ino(),
            bytes: metadata.len(),
            mode: metadata.mode(),
            changed_s: metadata.ctime(),
            changed_ns: metadata.ctime_nsec(),
        }
    }
}

/// Where an identity is kept, and the state of the file that it was read from.
#[derive(Clone, Debug)]
pub(in crate::io) struct Kept {
    pub(super) path: PathBuf,
    pub(super) seen: Seen,
}
