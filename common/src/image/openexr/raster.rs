//! Decompression of the chosen channels' blocks, and their placement in the display window.

use std::collections::BTreeSet;
use std::io::Cursor;

use exr::block::chunk::Chunk;
use exr::block::reader::Reader;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::prelude::f16;
use rayon::prelude::*;

use super::channels::{Layer, Part};
use super::header::FORMAT;
use super::{block, header};
use crate::image::error::ImageError;
use crate::image::source::{Source, check_pixel_aspect};

/// The channels of one layer over the display window.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// One plane per colour channel, then one for alpha: row-major, top left first, 0 outside the data window.
    pub(super) planes: Vec<Vec<f32>>,
    /// x, y of red, green, blue, white.
    pub(super) chromaticities: Option<[f64; 8]>,
    /// Attributes that are text or a number, by name.
    pub(super) metadata: Vec<(String, String)>,
    pub(super) warnings: Vec<String>,
}

impl Raster {
    /// Reads the channels that `select` chooses from the channel names of all parts.
    pub(super) fn read(
        source: &Source<'_>,
        select: impl Fn(&[Part]) -> Result<Layer, String>,
    ) -> Result<(Layer, Self), ImageError> {
        header::check(source)?;
        let fault = |error: exr::error::Error| match error {
            exr::error::Error::NotSupported(feature) => {
                source.unsupported(FORMAT, feature, "convert it to scan lines with zip compression")
            }
            other => source.malformed(FORMAT, other.to_string()),
        };
        let reader = exr::block::read(Cursor::new(source.bytes), false).map_err(fault)?;
        let parts: Vec<Part> = reader.headers().iter().map(part).collect();
        let layer = select(&parts).map_err(|expected| ImageError::Channels {
            name: source.name.to_owned(),
            expected,
            found: parts.iter().flat_map(|part| part.channels.clone()).collect::<Vec<_>>().join(", "),
        })?;
        let aspect = f64::from(reader.headers()[layer.part].shared_attributes.pixel_aspect);
        check_pixel_aspect(source, FORMAT, aspect)?;
        let mut raster = Self::prepare(source, &reader.headers()[layer.part], &layer)?;
        raster.fill(reader, &layer).map_err(|fill| match fill {
            Fill::Exr(error) => fault(error),
            Fill::Missing => source.malformed(FORMAT, "blocks are missing or stored twice"),
        })?;
        Ok((layer, raster))
    }

    /// An empty raster of the size of the display window.
    fn prepare(source: &Source<'_>, header: &Header, layer: &Layer) -> Result<Self, ImageError> {
        let (display, data) = (header.shared_attributes.display_window, header.data_window());
        let (width, height) = (display.size.width(), display.size.height());
        if block::largest(header) > MAX_BLOCK_BYTES {
            return Err(source.unsupported(
                FORMAT,
                "a tile above 2 GB",
                "write it with smaller tiles or fewer channels",
            ));
        }
        let mut warnings = Vec::new();
        let (ours, theirs) = (Window::of(display), Window::of(data));
        if !ours.overlaps(theirs) {
            return Err(source.malformed(FORMAT, "its data window lies outside its display window"));
        }
        if !theirs.contains(ours) {
            warnings.push("the data window does not cover the display window: the rest is black".to_owned());
        }
        if !ours.contains(theirs) {
            warnings.push("the data window exceeds the display window: pixels outside it are dropped".to_owned());
        }
        let chromaticities = header
            .shared_attributes
            .chromaticities
            .map(|c| [c.red, c.green, c.blue, c.white].map(|p| [f64::from(p.x()), f64::from(p.y())]));
        let plane_count = layer.colours.len() + usize::from(layer.alpha.is_some());
        Ok(Self {
            width,
            height,
            planes: vec![vec![0.0; width * height]; plane_count],
            chromaticities: chromaticities.and_then(|c| c.concat().try_into().ok()),
            metadata: metadata(header),
            warnings,
        })
    }

    /// Reads the blocks of the largest level of the layer's part.
    fn fill(&mut self, reader: Reader<Cursor<&[u8]>>, layer: &Layer) -> Result<(), Fill> {
        let meta: MetaData =
            MetaData { requirements: reader.meta_data().requirements, headers: reader.headers().into() };
        let mut wanted = BTreeSet::new();
        let mut chunks = reader.filter_chunks(false, |_, tile, block| {
            let ours = block.layer == layer.part && tile.is_largest_resolution_level();
            ours && wanted.insert(position(&block))
        })?;
        let batch_size = (BATCH_BYTES / block::largest(&meta.headers[layer.part]).max(1)).clamp(1, MAX_BATCH);
        let placement = Placement::new(&meta.headers[layer.part], layer, self.width);
        loop {
            let batch: Vec<Chunk> = chunks.by_ref().take(batch_size).collect::<Result<_, _>>()?;
            if batch.is_empty() {
                return if wanted.is_empty() { Ok(()) } else { Err(Fill::Missing) };
            }
            let blocks: Vec<exr::error::Result<UncompressedBlock>> =
                batch.into_par_iter().map(|chunk| block::decompress(chunk, &meta)).collect();
            for block in blocks {
                let block = block?;
                if block.index.layer != layer.part || !wanted.remove(&position(&block.index)) {
                    return Err(Fill::Missing);
                }
                placement.place(&block, &mut self.planes);
            }
        }
    }
}

/// Why a raster could not be filled.
#[derive(Debug)]
enum Fill {
    Exr(exr::error::Error),
    Missing,
}

