//! PNG (W3C, *Portable Network Graphics*, third edition): 8 or 16 bits (fewer are widened), grey, colour or palette,
//! with or without alpha (not premultiplied). The codes are decoded as sRGB. A warning is given if the file declares
//! other colours by `cICP`, `iCCP`, `sRGB`, `gAMA` or `cHRM`, in this order of precedence. Of an animation, the default
//! image is read.

mod keyword;
mod write;

use std::io::Cursor;

use image::codecs::png::PngDecoder;
use png::{Info, ScaledFloat};

pub use write::write;

use super::decoded::{Decoded, Format};
use super::error::ImageError;
use super::icc;
use super::ldr::Codes;
use super::source::{Source, check_pixel_aspect};

/// Decodes a PNG image.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let (codes, info) = read(source)?;
    let mut decoded = codes.into_decoded(FORMAT, 0);
    if let Some(found) = contradiction(&info) {
        decoded.warnings.push(format!("decoded from sRGB, but {found}: convert it to sRGB first"));
    }
    decoded.metadata = text(&info);
    Ok(decoded)
}

/// The codes of a PNG, and the content of its other chunks.
pub(super) fn read(source: &Source<'_>) -> Result<(Codes, Info<'static>), ImageError> {
    let info = read_info(source)?;
    let fault = |error: image::ImageError| source.malformed(FORMAT, error.to_string());
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(MAX_ANCILLARY_BYTES as u64);
    let decoder = PngDecoder::with_limits(Cursor::new(source.bytes), limits).map_err(fault)?;
    Ok((Codes::read(source, FORMAT, decoder)?, info))
}

/// Reads all chunks up to the end chunk and skips the pixels. Checks the size in the header before it allocates.
fn read_info(source: &Source<'_>) -> Result<Info<'static>, ImageError> {
    let fault = |error: png::DecodingError| source.malformed(FORMAT, error.to_string());
    let limits = png::Limits { bytes: MAX_ANCILLARY_BYTES };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(source.bytes), limits);
    // The decoder of the pixels checks the checksums.
    decoder.ignore_checksums(true);
    let (width, height) = decoder.read_header_info().map_err(fault)?.size();
    source.check_size(width.into(), height.into(), FORMAT)?;
    let mut reader = decoder.read_info().map_err(fault)?;
    reader.finish().map_err(fault)?;
    let info = reader.info().clone();
    if let Some(pixel) = info.pixel_dims.filter(|pixel| pixel.xppu > 0 && pixel.yppu > 0) {
        check_pixel_aspect(source, FORMAT, f64::from(pixel.yppu) / f64::from(pixel.xppu))?;
    }
    Ok(info)
}

/// The contradiction to sRGB in the file's colour chunks, in words. The chunk of highest precedence decides.
fn contradiction(info: &Info<'_>) -> Option<String> {
    if let Some(cicp) = info.coding_independent_code_points {
        let code_points = [cicp.color_primaries, cicp.transfer_function, cicp.matrix_coefficients];
        return (code_points != SRGB_CODE_POINTS).then(|| format!("its cICP chunk says {code_points:?}"));
    }
    if let Some(profile) = &info.icc_profile {
        return icc::contradiction(profile).map(str::to_owned);
    }
    if info.srgb.is_some() {
        return None;
    }
    if let Some(gamma) = info.gama_chunk.map(ScaledFloat::into_scaled)
        && gamma.abs_diff(SRGB_GAMMA) > 500
    {
        return Some(format!("its gAMA chunk says {gamma} / 100000, expected {SRGB_GAMMA} / 100000"));
    }
    let primaries = info.chrm_chunk.map(|c| [c.white, c.red, c.green, c.blue])?;
    let found = primaries.into_iter().flat_map(|(x, y)| [x.into_scaled(), y.into_scaled()]);
    let differs = found.zip(SRGB_PRIMARIES).any(|(found, expected)| found.abs_diff(expected) > 100);
    differs.then(|| "its cHRM chunk has other primaries".to_owned())
}

/// Uncompressed text as (key, value): Latin-1 chunks in the file's order, then UTF-8 chunks. Keys are those of
/// [`super::metadata`].
fn text(info: &Info<'_>) -> Vec<(String, String)> {
    let latin1 = info.uncompressed_latin1_text.iter().map(|chunk| (&chunk.keyword, Some(chunk.text.clone())));
    let utf8 =
        info.utf8_text.iter().filter(|chunk| !chunk.compressed).map(|chunk| (&chunk.keyword, chunk.get_text().ok()));
    latin1.chain(utf8).filter_map(|(keyword, text)| Some((keyword::from_png(keyword).to_owned(), text?))).collect()
}

const FORMAT: Format = Format::Png;

/// Primaries, transfer function and matrix of sRGB (ITU-T H.273).
const SRGB_CODE_POINTS: [u8; 3] = [1, 13, 0];

/// 1/2.2 in units of 1e-5, the `gAMA` value that approximates sRGB.
const SRGB_GAMMA: u32 = 45455;

/// White, red, green, blue of sRGB in units of 1e-5.
const SRGB_PRIMARIES: [u32; 8] = [31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000];

/// The limit of what the decoders may allocate for profiles and texts (which may be compressed) and rows.
const MAX_ANCILLARY_BYTES: usize = 64 << 20;
