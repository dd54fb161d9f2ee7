//! Encodes values to bytes and decodes them, with size limits. The only file that uses bincode.
//!
//! bincode 2.0.1 is unmaintained (RUSTSEC-2025-0141) and pinned; to replace it, replace this file. The format is bincode's standard
//! configuration (little-endian, variable-length integers, floats by their bits), so encoding is deterministic and a decoded float has
//! the bits of the encoded one.

use bincode::config::standard;
use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::frame::MAX_FRAME_BYTES;
use crate::graph::MAX_BLOB_BYTES;

/// Why a value cannot be encoded or bytes cannot be decoded.
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
    /// The bytes are not an encoding of the expected type: truncated, hostile, or written by another version.
    #[error("cannot decode {bytes} bytes: {reason}; were they written by another version?")]
    Decode {
        /// Number of bytes.
        bytes: usize,
        /// The error of the decoder.
        reason: String,
    },
    /// There are bytes after the value.
    #[error("expected {expected} bytes, found {found}; were they written by another version?")]
    Trailing {
        /// Length of the value in bytes.
        expected: usize,
        /// Number of bytes.
        found: usize,
    },
}

/// Encode a payload: parameters, inputs and outputs of nodes. Decode it with [`decode`].
///
/// # Errors
/// If the value has no encoding, or one longer than [`MAX_BLOB_BYTES`].
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    encode_within(value, MAX_BLOB_BYTES)
}

/// Decode a payload, reading all of `bytes`.
///
/// # Errors
/// If the bytes are truncated, too many, or not a `T`. At most eight times [`MAX_BLOB_BYTES`] are allocated.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    check_length(bytes.len(), MAX_BLOB_BYTES)?;
    let outcome = bincode::serde::decode_from_slice(bytes, standard().with_limit::<DECODED_BYTES>());
    all_read(bytes, outcome)
}

/// Encode a message of the protocol. Decode it with [`decode_message`].
///
/// # Errors
/// If the value has no encoding, or one that does not fit into a frame.
pub fn encode_message<T: Serialize>(message: &T) -> Result<Vec<u8>, CodecError> {
    encode_within(message, MAX_FRAME_BYTES - 1)
}

/// Decode a message of the protocol, reading all of `bytes`.
///
/// # Errors
/// If the bytes are truncated, too many, or not a `T`.
pub fn decode_message<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    check_length(bytes.len(), MAX_FRAME_BYTES)?;
    let outcome = bincode::serde::decode_from_slice(bytes, standard().with_limit::<MAX_FRAME_BYTES>());
    all_read(bytes, outcome)
}

/// bincode's limit counts decoded sizes, and an integer of eight bytes may be encoded in one byte.
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