impl From<exr::error::Error> for Fill {
    fn from(error: exr::error::Error) -> Self {
        Self::Exr(error)
    }
}

/// The position of a block, which identifies it within a part.
fn position(block: &BlockIndex) -> (usize, usize, usize, usize) {
    (block.level.x(), block.level.y(), block.pixel_position.y(), block.pixel_position.x())
}

/// The places of samples in a block and in the planes.
#[derive(Debug)]
struct Placement {
    /// For each plane: the bytes per pixel of the channels before its channel, and its type.
    sources: Vec<(usize, SampleType)>,
    bytes_per_pixel: usize,
    /// Data window relative to the display window.
    offset: (i64, i64),
    width: usize,
}

impl Placement {
    fn new(header: &Header, layer: &Layer, width: usize) -> Self {
        let channels = &header.channels.list;
        let before = |index: usize| channels[..index].iter().map(|c| c.sample_type.bytes_per_sample()).sum();
        let sources = layer.colours.iter().copied().chain(layer.alpha);
        let display = header.shared_attributes.display_window.position;
        let data = header.own_attributes.layer_position;
        let offset = |data: i32, display: i32| i64::from(data) - i64::from(display);
        Self {
            sources: sources.map(|index| (before(index), channels[index].sample_type)).collect(),
            bytes_per_pixel: header.channels.bytes_per_pixel,
            offset: (offset(data.x(), display.x()), offset(data.y(), display.y())),
            width,
        }
    }

    /// Copies a block to the planes. Each line of a block has all samples of the first channel, then of the next.
    fn place(&self, block: &UncompressedBlock, planes: &mut [Vec<f32>]) {
        let line_width = block.index.pixel_size.width();
        let line_bytes = line_width * self.bytes_per_pixel;
        for (line, bytes) in block.data.chunks_exact(line_bytes).enumerate() {
            let Some(row) = shifted(block.index.pixel_position.y() + line, self.offset.1) else { continue };
            for (plane, &(before, kind)) in planes.iter_mut().zip(&self.sources) {
                let Some(target) = plane.get_mut(row * self.width..).and_then(|rest| rest.get_mut(..self.width)) else {
                    continue;
                };
                let size = kind.bytes_per_sample();
                let samples = bytes[before * line_width..][..size * line_width].chunks_exact(size);
                for (x, sample) in samples.enumerate() {
                    let column = shifted(block.index.pixel_position.x() + x, self.offset.0);
                    if let Some(pixel) = column.and_then(|column| target.get_mut(column)) {
                        *pixel = value(sample, kind);
                    }
                }
            }
        }
    }
}

/// Converts a coordinate from the data window to the display window; `None` if it is above or left of it.
fn shifted(at: usize, offset: i64) -> Option<usize> {
    usize::try_from(i64::try_from(at).ok()? + offset).ok()
}

/// The value of a sample in the machine's byte order, of as many bytes as its type has.
#[allow(clippy::cast_precision_loss, reason = "integers above 2^24 round, as the module says")]
fn value(sample: &[u8], kind: SampleType) -> f32 {
    let mut bytes = [0; 4];
    bytes[..sample.len()].copy_from_slice(sample);
    match kind {
        SampleType::F16 => f16::from_ne_bytes([bytes[0], bytes[1]]).to_f32(),
        SampleType::F32 => f32::from_ne_bytes(bytes),
        SampleType::U32 => u32::from_ne_bytes(bytes) as f32,
    }
}

fn part(header: &Header) -> Part {
    Part {
        name: header.own_attributes.layer_name.as_ref().map(ToString::to_string),
        channels: header.channels.list.iter().map(|channel| channel.name.to_string()).collect(),
    }
}

/// Text and number attributes, sorted by name, because the crate stores them in hash maps.
fn metadata(header: &Header) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = header
        .all_named_attributes()
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(text) => decode_text(text.bytes()),
                AttributeValue::F32(number) => number.to_string(),
                AttributeValue::F64(number) => number.to_string(),
                AttributeValue::I32(number) => number.to_string(),
                _ => return None,
            };
            Some((decode_text(name), value))
        })
        .filter(|(name, _): &(String, String)| !LAYOUT.contains(&name.as_str()))
        .collect();
    found.sort();
    found
}

/// Text is usually UTF-8 today; the crate decodes it as Latin-1, which is the fallback here.
fn decode_text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap_or_else(|_| bytes.iter().copied().map(char::from).collect())
}

/// Edges of a window, the last ones exclusive.
#[derive(Debug, Clone, Copy)]
struct Window {
    left: i64,
    top: i64,
    right: i64,
    bottom: i64,
}

impl Window {
    fn of(bounds: IntegerBounds) -> Self {
        let end = bounds.end();
        Self {
            left: bounds.position.x().into(),
            top: bounds.position.y().into(),
            right: end.x().into(),
            bottom: end.y().into(),
        }
    }

    fn contains(self, other: Self) -> bool {
        self.left <= other.left && self.top <= other.top && self.right >= other.right && self.bottom >= other.bottom
    }

    fn overlaps(self, other: Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }
}

/// Attributes that describe the file's layout, not its content.
const LAYOUT: [&str; 5] = ["type", "chunkCount", "version", "screenWindowWidth", "maxSamplesPerPixel"];

/// Limits of the blocks that are decompressed at a time, by number and by bytes: enough for all cores, with little
/// memory.
const MAX_BATCH: usize = 64;
const BATCH_BYTES: usize = 1 << 28;

/// The largest accepted block after decompression: a tile of 16384 x 16384 pixels of four half floats.
const MAX_BLOCK_BYTES: usize = 1 << 31;
