//! A client of an Inverse Service on the vendor's own crate `haply`. It is no part of the workspace: `.ci/devices` builds it by
//! itself, and holds the emulated service against it.

use std::time::Duration;

use haply::HaplyDevice;
use haply::device_model::{Force, ForceInput};

/// Asks for this force so often, a millisecond apart.
async fn push(device: &mut HaplyDevice, id: &str, (x, y): (f64, f64), times: u32) {
    for _ in 0..times {
        let forces = Force { x: x as _, y: y as _, z: 0.0 };
        let device_id = id.to_owned();
        let asked = device.update_force(vec![ForceInput { device_id, forces }], Some(true), Some(true));
        asked.await.expect("a force that is sent");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::main]
async fn main() {
    let at = std::env::args().nth(1).expect("the address of the service");
    let (http, ws) = (format!("http://{at}"), format!("ws://{at}/"));
    let mut device = HaplyDevice::new(&http, &ws).await.expect("a connection");
    let version = device.get_service_version().await.expect("a version");
    let listed = device.list_devices().await.expect("a list of devices").len();
    tokio::time::sleep(Duration::from_millis(200)).await;
    let state = device.read_state().await.expect("a state");
    let id = state.inverse3.first().expect("an Inverse3").device_id.clone();
    push(&mut device, &id, (0.0, 0.0), 100).await;
    let state = device.read_state().await.expect("a state");
    let at = state.inverse3[0].state.cursor_position.expect("a place");
    push(&mut device, &id, (0.75, -1.0), 300).await;
    push(&mut device, &id, (0.0, 0.0), 50).await;
    println!(
        "{{\"version\": \"{}\", \"listed\": {listed}, \"place\": [{}, {}, {}]}}",
        version.project_version, at.x, at.y, at.z
    );
    device.shutdown().await.expect("an end");
}
