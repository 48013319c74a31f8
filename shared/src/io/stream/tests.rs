//! Frames between two endpoints on loopback.

use super::*;
use crate::io::tests::{PATIENCE, pair};

#[tokio::test]
async fn frames_arrive_whole_in_order_and_bounded() {
    let (_endpoint, _slave, up, down) = pair().await;
    let master = async {
        let (mut send, receive) = up.open_bi().await.unwrap();
        for message in [b"hello".as_slice(), b"", &[7; 3000]] {
            write_frame(&mut send, message, PATIENCE).await.unwrap();
        }
        send.finish().unwrap();
        (send, receive)
    };
    let slave = async {
        let (_, mut receive) = down.accept_bi().await.unwrap();
        let mut frames = Vec::new();
        loop {
            match read_frame(&mut receive, 3000, PATIENCE).await {
                Ok(frame) => frames.push(frame),
                Err(error) => return (frames, error),
            }
        }
    };
    let (_, (frames, end)) = tokio::join!(master, slave);
    assert_eq!(frames, [b"hello".to_vec(), vec![], vec![7; 3000]]);
    assert!(matches!(end, ReadFrameError::Finished));
}

#[tokio::test]
async fn frames_that_break_the_rules_are_named() {
    let (_endpoint, _slave, up, down) = pair().await;
    let (mut send, _keep) = up.open_bi().await.unwrap();
    send.write_all(&11u32.to_le_bytes()).await.unwrap();
    let (_, mut receive) = down.accept_bi().await.unwrap();
    let error = read_frame(&mut receive, 10, PATIENCE).await.unwrap_err();
    assert!(matches!(
        error,
        ReadFrameError::TooLong { bytes: 11, max: 10 }
    ));
    let brief = Duration::from_millis(50);
    let error = read_frame(&mut receive, 10, brief).await.unwrap_err();
    assert!(matches!(error, ReadFrameError::Slow { .. }));
    send.write_all(&[9, 0]).await.unwrap();
    send.finish().unwrap();
    let error = read_frame(&mut receive, 10, PATIENCE).await.unwrap_err();
    assert!(matches!(error, ReadFrameError::Truncated));
    // the peer reads nothing: its window fills, and the write gives up
    let error = write_frame(&mut send, &[0; 10], brief).await.unwrap_err();
    assert!(matches!(error, WriteFrameError::Stream(_)));
}
