//! Frames: split a stream of bytes into messages and parts of blobs.
//!
//! ```text
//!   length: u32, little-endian, of what follows    tag: u8    body: length - 1 bytes
//! ```

use thiserror::Error;

/// The largest `length` of a frame, tag included (2 MiB): a node's parameters (1 MiB) with 4096 inputs, or a part of a blob (1 MiB).
/// Large blobs are sent in many parts, so that frames are small and an unauthenticated peer cannot cause a larger allocation. A message
/// may have to wait until a whole blob is sent; therefore every received byte counts as a sign of life.
pub const MAX_FRAME_BYTES: usize = 2 << 20;

/// Length and tag.
const HEADER_BYTES: usize = 5;

/// The content of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameTag {
    /// An encoded message.
    Message = 0,
    /// Raw bytes of the blob that the last message announced.
    Part = 1,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The content of the body.
    pub tag: FrameTag,
    /// The body: at most [`MAX_FRAME_BYTES`] - 1 bytes.
    pub body: Vec<u8>,
}

/// Bytes that are not a frame. The rest of the stream cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The announced length is out of range.
    #[error("expected a frame of 1 to {limit} bytes, found {found}")]
    Length {
        /// The announced length.
        found: usize,
        /// The largest length allowed.
        limit: usize,
    },
    /// The tag is unknown.
    #[error("expected frame tag 0 or 1, found {found}")]
    Tag {
        /// The tag.
        found: u8,
    },
}

/// The header of a frame with a body of this length.
///
/// # Errors
/// If the body does not fit into a frame.
pub fn frame_header(tag: FrameTag, body_bytes: usize) -> Result<[u8; HEADER_BYTES], FrameError> {
    let too_long = FrameError::Length { found: body_bytes.saturating_add(1), limit: MAX_FRAME_BYTES };
    if body_bytes >= MAX_FRAME_BYTES {
        return Err(too_long);
    }
    let [a, b, c, d] = u32::try_from(body_bytes + 1).map_err(|_| too_long)?.to_le_bytes();
    Ok([a, b, c, d, tag as u8])
}

/// Splits a stream of bytes into frames. Buffers at most one incomplete frame and the last pushed bytes.
#[derive(Debug)]
pub struct FrameReader {
    buffer: Vec<u8>,
    /// Length of the part of the buffer that was already returned as frames.
    consumed: usize,
    limit: usize,
}

/// Reads frames of up to [`MAX_FRAME_BYTES`].
impl Default for FrameReader {
    fn default() -> Self {
        Self::with_limit(MAX_FRAME_BYTES)
    }
}

impl FrameReader {
    /// A reader of frames of up to `limit` bytes, tag included, and at most [`MAX_FRAME_BYTES`].
    #[must_use]
    pub fn with_limit(limit: usize) -> Self {
        Self { buffer: Vec::new(), consumed: 0, limit: limit.min(MAX_FRAME_BYTES) }
    }

    /// Take more bytes of the stream.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.consumed);
        self.consumed = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// The next complete frame; `None` when more bytes are needed. Call it until `None` before the next [`push`](Self::push).
    ///
    /// # Errors
    /// If the header is invalid; this is detected before the body arrives. Every further call returns the same error.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, FrameError> {
        let unread = &self.buffer[self.consumed..];
        let Some((header, rest)) = unread.split_first_chunk::<HEADER_BYTES>() else {
            return Ok(None);
        };
        let [a, b, c, d, tag] = *header;
        let length = usize::try_from(u32::from_le_bytes([a, b, c, d])).unwrap_or(usize::MAX);
        if !(1..=self.limit).contains(&length) {
            return Err(FrameError::Length { found: length, limit: self.limit });
        }
        let tag = match tag {
            0 => FrameTag::Message,
            1 => FrameTag::Part,
            found => return Err(FrameError::Tag { found }),
        };
        let Some(body) = rest.get(..length - 1) else {
            return Ok(None);
        };
        let body = body.to_vec();
        self.consumed += HEADER_BYTES + body.len();
        Ok(Some(Frame { tag, body }))
    }

    /// Whether the stream may end here, which is not inside a frame.
    #[must_use]
    pub fn is_between_frames(&self) -> bool {
        self.consumed == self.buffer.len()
    }
}
