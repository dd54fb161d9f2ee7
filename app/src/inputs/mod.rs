//! Reads, decodes and checks the files that the settings name, once, and makes the library's types of them.
//!
//! Every error names the file and its role, and says what was expected, what was found and what to do. A usable but doubtful input has
//! warnings, which the caller shows ([`show_warnings`]). Every file that a result depends on has the hash of its decoded content
//! ([`InputFile`]), for `fit.json` and the metadata of images.
//!
//! What is deliberately absent: nothing here renders, scores or writes a file.

mod capture;
mod environment;
mod exposure;
mod file;
mod geometry;
mod material;
mod photo;
mod warnings;

pub use capture::{LoadedCapture, load_capture, load_capture_under};
pub use environment::{LoadedEnvironment, load_environment};
pub use exposure::{load_display_exposure, resolve_display_exposure};
pub use file::InputFile;
pub use geometry::{LoadedGeometry, load_normals, sphere_geometry};
pub use material::{LoadedTable, flat_parameters, load_table};
pub use photo::{LoadedMask, LoadedPhoto, load_image, load_mask, load_photo};
pub use warnings::show_warnings;
