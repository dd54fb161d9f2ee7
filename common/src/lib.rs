//! Lookalike finds the parameters of an analytic BRDF that make a rendering look like a photograph of a homogeneous
//! material under known natural light. It implements Bieron & Peers, *An Adaptive Metric for BRDF Appearance Matching*
//! (Workshop on Material Appearance Modeling, 2020), cited below as **\[BP20b\]**.
//!
//! This crate is pure: the science ([`math`], [`image`], [`light`], [`scene`], [`brdf`], [`render`], [`metric`],
//! [`search`], [`fit`]), its steps as nodes of a job graph ([`nodes`], [`plan`]), the job graph ([`graph`]) and the
//! wire format ([`protocol`]). No code here opens a file or a socket, reads a clock or an environment variable, or
//! prints.
//!
//! Conventions: world right-handed, +Y up; the camera sits on +Z and looks along -Z; directions are unit vectors that
//! point away from the surface; radiance is linear with Rec. 709 primaries; images are row-major, top left first.

pub mod brdf;
pub mod choice;
pub mod fit;
pub mod graph;
pub mod image;
pub mod light;
pub mod math;
pub mod metric;
pub mod nodes;
pub mod plan;
pub mod protocol;
pub mod render;
pub mod scene;
pub mod search;
