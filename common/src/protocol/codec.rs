//! The only file that uses bincode: values to bytes and back, under size limits.
//!
//! bincode 2.0.1 is unmaintained (RUSTSEC-2025-0141) and pinned; what replaces it some day replaces this file. The format
//! is bincode's standard configuration (little-endian, variable-length integers, floats by their bits), so encoding is
//! deterministic and a decoded float has the bits of the encoded one.

use bincode::config::standard;
use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::frame::MAX_FRAME_BYTES;
use crate::graph::MAX_BLOB_BYTES;

/// Bytes that are not what they should be, or a value that cannot be sent.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CodecError {
    /// The value has no encoding.
    #[error("cannot encode: {0}")]
    Encode(String),
    /// The encoding is too long.
    #[error("expected an encoding of at most {limit} bytes, found {found}; send large data as a blob")]
    TooLong {
        /// The length of the encoding in bytes.
        found: usize,
        /// The largest length allowed.
        limit: usize,
    },
    /// The bytes are no encoding of the wanted type: cut off, hostile, or of another version.
    #[error("cannot decode {bytes} bytes: {reason}; were they written by another version?")]
    Decode {
        /// How many bytes there were.
        bytes: usize,
        /// What the decoder says.
        reason: String,
    },
    /// Bytes are left over behind the value.
    #[error("expected {expected} bytes, found {found}; were they written by another version?")]
    Trailing {
        /// How many bytes the value takes.
        expected: usize,
        /// How many bytes there were.
        found: usize,
    },
}

/// Encode a payload: parameters, inputs and outputs of nodes. Decode it with [`decode`].
///
/// # Errors
/// When the value has no encoding or one beyond [`MAX_BLOB_BYTES`].
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    encode_within(value, MAX_BLOB_BYTES)
}

/// Decode a payload, reading all of `bytes`.
///
/// # Errors
/// When the bytes are cut off, too many, or no `T`. What is allocated stays within eight times [`MAX_BLOB_BYTES`].
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    check_length(bytes.len(), MAX_BLOB_BYTES)?;
    let outcome = bincode::serde::decode_from_slice(bytes, standard().with_limit::<DECODED_BYTES>());
    all_read(bytes, outcome)
}

/// Encode a message of the wire. Decode it with [`decode_message`].
///
/// # Errors
/// When the value has no encoding or one that does not fit into a frame.
pub fn encode_message<T: Serialize>(message: &T) -> Result<Vec<u8>, CodecError> {
    encode_within(message, MAX_FRAME_BYTES - 1)
}

/// Decode a message of the wire, reading all of `bytes`.
///
/// # Errors
/// When the bytes are cut off, too many, or no `T`.
pub fn decode_message<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    check_length(bytes.len(), MAX_FRAME_BYTES)?;
    let outcome = bincode::serde::decode_from_slice(bytes, standard().with_limit::<MAX_FRAME_BYTES>());
    all_read(bytes, outcome)
}

/// bincode counts decoded sizes: an integer of eight bytes may have come from one byte.
const DECODED_BYTES: usize = 8 * MAX_BLOB_BYTES;

fn encode_within<T: Serialize>(value: &T, limit: usize) -> Result<Vec<u8>, CodecError> {
    let bytes =
        bincode::serde::encode_to_vec(value, standard()).map_err(|error| CodecError::Encode(error.to_string()))?;
    check_length(bytes.len(), limit)?;
    Ok(bytes)
}

fn check_length(found: usize, limit: usize) -> Result<(), CodecError> {
    if found > limit { Err(CodecError::TooLong { found, limit }) } else { Ok(()) }
}

fn all_read<T>(bytes: &[u8], outcome: Result<(T, usize), bincode::error::DecodeError>) -> Result<T, CodecError> {
    let (value, read) =
        outcome.map_err(|error| CodecError::Decode { bytes: bytes.len(), reason: error.to_string() })?;
    if read == bytes.len() { Ok(value) } else { Err(CodecError::Trailing { expected: read, found: bytes.len() }) }
}
