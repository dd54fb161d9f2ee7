//! MERL.
