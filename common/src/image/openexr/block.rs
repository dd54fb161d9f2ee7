//! Decompression of one untrusted block. Fuzzing `exr` 1.74.2 found two ways in which a broken block ends the process,
//! and this file prevents both. First, the counters of a DWA block are allocated before they are checked. Second,
//! arithmetic on numbers from the file overflows (`b44`: attempt to subtract with overflow), which panics in builds
//! with overflow checks.

use std::panic::{AssertUnwindSafe, catch_unwind};

use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::error::{Error, Result};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};

/// Decompresses a block.
pub(super) fn decompress(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock> {
    let header = meta.headers.get(chunk.layer_index).ok_or_else(broken)?;
    if matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        check_dwa_counters(&chunk, header)?;
    }
    // The closure owns everything that it changes, so a panic leaves no inconsistent state behind.
    let attempt = AssertUnwindSafe(|| UncompressedBlock::decompress_chunk(chunk, meta, false));
    catch_unwind(attempt).unwrap_or_else(|_| Err(broken()))
}

/// The size in bytes of the largest block after decompression.
pub(super) fn largest(header: &Header) -> usize {
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let (block_width, block_height) = match header.blocks {
        BlockDescription::ScanLines => (width, header.compression.scan_lines_per_block()),
        BlockDescription::Tiles(tiles) => (tiles.tile_size.width(), tiles.tile_size.height()),
    };
    let pixels = block_width.min(width).saturating_mul(block_height.min(height));
    pixels.saturating_mul(header.channels.bytes_per_pixel)
}

/// Checks the eleven 64-bit counters at the start of a DWA block (`DataSizesSingle` of the reference implementation).
/// The counters of uncompressed sizes become allocations. The bound is twice the size of the block, with its sides
/// rounded up to multiples of 8 and four bytes per sample.
fn check_dwa_counters(chunk: &Chunk, header: &Header) -> Result<()> {
    let bytes = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Err(broken()),
    };
    let location = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(location)?.size;
    if bytes.len() == size.area() * header.channels.bytes_per_pixel {
        // Stored uncompressed, because compression would not have made it smaller.
        return Ok(());
    }
    let padded = size.width().next_multiple_of(8) * size.height().next_multiple_of(8);
    let bound = padded.saturating_mul(header.channels.list.len()).saturating_mul(8) as u64;
    let counters = bytes.as_chunks::<8>().0;
    let exceeds = |index: usize| counters.get(index).is_none_or(|&counter| u64::from_le_bytes(counter) > bound);
    if UNCOMPRESSED_SIZES.into_iter().any(exceeds) { Err(broken()) } else { Ok(()) }
}

fn broken() -> Error {
    Error::Invalid("compressed pixels".into())
}

/// Indices of the counters of uncompressed sizes: unknown data, run-length tokens, run-length data, AC and DC
/// coefficients.
const UNCOMPRESSED_SIZES: [usize; 5] = [1, 6, 7, 8, 9];
