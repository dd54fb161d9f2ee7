//! Which protocol this build speaks.

/// The first bytes that either side sends: tells a stranger's protocol from ours.
pub const MAGIC: [u8; 8] = *b"LOOKLIKE";

/// The version of everything in this module: preamble, frames and messages. Any change of them, however small, counts it
/// up; a test holds the bytes of every message to this number. Both sides have to speak the same version: workers and
/// coordinator come from one build, so there is no negotiation to get wrong.
pub const PROTOCOL_VERSION: u16 = 4;
