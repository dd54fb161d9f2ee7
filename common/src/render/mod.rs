//! From light, shape and BRDF to pixels: the direct integrator and the transport tables.
