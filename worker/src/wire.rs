//! The protocol on a tokio stream, for worker and coordinator. Only this file reads and writes protocol bytes on streams.

use std::io;

use lookalike::graph::Blob;
use lookalike::protocol::{
    CHALLENGE_BYTES, Challenge, CodecError, FrameError, FrameReader, FrameTag, HandshakeError, Nonce, ProofKey,
    RESPONSE_BYTES, Response, TransferError, VERDICT_BYTES, Verdict, decode_message, encode_message, frame_header,
    parts,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::Instant;

use crate::tls::TlsError;

/// How many bytes are read at a time.
const READ_BYTES: usize = 64 << 10;

/// How many bytes are written at a time, except for large blobs.
const PARCEL_BYTES: usize = 32 << 10;

/// Why a connection cannot continue.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WireError {
    /// The stream itself failed.
    #[error(transparent)]
    Stream(#[from] io::Error),
    /// The TLS handshake failed because of the peer.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The handshake inside TLS failed.
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
    /// The peer sent bytes that are not a frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The peer sent bytes that are not a message.
    #[error(transparent)]
    Codec(#[from] CodecError),
    /// The peer sent a blob that is not the announced one.
    #[error(transparent)]
    Transfer(#[from] TransferError),
    /// The stream ended unexpectedly.
    #[error("the connection ended")]
    Ended,
    /// The peer sent nothing for too long.
    #[error("no answer in time")]
    TimedOut,
    /// A message or part where none is allowed.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// What was expected.
        expected: &'static str,
        /// What was received.
        found: String,
    },
}

impl WireError {
    /// [`WireError::Unexpected`].
    pub fn unexpected(expected: &'static str, found: impl Into<String>) -> Self {
        Self::Unexpected { expected, found: found.into() }
    }

    /// Whether the peer violated the protocol; false if the stream failed or ended.
    #[must_use]
    pub fn is_violation(&self) -> bool {
        !matches!(self, Self::Stream(_) | Self::Ended | Self::TimedOut)
    }

    /// Whether a retry would fail again, because the two sides are incompatible or one refuses the other.
    #[must_use]
    pub fn is_final(&self) -> bool {
        matches!(self, Self::Tls(_) | Self::Handshake(_))
    }
}

/// The next item on a stream.
#[derive(Debug)]
pub enum Received<T> {
    /// A message.
    Message(T),
    /// A part of the last announced blob.
    Part(Vec<u8>),
}

/// The reading half of a connection, after the handshake.
#[derive(Debug)]
pub struct Incoming<R> {
    stream: R,
    frames: FrameReader,
    chunk: Vec<u8>,
    heard: Instant,
}

impl<R: AsyncRead + Unpin> Incoming<R> {
    /// Read frames from `stream`.
    pub fn new(stream: R) -> Self {
        Self::with_frames(stream, FrameReader::default())
    }

    /// Read frames from `stream` with `frames`, which sets their largest length.
    pub fn with_frames(stream: R, frames: FrameReader) -> Self {
        Self { stream, frames, chunk: vec![0; READ_BYTES], heard: Instant::now() }
    }

    /// The next message or part; `None` if the stream ended between frames. Cancel safe: no bytes are lost if the future is dropped.
    ///
    /// # Errors
    /// If the stream fails, ends inside a frame, or has anything but frames with messages of type `T` and parts.
    pub async fn next<T: DeserializeOwned>(&mut self) -> Result<Option<Received<T>>, WireError> {
        loop {
            if let Some(received) = self.complete()? {
                return Ok(Some(received));
            }
            if !self.read().await? {
                return Ok(None);
            }
        }
    }

    /// The next message or part, if it was read completely. Call it until `None` before the next [`read`](Self::read).
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub fn complete<T: DeserializeOwned>(&mut self) -> Result<Option<Received<T>>, WireError> {
        let Some(frame) = self.frames.next_frame()? else { return Ok(None) };
        Ok(Some(match frame.tag {
            FrameTag::Message => Received::Message(decode_message(&frame.body)?),
            FrameTag::Part => Received::Part(frame.body),
        }))
    }

    /// Read the available bytes, at least one; `false` if the stream ended between frames. Cancel safe: no bytes are lost if the future is
    /// dropped.
    ///
    /// # Errors
    /// If the stream fails, or ends inside a frame.
    pub async fn read(&mut self) -> Result<bool, WireError> {
        let count = self.stream.read(&mut self.chunk).await?;
        self.heard = Instant::now();
        match count {
            0 if self.frames.is_between_frames() => return Ok(false),
            0 => return Err(WireError::Ended),
            count => self.frames.push(&self.chunk[..count]),
        }
        Ok(true)
    }

    /// When a byte was last read. Every byte is a sign of life, even in the middle of a long frame.
    pub fn heard(&self) -> Instant {
        self.heard
    }

    /// The next item, which must be a message.
    ///
    /// # Errors
    /// As [`next`](Self::next), and if it is a part or the stream ends.
    pub async fn message<T: DeserializeOwned>(&mut self) -> Result<T, WireError> {
        match self.next().await? {
            Some(Received::Message(message)) => Ok(message),
            Some(Received::Part(_)) => Err(WireError::unexpected("a message", "a part of a blob")),
            None => Err(WireError::Ended),
        }
    }
}

/// Send a message.
///
/// # Errors
/// If the stream fails or the message does not fit into a frame.
pub async fn send_message<T: Serialize>(stream: &mut (impl AsyncWrite + Unpin), message: &T) -> Result<(), WireError> {
    let mut parcel = Parcel::default();
    parcel.add(message)?;
    parcel.send(stream).await
}

/// Frames that are sent in one write, because a write takes as long as many small messages.
#[derive(Debug, Default)]
pub struct Parcel {
    bytes: Vec<u8>,
}

impl Parcel {
    /// Add a message.
    ///
    /// # Errors
    /// If it does not fit into a frame.
    pub fn add<T: Serialize>(&mut self, message: &T) -> Result<(), WireError> {
        let body = encode_message(message)?;
        self.bytes.extend_from_slice(&frame_header(FrameTag::Message, body.len())?);
        self.bytes.extend_from_slice(&body);
        Ok(())
    }

    /// Add a small blob after the message that announces it. For a large blob, send everything that was added, and then the blob.
    ///
    /// # Errors
    /// If the stream fails.
    pub async fn add_blob(&mut self, blob: &Blob, stream: &mut (impl AsyncWrite + Unpin)) -> Result<(), WireError> {
        let is_small = is_small(blob);
        for part in parts(blob) {
            self.bytes.extend_from_slice(&frame_header(FrameTag::Part, part.len())?);
            if is_small {
                self.bytes.extend_from_slice(part);
            } else {
                stream.write_all(&self.bytes).await?;
                self.bytes.clear();
                stream.write_all(part).await?;
            }
        }
        if is_small { Ok(()) } else { self.send(stream).await }
    }

    /// Whether it must be sent before more is added.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.bytes.len() >= PARCEL_BYTES
    }

    /// Write everything that was added, and empty the parcel.
    ///
    /// # Errors
    /// If the stream fails.
    pub async fn send(&mut self, stream: &mut (impl AsyncWrite + Unpin)) -> Result<(), WireError> {
        stream.write_all(&self.bytes).await?;
        // TLS may buffer bytes that the socket did not accept.
        stream.flush().await?;
        self.bytes.clear();
        // Give back the memory of an unusually long message.
        self.bytes.shrink_to(2 * PARCEL_BYTES);
        Ok(())
    }
}

/// Whether a blob is sent in one parcel with other frames.
#[must_use]
pub fn is_small(blob: &Blob) -> bool {
    blob.len() <= PARCEL_BYTES
}

/// The worker's side of the preamble: prove to know the secret, and check the coordinator's proof.
///
/// # Errors
/// If the stream fails, or the peer is not a coordinator of this version that knows the secret and accepts this worker.
pub async fn greet_coordinator(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
    key: &ProofKey,
    nonce: Nonce,
) -> Result<(), WireError> {
    let challenge = Challenge::from_bytes(&read_array::<CHALLENGE_BYTES>(stream).await?)?;
    let response = challenge.answer(key, nonce)?;
    stream.write_all(&response.to_bytes()).await?;
    stream.flush().await?;
    let verdict = Verdict::from_bytes(&read_array::<VERDICT_BYTES>(stream).await?)?;
    Ok(verdict.check(&challenge, &response, key)?)
}

/// The coordinator's side of the preamble: send the challenge, check the response, send the verdict.
///
/// # Errors
/// If the stream fails, or the peer is not a worker of this version that knows the secret.
pub async fn greet_worker(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
    key: &ProofKey,
    nonce: Nonce,
) -> Result<(), WireError> {
    let challenge = Challenge::new(nonce);
    stream.write_all(&challenge.to_bytes()).await?;
    stream.flush().await?;
    let response = Response::from_bytes(&read_array::<RESPONSE_BYTES>(stream).await?)?;
    let verdict = response.judge(&challenge, key);
    stream.write_all(&verdict.to_bytes()).await?;
    stream.flush().await?;
    verdict.refusal.map_or(Ok(()), |refusal| Err(HandshakeError::Refused(refusal).into()))
}

async fn read_array<const N: usize>(stream: &mut (impl AsyncRead + Unpin)) -> Result<[u8; N], WireError> {
    let mut bytes = [0; N];
    match stream.read_exact(&mut bytes).await {
        Ok(_) => Ok(bytes),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(WireError::Ended),
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::protocol::ToWorker;
    use tokio::io::duplex;

    #[tokio::test]
    async fn small_and_large_blobs_of_one_parcel_arrive_in_order() {
        let (mut near, far) = duplex(1000);
        let blobs = [vec![1; 10], vec![2; PARCEL_BYTES + 1], Vec::new(), vec![3; 3 << 20], vec![4; 7]].map(Blob::new);
        let sent = blobs.clone();
        let sending = tokio::spawn(async move {
            let mut parcel = Parcel::default();
            for blob in &sent {
                parcel.add(&ToWorker::Blob { hash: blob.hash().0, length: blob.len() as u64 })?;
                parcel.add_blob(blob, &mut near).await?;
            }
            parcel.send(&mut near).await
        });
        let mut incoming = Incoming::new(far);
        for blob in &blobs {
            let announced = ToWorker::Blob { hash: blob.hash().0, length: blob.len() as u64 };
            assert_eq!(incoming.message::<ToWorker>().await.unwrap(), announced);
            let mut bytes = Vec::new();
            while bytes.len() < blob.len() {
                match incoming.next::<ToWorker>().await.unwrap() {
                    Some(Received::Part(part)) => bytes.extend(part),
                    other => panic!("expected a part, found {other:?}"),
                }
            }
            assert_eq!(Blob::new(bytes), *blob);
        }
        sending.await.unwrap().unwrap();
        assert!(incoming.next::<ToWorker>().await.unwrap().is_none());
    }
}
