//! The readers of what a peer sends: the preamble, frames, messages, blobs in parts, the payloads of every kind of node; and of the
//! access file. The first byte selects the reader.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lookalike::{nodes, graph::{Blob, BlobHash, DecodedCache, RunContext}, protocol::{Access, Challenge, FrameReader, FrameTag, IncomingBlob, Response, ToCoordinator, ToWorker, Verdict, decode_message, encode_message, frame_header}, scene::GeometrySpec};
use std::{fmt::Debug, sync::Arc};

fuzz_target!(|bytes: &[u8]| {
    let Some((&choice, bytes)) = bytes.split_first() else { return };
    match choice % 7 {
        0 => preamble(bytes),
        1 => frames(bytes),
        2 => message::<ToWorker>(bytes),
        3 => message::<ToCoordinator>(bytes),
        4 => blob(bytes),
        5 => node(bytes),
        _ => text(bytes),
    }
});

/// The messages of the handshake. An accepted message is written and read back. Their two reserved bytes are ignored, because
/// another version may use them.
fn preamble(bytes: &[u8]) {
    if let Some(Ok(challenge)) = bytes.first_chunk().map(Challenge::from_bytes) {
        assert_eq!(Challenge::from_bytes(&challenge.to_bytes()), Ok(challenge));
    }
    if let Some(Ok(response)) = bytes.first_chunk().map(Response::from_bytes) {
        assert_eq!(Response::from_bytes(&response.to_bytes()), Ok(response));
    }
    if let Some(Ok(verdict)) = bytes.first_chunk().map(Verdict::from_bytes) {
        assert_eq!(Verdict::from_bytes(&verdict.to_bytes()), Ok(verdict));
    }
}

/// A stream gives the same frames, whatever the size of the pieces in which it arrives.
fn frames(bytes: &[u8]) {
    let Some((&size, stream)) = bytes.split_first() else { return };
    let read = |size: usize| {
        let (mut reader, mut read, mut end) = (FrameReader::default(), Vec::new(), None);
        for piece in stream.chunks(size) {
            reader.push(piece);
            loop {
                match reader.next_frame() {
                    Ok(Some(frame)) => read.push(frame),
                    Ok(None) => break,
                    Err(error) => {
                        end = Some(error);
                        break;
                    }
                }
            }
            if end.is_some() {
                break;
            }
        }
        let between = end.is_none() && reader.is_between_frames();
        (read, end, between)
    };
    let whole = read(stream.len().max(1));
    assert_eq!(whole, read(usize::from(size).max(1)));
    let mut again = Vec::new();
    for frame in &whole.0 {
        again.extend(frame_header(frame.tag, frame.body.len()).expect("a frame that was read"));
        again.extend(&frame.body);
        if frame.tag == FrameTag::Message {
            let _ = decode_message::<ToWorker>(&frame.body);
        }
    }
    assert!(stream.starts_with(&again));
}

/// A message. A message that was read is written and read back.
fn message<T: serde::de::DeserializeOwned + serde::Serialize + PartialEq + Debug>(bytes: &[u8]) {
    if let Ok(message) = decode_message::<T>(bytes) {
        let again = encode_message(&message).expect("a message that was read");
        assert_eq!(decode_message::<T>(&again).expect("a message that was written"), message);
    }
}

/// An announced blob that arrives in parts.
fn blob(bytes: &[u8]) {
    let Some((length, rest)) = bytes.split_first_chunk() else { return };
    let Some((&size, rest)) = rest.split_first() else { return };
    let Ok(mut incoming) = IncomingBlob::begin(BlobHash::of(rest), u64::from_le_bytes(*length)) else { return };
    let mut fits = true;
    for part in rest.chunks(usize::from(size).max(1)) {
        fits &= incoming.push(part).is_ok();
    }
    let complete = fits && rest.len() as u64 == u64::from_le_bytes(*length);
    assert_eq!(incoming.finish().is_ok(), complete);
}

/// A node of any kind with these bytes as parameters and inputs. It must not panic: libFuzzer ends the process at every panic, also
/// at one that the registry would catch.
fn node(bytes: &[u8]) {
    let registry = nodes::registry();
    let kinds: Vec<_> = registry.kinds().collect();
    let Some((&kind, mut rest)) = bytes.split_first() else { return };
    let mut pieces = Vec::new();
    while let Some((&length, after)) = rest.split_first() {
        let (piece, after) = after.split_at(usize::from(length).min(after.len()));
        pieces.push(piece);
        rest = after;
    }
    let Some((parameters, inputs)) = pieces.split_first() else { return };
    let inputs: Vec<Blob> = inputs.iter().map(|piece| Blob::new(piece.to_vec())).collect();
    let context = RunContext::new(Arc::new(DecodedCache::new(1 << 20)));
    let _ = registry.run(kinds[usize::from(kind) % kinds.len()], parameters, &inputs, &context);
}

/// The access file, and a geometry in its wire encoding.
fn text(bytes: &[u8]) {
    let _ = lookalike::protocol::decode::<GeometrySpec>(bytes);
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(access) = Access::parse(text) {
        assert_eq!(Access::parse(&access.to_json()).as_ref(), Ok(&access));
    }
}
