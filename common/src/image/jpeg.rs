//! JPEG (ITU-T T.81), by the `image` crate, decoded as sRGB. Grey and three-channel files are read; four channels
//! (print colours) are refused. The decoder fills the missing part of a truncated file with grey, so the markers are
//! checked first. The decoder's inverse transform may differ by one code between processors, so the content hash of a
//! JPEG may differ too.

use std::io::Cursor;

use image::ImageDecoder;
use image::codecs::jpeg::JpegDecoder;

use super::decoded::{Decoded, Format};
use super::error::ImageError;
use super::icc;
use super::ldr::Codes;
use super::source::Source;

/// Decodes a JPEG photo.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let (codes, profile) = read(source)?;
    let mut decoded = codes.into_decoded(FORMAT, CLIP_MARGIN);
    if let Some(found) = profile.as_deref().and_then(icc::contradiction) {
        decoded.warnings.push(format!("decoded from sRGB, but {found}: convert it to sRGB first"));
    }
    Ok(decoded)
}

/// The codes of a JPEG and its ICC profile.
pub(super) fn read(source: &Source<'_>) -> Result<(Codes, Option<Vec<u8>>), ImageError> {
    check_markers(source)?;
    let fault = |error: image::ImageError| source.malformed(FORMAT, error.to_string());
    let mut decoder = JpegDecoder::new(Cursor::new(source.bytes)).map_err(fault)?;
    let profile = decoder.icc_profile().map_err(fault)?;
    Ok((Codes::read(source, FORMAT, decoder)?, profile))
}

/// Walks the markers up to the end of the image. Checks the size and channels of the frame, and that the end exists.
fn check_markers(source: &Source<'_>) -> Result<(), ImageError> {
    let cut = || source.malformed(FORMAT, "it ends before the end-of-image marker");
    let mut rest = source.bytes.get(2..).ok_or_else(cut)?;
    loop {
        // Skips fill bytes between segments, and the data of a scan, with its escaped 0xff and restart markers.
        let start = rest.windows(2).position(|w| w[0] == 0xff && !matches!(w[1], 0 | 0xff | RST0..=RST7));
        let at = start.ok_or_else(cut)?;
        let marker = rest[at + 1];
        rest = &rest[at + 2..];
        if marker == EOI {
            return Ok(());
        }
        if marker == SOI || marker == TEM {
            continue;
        }
        let length = rest.first_chunk().map(|&bytes| usize::from(u16::from_be_bytes(bytes))).ok_or_else(cut)?;
        let segment = rest.get(2..length).ok_or_else(cut)?;
        if is_frame(marker) {
            check_frame(source, segment)?;
        }
        rest = &rest[length..];
    }
}

/// Whether a marker starts a frame. The Huffman, arithmetic and extension markers in the same range do not.
fn is_frame(marker: u8) -> bool {
    matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc)
}

fn check_frame(source: &Source<'_>, segment: &[u8]) -> Result<(), ImageError> {
    let &[bits, h1, h0, w1, w0, channels, ..] = segment else {
        return Err(source.malformed(FORMAT, "its frame header is too short"));
    };
    source.check_size(u16::from_be_bytes([w1, w0]).into(), u16::from_be_bytes([h1, h0]).into(), FORMAT)?;
    if bits != 8 {
        return Err(source.unsupported(FORMAT, format!("{bits}-bit samples"), "convert it to PNG with 16 bits"));
    }
    if !matches!(channels, 1 | 3) {
        return Err(source.unsupported(
            FORMAT,
            format!("{channels} colour channels (print colours)"),
            "convert it to RGB, or export the photo again as sRGB",
        ));
    }
    Ok(())
}

const FORMAT: Format = Format::Jpeg;

/// At the usual qualities the quantised transform decodes a clipped value to at most this far below 255.
const CLIP_MARGIN: u16 = 2;

const SOI: u8 = 0xd8;
const EOI: u8 = 0xd9;
const TEM: u8 = 0x01;
const RST0: u8 = 0xd0;
const RST7: u8 = 0xd7;
