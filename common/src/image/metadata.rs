//! Keys of the text in written files, stored as OpenEXR string attributes and PNG text chunks. The text describes
//! `match.exr` without any other file.

/// The program that wrote the file. OpenEXR's standard `software`, PNG's registered `Software`.
pub const SOFTWARE: &str = "software";
/// Free text. OpenEXR's standard `comments`, PNG's registered `Comment`.
pub const COMMENTS: &str = "comments";
/// The version of Lookalike.
pub const VERSION: &str = "lookalike.version";
/// Axes, units, colour space and camera, in words.
pub const CONVENTIONS: &str = "lookalike.conventions";
/// The factor by which radiance is multiplied before it is clipped and sRGB-encoded, a decimal number.
pub const DISPLAY_EXPOSURE: &str = "lookalike.displayExposure";
/// The BRDF model.
pub const MODEL: &str = "lookalike.model";
/// The model's parameters, as `name=value` pairs.
pub const PARAMETERS: &str = "lookalike.parameters";
/// The measured BRDF: its file and the hash of its content.
pub const BRDF: &str = "lookalike.brdf";
/// The gamma of the winning candidate.
pub const GAMMA: &str = "lookalike.gamma";
/// The environment map: its name and the hash of its content.
pub const ENVIRONMENT: &str = "lookalike.environment";
/// The camera.
pub const CAMERA: &str = "lookalike.camera";
/// The seed of all randomness.
pub const SEED: &str = "lookalike.seed";
/// Samples per pixel of a rendering.
pub const SAMPLES: &str = "lookalike.samples";
