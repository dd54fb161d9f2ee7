//! Tests of the entry points, by format and by fault. OpenEXR has its own beside the reader.

mod hostile;
mod ldr;
mod pfm;
mod planes;
mod probes;
mod rgbe;
