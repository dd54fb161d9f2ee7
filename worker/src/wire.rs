//! The protocol on a stream: the only place, for worker and coordinator alike, where protocol bytes meet tokio.

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

/// How much is read at a time.
const READ_BYTES: usize = 64 << 10;

/// How much is written at a time, large blobs apart.
const PARCEL_BYTES: usize = 32 << 10;

/// A connection that cannot go on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WireError {
    /// The stream itself failed.
    #[error(transparent)]
    Stream(#[from] io::Error),
    /// The TLS handshake failed because of what the other side is.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The handshake inside TLS failed.
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
    /// The peer sent something that is no frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The peer sent something that is no message.
    #[error(transparent)]
    Codec(#[from] CodecError),
    /// The peer sent a blob that is not the announced one.
    #[error(transparent)]
    Transfer(#[from] TransferError),
    /// The stream ended where it should not.
    #[error("the connection ended")]
    Ended,
    /// The peer said nothing for too long.
    #[error("no answer in time")]
    TimedOut,
    /// A message or part where none is allowed.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// What is allowed.
        expected: &'static str,
        /// What came.
        found: String,
    },
}

impl WireError {
    /// Whether the peer broke the protocol, as opposed to the stream having ended under it.
    #[must_use]
    pub fn is_violation(&self) -> bool {
        !matches!(self, Self::Stream(_) | Self::Ended | Self::TimedOut)
    }

    /// Whether another attempt would end in the same way: the two sides do not fit, or one refuses the other.
    #[must_use]
    pub fn is_final(&self) -> bool {
        matches!(self, Self::Tls(_) | Self::Handshake(_))
    }
}

/// What comes next on a stream.
#[derive(Debug)]
pub enum Received<T> {
    /// A message.
    Message(T),
    /// A part of the blob that was announced last.
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

    /// Read frames from `stream`, cut by `frames`: it says how long they may be.
    pub fn with_frames(stream: R, frames: FrameReader) -> Self {
        Self { stream, frames, chunk: vec![0; READ_BYTES], heard: Instant::now() }
    }

    /// The next message or part; `None` when the stream ended between frames. Nothing is lost when the future is dropped.
    ///
    /// # Errors
    /// When the stream fails, ends inside a frame, or holds anything else than frames with messages of type `T` and parts.
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

    /// The next message or part, if all of it has been read. Call it until `None` before the next [`read`](Self::read).
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

    /// Read what there is, at least a byte; `false` when the stream ended between frames. Nothing is lost when the future is dropped.
    ///
    /// # Errors
    /// When the stream fails, or ends inside a frame.
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

    /// When something was read last: every byte is a sign of life, however long the frame is that it belongs to.
    pub fn heard(&self) -> Instant {
        self.heard
    }

    /// The next thing, which has to be a message.
    ///
    /// # Errors
    /// As [`next`](Self::next), and when a part comes or the stream ends.
    pub async fn message<T: DeserializeOwned>(&mut self) -> Result<T, WireError> {
        match self.next().await? {
            Some(Received::Message(message)) => Ok(message),
            Some(Received::Part(_)) => {
                Err(WireError::Unexpected { expected: "a message", found: "a part of a blob".into() })
            }
            None => Err(WireError::Ended),
        }
    }
}

/// Send a message.
///
/// # Errors
/// When the stream fails or the message does not fit into a frame.
pub async fn send_message<T: Serialize>(stream: &mut (impl AsyncWrite + Unpin), message: &T) -> Result<(), WireError> {
    let mut parcel = Parcel::default();
    parcel.add(message)?;
    parcel.send(stream).await
}

/// Frames that leave together: a write costs as much as many small messages do.
#[derive(Debug, Default)]
pub struct Parcel {
    bytes: Vec<u8>,
}

impl Parcel {
    /// Add a message.
    ///
    /// # Errors
    /// When it does not fit into a frame.
    pub fn add<T: Serialize>(&mut self, message: &T) -> Result<(), WireError> {
        let body = encode_message(message)?;
        self.bytes.extend_from_slice(&frame_header(FrameTag::Message, body.len())?);
        self.bytes.extend_from_slice(&body);
        Ok(())
    }

    /// Add a blob behind the message that announces it, if it is small; else send all there is, and the blob.
    ///
    /// # Errors
    /// When the stream fails.
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

    /// Whether it is time to send it, whatever else there is to be sent.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.bytes.len() >= PARCEL_BYTES
    }

    /// Write everything that was added; nothing of it stays.
    ///
    /// # Errors
    /// When the stream fails.
    pub async fn send(&mut self, stream: &mut (impl AsyncWrite + Unpin)) -> Result<(), WireError> {
        stream.write_all(&self.bytes).await?;
        // TLS may hold back what the socket did not take.
        stream.flush().await?;
        self.bytes.clear();
        // A message may be long once.
        self.bytes.shrink_to(2 * PARCEL_BYTES);
        Ok(())
    }
}

/// Whether a blob travels in one parcel with other things.
#[must_use]
pub fn is_small(blob: &Blob) -> bool {
    blob.len() <= PARCEL_BYTES
}

/// The worker's side of the preamble: prove the secret, and have it proved.
///
/// # Errors
/// When the stream fails, or the other side is no coordinator of this version that knows the secret and accepts us.
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

/// The coordinator's side of the preamble: challenge, judge, and tell the verdict.
///
/// # Errors
/// When the stream fails, or the other side is no worker of this version that knows the secret.
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
    async fn what_leaves_together_arrives_in_order_small_or_large() {
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
