//! Tests of the entry points, by format and by fault. The tests of OpenEXR are beside its reader.

mod hostile;
mod ldr;
mod pfm;
mod planes;
mod probes;
mod rgbe;
mod tiff;
