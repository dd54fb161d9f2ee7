//! PNG (W3C, *Portable Network Graphics*, third edition): 8 or 16 bits (fewer are widened), grey, colour or palette, with
//! or without alpha (not premultiplied). The codes are taken as sRGB; what the file says otherwise (`cICP`, `iCCP`,
//! `sRGB`, `gAMA`, `cHRM`, in that order of weight) becomes a warning. Of an animation, the default image is read.

mod chunks;
mod write;

use std::io::Cursor;

use image::ImageDecoder;
use image::codecs::png::PngDecoder;

pub use write::write;

use super::decoded::{Decoded, Format};
use super::error::ImageError;
use super::icc;
use super::ldr::Codes;
use super::source::Source;

/// Decodes a PNG image.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let (codes, profile) = read(source)?;
    let mut decoded = codes.into_decoded(FORMAT, 0);
    if let Some(found) = contradiction(source.bytes, profile.as_deref()) {
        decoded.warnings.push(format!("decoded from sRGB, but {found}: convert it to sRGB first"));
    }
    decoded.metadata = chunks::text(source.bytes);
    Ok(decoded)
}

/// The codes of a PNG and its ICC profile.
pub(super) fn read(source: &Source<'_>) -> Result<(Codes, Option<Vec<u8>>), ImageError> {
    // The size first: the decoder allocates by it.
    let header = chunks::of(source.bytes).next().filter(|chunk| chunk.kind == *b"IHDR");
    let size = header.and_then(|chunk| chunk.data.first_chunk::<8>());
    let Some(&[w3, w2, w1, w0, h3, h2, h1, h0]) = size else {
        return Err(source.malformed(FORMAT, "its header is missing"));
    };
    let (width, height) = (u32::from_be_bytes([w3, w2, w1, w0]), u32::from_be_bytes([h3, h2, h1, h0]));
    source.check_size(width.into(), height.into(), FORMAT)?;
    if !chunks::of(source.bytes).any(|chunk| chunk.kind == *b"IEND") {
        return Err(source.malformed(FORMAT, "it ends before its end chunk"));
    }
    let fault = |error: image::ImageError| source.malformed(FORMAT, error.to_string());
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(MAX_ANCILLARY_BYTES);
    let mut decoder = PngDecoder::with_limits(Cursor::new(source.bytes), limits).map_err(fault)?;
    let profile = decoder.icc_profile().map_err(fault)?;
    Ok((Codes::read(source, FORMAT, decoder)?, profile))
}

/// What, if anything, in the file contradicts sRGB; the chunk of most weight decides.
fn contradiction(bytes: &[u8], profile: Option<&[u8]>) -> Option<String> {
    let find = |kind: &[u8; 4]| chunks::of(bytes).find(|chunk| chunk.kind == *kind).map(|chunk| chunk.data);
    if let Some(cicp) = find(b"cICP") {
        let is_srgb = matches!(cicp, [1, 13, 0, _]);
        return (!is_srgb).then(|| format!("its cICP chunk says {cicp:?}"));
    }
    if let Some(profile) = profile {
        return icc::contradiction(profile).map(str::to_owned);
    }
    if find(b"sRGB").is_some() {
        return None;
    }
    let numbers =
        |data: &[u8]| -> Vec<u32> { data.as_chunks::<4>().0.iter().map(|&bytes| u32::from_be_bytes(bytes)).collect() };
    let differs = |found: &[u32], expected: &[u32], tolerance: u32| {
        found.len() != expected.len() || found.iter().zip(expected).any(|(a, b)| a.abs_diff(*b) > tolerance)
    };
    if let Some(gamma) = find(b"gAMA").map(numbers).filter(|found| differs(found, &[SRGB_GAMMA], 500)) {
        return Some(format!("its gAMA chunk says {gamma:?} / 100000 instead of {SRGB_GAMMA}"));
    }
    let primaries = find(b"cHRM").map(numbers).filter(|found| differs(found, &SRGB_PRIMARIES, 100));
    primaries.map(|_| "its cHRM chunk has other primaries".to_owned())
}

const FORMAT: Format = Format::Png;

/// 1/2.2, which is how `gAMA` approximates sRGB.
const SRGB_GAMMA: u32 = 45455;

/// White, red, green, blue of sRGB in units of 1e-5.
const SRGB_PRIMARIES: [u32; 8] = [31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000];

/// What the decoder may allocate for profiles and texts (which may be compressed) and rows.
const MAX_ANCILLARY_BYTES: u64 = 64 << 20;
