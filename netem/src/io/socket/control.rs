//! New settings for wrapped sockets while they are at work.

use std::sync::{Arc, Mutex, Weak};

use super::release::Shared;
use crate::config::{ConfigError, LinkConfig};
use crate::io::lock;

/// Takes new settings for the sockets that were made with it ([`super::SocketExtras`]), from any thread.
/// Copies control the same sockets.
#[derive(Clone, Debug, Default)]
pub struct SocketControl(Arc<Mutex<Controlled>>);

#[derive(Debug, Default)]
struct Controlled {
    /// The newest settings given; a socket made later begins with them.
    settings: Option<LinkConfig>,
    links: Vec<Weak<Shared>>,
}

impl SocketControl {
    /// New settings from now on ([`crate::Link::reconfigure`]), for sockets made earlier and for those made
    /// later.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&self, config: LinkConfig) -> Result<(), ConfigError> {
        config.check()?;
        let mut controlled = lock(&self.0);
        controlled.links.retain(|link| link.strong_count() > 0);
        for link in controlled.links.iter().filter_map(Weak::upgrade) {
            link.reconfigure(config.clone())?;
        }
        controlled.settings = Some(config);
        Ok(())
    }

    pub(super) fn attach(&self, link: &Arc<Shared>) -> Result<(), ConfigError> {
        let mut controlled = lock(&self.0);
        if let Some(settings) = &controlled.settings {
            link.reconfigure(settings.clone())?;
        }
        controlled.links.push(Arc::downgrade(link));
        Ok(())
    }
}
