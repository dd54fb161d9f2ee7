//! The wire: messages, framing limits, handshake and versions between coordinator and worker.
