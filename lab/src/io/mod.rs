//! The shell of the lab: threads for the trials, a folder for the files.

mod folder;
mod pool;

pub use folder::Folder;
pub use pool::Pool;
