//! What a machine, a socket or a library refuses: it can be read, and nothing else be done about it.

use std::error::Error;

/// Why something could not be measured.
pub type Failure = Box<dyn Error + Send + Sync>;
