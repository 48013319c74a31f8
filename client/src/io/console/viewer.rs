//! One viewer's socket: frames out, the newest only; what the person does in.

use std::sync::Arc;

use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use tokio::sync::mpsc::error::TrySendError;

use super::message::FromPage;
use super::shared::Shared;
use crate::operator::pointer::HandEvent;

/// Serves a viewer until it leaves.
pub(super) async fn serve(shared: Arc<Shared>, mut socket: WebSocket) {
    let viewer = Viewer::enter(shared);
    let shared = &viewer.shared;
    let mut frame = shared.frame.subscribe();
    let (mut about, mut operator) = (shared.about.subscribe(), shared.operator.subscribe());
    about.mark_changed();
    operator.mark_changed();
    loop {
        // the person comes first
        let out = tokio::select! {
            biased;
            came = socket.recv() => match came {
                Some(Ok(Message::Text(text))) => {
                    viewer.handle(&text);
                    continue;
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
            _ = operator.changed() => {
                let now = *operator.borrow_and_update();
                viewer.role(now).into()
            }
            _ = about.changed() => about.borrow_and_update().clone(),
            _ = frame.changed() => frame.borrow_and_update().clone(),
        };
        // a viewer that is slow waits here, by itself, and then gets the newest
        if socket.send(Message::Text(out)).await.is_err() {
            return;
        }
    }
}

/// A viewer's place; it is left when this is dropped.
struct Viewer {
    shared: Arc<Shared>,
    number: u64,
}

impl Viewer {
    /// Enters, and operates if nobody does.
    fn enter(shared: Arc<Shared>) -> Self {
        let number = {
            let mut stage = shared.stage();
            stage.viewers += 1;
            stage.viewers_ever += 1;
            stage.viewers_ever
        };
        let viewer = Self { shared, number };
        viewer.take();
        viewer
    }

    fn take(&self) {
        let mut stage = self.shared.stage();
        if stage.operator.is_none() && !stage.looks_on {
            stage.operator = Some(self.number);
            stage.give(HandEvent::NewPage);
            self.shared.operator.send_replace(stage.operator);
        }
    }

    fn leave_hand(&self) {
        let mut stage = self.shared.stage();
        if stage.operator == Some(self.number) {
            stage.operator = None;
            stage.give(HandEvent::Release);
            self.shared.operator.send_replace(None);
        }
    }

    fn role(&self, operator: Option<u64>) -> String {
        let role = match operator {
            Some(number) if number == self.number => "operator",
            None if !self.shared.stage().looks_on => "free",
            _ => "observer",
        };
        format!(r#"{{"role":"{role}"}}"#)
    }

    /// Does what the page asks for, as far as this viewer may.
    fn handle(&self, text: &Utf8Bytes) {
        let Ok(message) = FromPage::read(text) else {
            tracing::debug!("a page sent what no page of this version sends");
            return;
        };
        match message {
            FromPage::Take => return self.take(),
            FromPage::Leave => return self.leave_hand(),
            _ => {}
        }
        {
            let mut stage = self.shared.stage();
            let operates = stage.operator == Some(self.number);
            let may = operates || (message == FromPage::Stop && !stage.looks_on);
            if !may {
                return;
            }
            match message {
                FromPage::Stop => self.shared.emergency.set(true),
                FromPage::Clear => self.shared.emergency.set(false),
                _ => {}
            }
            for event in message.hand_events() {
                stage.give(event);
            }
        }
        // where nobody takes orders any more the process ends
        if let Some(order) = message.order()
            && let Err(TrySendError::Full(_)) = self.shared.orders.try_send(order)
        {
            tracing::warn!("too many orders of pages wait: this one is dropped");
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.leave_hand();
        self.shared.stage().viewers -= 1;
    }
}
