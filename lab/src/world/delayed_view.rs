//! The remote scene on its way to the operator's eyes: late by a delay, without loss or jitter.

use std::collections::VecDeque;

use mmt_client::operator::scripted::View;
use mmt_server::environment::Environment;
use mmt_shared::time::Time;

/// The scenes under way, and the one that is seen.
#[derive(Debug)]
pub(crate) struct DelayedView {
    under_way: VecDeque<(Time, View)>,
    seen: View,
}

impl DelayedView {
    /// A view of which `first` is seen from the start.
    pub(crate) fn new(first: View) -> Self {
        Self {
            under_way: VecDeque::new(),
            seen: first,
        }
    }

    /// A scene leaves that is seen from `due` on.
    pub(crate) fn show(&mut self, due: Time, scene: View) {
        self.under_way.push_back((due, scene));
    }

    /// What is seen at `now`.
    pub(crate) fn seen(&mut self, now: Time) -> View {
        while let Some((_, scene)) = self.under_way.pop_front_if(|(due, _)| *due <= now) {
            self.seen = scene;
        }
        self.seen
    }
}

/// The scene as it is.
pub(crate) fn scene(environment: &Environment, in_contact: bool) -> View {
    View {
        pose: environment.pose(),
        footprint: environment.footprint(),
        in_contact,
    }
}
