//! The conventions (design section 3), as every output states them.

use serde_json::{Value, json};

/// The conventions for the numbers of a fit.
pub(crate) fn conventions() -> Value {
    json!({
        "world": "right-handed, +Y up; the camera sits on +Z and looks along -Z; image x grows to +X",
        "pixels": "column, row, top left first; pixel (c, r) covers [c, c+1] x [r, r+1]",
        "radiance": "linear, Rec. 709 primaries",
        "environment": "lat-long: image centre is +Z, u = 1/4 is +X, edges are -Z; values at texel centres, bilinear",
        "brdf": "f in 1/sr, without the cosine; directions point away from the surface",
        "alpha": "microfacet width; an artist's roughness is its square root",
        "light": "direct light from the environment only, no inter-reflection",
        "cssim": "CID of Lissner et al. 2013 (authors' defaults, fit00 working space); 0 is identical, larger is worse",
    })
}
