//! The protocol version of this build.

/// The first bytes that either side sends, to detect peers that speak another protocol.
pub const MAGIC: [u8; 8] = *b"LOOKLIKE";

/// The version of preamble, frames and messages. Any change of them needs a new number; a test checks the bytes of every message
/// against it. Parameters and outputs of nodes are bytes to the protocol, so a change of them needs no new number. Both sides must have the
/// same version; there is no negotiation, because workers and coordinator come from one build.
pub const PROTOCOL_VERSION: u16 = 5;
