//! The protocol between coordinator and workers: handshake, frames, messages, transfers of blobs. It maps bytes to values and back;
//! nothing here opens a socket or waits for one.
//!
//! A connection is one TCP stream with TLS 1.3 from its first byte. The coordinator presents a certificate that the access file pins
//! ([`CertificatePin`]); the worker presents no certificate. Inside TLS, in order:
//! 1. a fixed-byte preamble ([`Challenge`], [`Response`], [`Verdict`]): magic, version, mutual proof of the shared
//!    secret, bound to this TLS connection ([`ProofKey`]); parsed by hand, so that unauthenticated bytes never reach the decoder;
//! 2. frames ([`FrameReader`]): a length, checked against [`MAX_FRAME_BYTES`] before anything is allocated, a tag, a body;
//! 3. in message frames [`ToCoordinator`] or [`ToWorker`], the first ones being `Hello` and `Welcome`;
//! 4. in part frames the raw bytes of the blob that the last message announced ([`IncomingBlob`]).
//!
//! These types are used on the wire only. Types of the job graph are converted to them, and never serialised directly.

mod access;
mod certificate;
mod codec;
mod frame;
mod handshake;
mod hex;
mod message;
mod transfer;
mod version;

pub use access::{Access, AccessError, Secret};
pub use certificate::CertificatePin;
pub use codec::{CodecError, decode, decode_message, encode, encode_message};
pub use frame::{Frame, FrameError, FrameReader, FrameTag, MAX_FRAME_BYTES, frame_header};
pub use handshake::{
    CHALLENGE_BYTES, Challenge, ChannelBinding, HandshakeError, Nonce, ProofKey, RESPONSE_BYTES, Refusal, Response,
    VERDICT_BYTES, Verdict,
};
pub use message::{
    Assignment, Executing, FailureKind, Hello, LeaseName, MAX_MESSAGE_TEXT_BYTES, ProcessName, RunName, ToCoordinator,
    ToWorker, Welcome, bounded_text,
};
pub use transfer::{IncomingBlob, PART_BYTES, TransferError, parts};
pub use version::{MAGIC, PROTOCOL_VERSION};

#[cfg(test)]
mod tests;
