//! Radiance pictures (RGBE): Ward, *Real Pixels*, Graphics Gems II (1991), and Radiance's *File Formats*, section
//! "Picture File Format (.hdr)".
//!
//! - A component is `mantissa * 2^(exponent - 136)`; exponent 0 is black. Radiance's own tools add half a mantissa
//!   step, because they truncate when writing. Nearly all other readers (Debevec's, HDR Shop, OpenCV, `image`) do not,
//!   and the published maxima of the usual probes are without it. This reader does not add it either; the difference is
//!   at most 0.4 % of the brightest component.
//! - `EXPOSURE` and `COLORCORR` are factors by which the pixels were multiplied. Several are multiplied together. This
//!   reader divides by them.
//! - Pixels in CIE XYZ (`FORMAT=32-bit_rle_xyze`) are converted; white is (1, 1, 1), of equal energy.
//! - `PRIMARIES` other than Rec. 709 are converted. All zero (Photoshop) means unknown. Unknown and missing primaries
//!   are taken as Rec. 709 (Radiance's documented default is close to Rec. 709, except for an equal-energy white).
//! - All eight orientations of the resolution line are converted to upright.

use super::Image;
use super::decoded::{Decoded, Encoding, Format};
use super::error::ImageError;
use super::primaries::{EQUAL_ENERGY, Primaries, convert, xyz_to_rec709};
use super::source::{Source, check_pixel_aspect};
use crate::math::{Mat3, to_f32};

/// Decodes a Radiance picture.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let mut reader = Reader { source, rest: source.bytes };
    let mut header = Header::read(&mut reader)?;
    let layout = Layout::read(&mut reader)?;
    let mut pixels = vec![[0.0f32; 3]; layout.width * layout.height];
    let scales: Vec<f64> = (0..=255u64).map(power_of_two).collect();
    let divisor = header.divisor;
    let mut line = Vec::with_capacity(layout.line_length);
    for index in 0..layout.line_count {
        reader.read_line(&mut line, &layout, index)?;
        for (position, &[r, g, b, e]) in line.iter().enumerate() {
            let scale = scales[usize::from(e)];
            let value = |mantissa: u8, channel: usize| to_f32(f64::from(mantissa) * scale / divisor[channel]);
            pixels[layout.target(index, position)] = [value(r, 0), value(g, 1), value(b, 2)];
        }
    }
    if let Some(matrix) = header.conversion() {
        convert(&mut pixels, matrix);
    }
    Ok(Decoded {
        image: Image::from_pixels(layout.width, layout.height, pixels),
        alpha: None,
        clipped: None,
        encoding: Encoding::Linear,
        format: FORMAT,
        metadata: header.metadata,
        warnings: header.warnings,
    })
}

/// The header's information on the values.
#[derive(Debug)]
struct Header {
    divisor: [f64; 3],
    to_rec709: Option<Mat3>,
    /// The line of the primaries.
    primaries: String,
    is_xyz: bool,
    metadata: Vec<(String, String)>,
    warnings: Vec<String>,
}

impl Header {
    fn read(reader: &mut Reader<'_>) -> Result<Self, ImageError> {
        let mut header = Self {
            divisor: [1.0; 3],
            to_rec709: None,
            primaries: String::new(),
            is_xyz: false,
            metadata: Vec::new(),
            warnings: Vec::new(),
        };
        reader.text_line()?;
        loop {
            let line = reader.text_line()?;
            if line.is_empty() {
                return Ok(header);
            }
            // Skips comments and the commands that made the picture: they start with `#` or white space, or have no `=`.
            if let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with(['#', ' ', '\t'])) {
                header.apply(key.trim(), value.trim(), reader.source)?;
            }
        }
    }

    fn apply(&mut self, key: &str, value: &str, source: &Source<'_>) -> Result<(), ImageError> {
        match key {
            "FORMAT" if value == "32-bit_rle_rgbe" => return Ok(()),
            "FORMAT" if value == "32-bit_rle_xyze" => {
                self.is_xyz = true;
                return Ok(());
            }
            "FORMAT" => {
                return Err(source.unsupported(
                    FORMAT,
                    format!("pixel format {value}"),
                    "convert it to 32-bit_rle_rgbe, or to OpenEXR",
                ));
            }
            // FreeImage and GIMP write it for "unknown".
            "EXPOSURE" if number(value) == Some(0.0) => {
                self.warnings.push(format!("{key}={value} in the header is not a factor and is ignored"));
                return Ok(());
            }
            // Height over width.
            "PIXASPECT" => check_pixel_aspect(source, FORMAT, 1.0 / number(value).unwrap_or(1.0))?,
            "EXPOSURE" => {
                let [exposure] = factors(key, value, source)?;
                self.divisor = self.divisor.map(|d| d * exposure);
            }
            "COLORCORR" => {
                let correction: [f64; 3] = factors(key, value, source)?;
                self.divisor = [0, 1, 2].map(|channel| self.divisor[channel] * correction[channel]);
            }
            "PRIMARIES" => self.set_primaries(value, source)?,
            "GAMMA" if number(value) != Some(1.0) => {
                self.warnings.push(format!("GAMMA={value} in the header is ignored: RGBE pixels are linear"));
            }
            _ => {}
        }
        if !self.divisor.iter().all(|&d| d.is_normal()) {
            return Err(source.malformed(FORMAT, format!("{key}={value} makes the exposure too large or too small")));
        }
        self.metadata.push((key.to_owned(), value.to_owned()));
        Ok(())
    }

    fn set_primaries(&mut self, value: &str, source: &Source<'_>) -> Result<(), ImageError> {
        let numbers: Option<[f64; 8]> = numbers(value);
        let Some(numbers) = numbers else {
            return Err(source.malformed(FORMAT, format!("expected eight numbers in PRIMARIES, found `{value}`")));
        };
        if numbers == [0.0; 8] {
            return Ok(());
        }
        self.to_rec709 = Primaries::from_array(numbers)
            .to_rec709()
            .map_err(|_| source.malformed(FORMAT, format!("PRIMARIES={value} are not colour primaries")))?;
        self.primaries = value.to_owned();
        Ok(())
    }

    /// The conversion of the colours, which the whole header decides. The primaries of XYZ pixels are those of the display for which they were made.
    fn conversion(&mut self) -> Option<Mat3> {
        if self.is_xyz {
            self.warnings.push("colours converted from CIE XYZ (white: equal energy) to Rec. 709".to_owned());
            return Some(xyz_to_rec709(EQUAL_ENERGY));
        }
        if self.to_rec709.is_some() {
            self.warnings.push(format!("colours converted from the file's primaries ({}) to Rec. 709", self.primaries));
        }
        self.to_rec709
    }
}

/// Size and orientation of the stored scan lines.
#[derive(Debug)]
struct Layout {
    width: usize,
    height: usize,
    line_count: usize,
    line_length: usize,
    /// Whether scan lines are columns of the image.
    is_transposed: bool,
    /// Whether rows are stored from right to left.
    flip_x: bool,
    /// Whether columns are stored from bottom to top.
    flip_y: bool,
}

impl Layout {
    /// Parses a line such as `-Y 1024 +X 768`. The first axis is that of scan lines, the second that of the pixels in
    /// each; `-Y` is top to bottom.
    fn read(reader: &mut Reader<'_>) -> Result<Self, ImageError> {
        let line = reader.text_line()?;
        let fault = || {
            let detail = format!("expected a resolution such as `-Y 512 +X 1024`, found `{}`", line.escape_debug());
            reader.source.malformed(FORMAT, detail)
        };
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let &[first, lines, second, length] = words.as_slice() else { return Err(fault()) };
        let count = |word: &str| word.parse::<u64>().map_err(|_| fault());
        let (lines, length) = (count(lines)?, count(length)?);
        let (is_transposed, y, x) = match (first, second) {
            ("+Y" | "-Y", "+X" | "-X") => (false, first, second),
            ("+X" | "-X", "+Y" | "-Y") => (true, second, first),
            _ => return Err(fault()),
        };
        let (width, height) = if is_transposed { (lines, length) } else { (length, lines) };
        let (width, height) = reader.source.check_size(width, height, FORMAT)?;
        let (line_count, line_length) = if is_transposed { (width, height) } else { (height, width) };
        Ok(Self { width, height, line_count, line_length, is_transposed, flip_x: x == "-X", flip_y: y == "+Y" })
    }

    /// The index in the image of the pixel at `position` of scan line `line`.
    fn target(&self, line: usize, position: usize) -> usize {
        let (x, y) = if self.is_transposed { (line, position) } else { (position, line) };
        let column = if self.flip_x { self.width - 1 - x } else { x };
        let row = if self.flip_y { self.height - 1 - y } else { y };
        row * self.width + column
    }
}

/// The bytes that are not yet read.
#[derive(Debug)]
struct Reader<'a> {
    source: &'a Source<'a>,
    rest: &'a [u8],
}

impl Reader<'_> {
    /// The next header line, without its end.
    fn text_line(&mut self) -> Result<String, ImageError> {
        let Some(end) = self.rest.iter().take(MAX_HEADER_LINE).position(|&byte| byte == b'\n') else {
            return Err(self.source.malformed(FORMAT, "the header has no end"));
        };
        let line = String::from_utf8_lossy(&self.rest[..end]).trim_end_matches('\r').to_owned();
        self.rest = &self.rest[end + 1..];
        Ok(line)
    }

    fn take<const N: usize>(&mut self, layout: &Layout, index: usize) -> Result<[u8; N], ImageError> {
        let Some((head, tail)) = self.rest.split_first_chunk::<N>() else {
            let detail = format!("expected {} scan lines, but it ends in scan line {index}", layout.line_count);
            return Err(self.source.malformed(FORMAT, detail));
        };
        self.rest = tail;
        Ok(*head)
    }

    /// Reads one scan line of `[red, green, blue, exponent]`, in one of the two run-length encodings or without.
    fn read_line(&mut self, line: &mut Vec<[u8; 4]>, layout: &Layout, index: usize) -> Result<(), ImageError> {
        line.clear();
        let first = self.take::<4>(layout, index)?;
        let new_style = (8..0x8000).contains(&layout.line_length) && first[0] == 2 && first[1] == 2 && first[2] < 128;
        if !new_style {
            return self.read_old_line(first, line, layout, index);
        }
        let stored = usize::from(first[2]) << 8 | usize::from(first[3]);
        if stored != layout.line_length {
            let detail = format!("expected {} pixels in scan line {index}, found {stored}", layout.line_length);
            return Err(self.source.malformed(FORMAT, detail));
        }
        line.resize(layout.line_length, [0; 4]);
        (0..4).try_for_each(|channel| self.read_runs(channel, line, layout, index))
    }

    /// Reads one component of a scan line. A count above 128 repeats one byte count - 128 times; a smaller count copies
    /// as many bytes.
    fn read_runs(
        &mut self,
        channel: usize,
        line: &mut [[u8; 4]],
        layout: &Layout,
        index: usize,
    ) -> Result<(), ImageError> {
        let mut at = 0;
        while at < line.len() {
            let [count] = self.take::<1>(layout, index)?;
            let (length, repeated) = match count {
                129.. => (usize::from(count - 128), Some(self.take::<1>(layout, index)?[0])),
                _ => (usize::from(count), None),
            };
            if length == 0 || at + length > line.len() {
                return Err(self.bad_run(index));
            }
            for pixel in &mut line[at..at + length] {
                pixel[channel] = match repeated {
                    Some(byte) => byte,
                    None => self.take::<1>(layout, index)?[0],
                };
            }
            at += length;
        }
        Ok(())
    }

    /// Reads plain pixels. `[1, 1, 1, n]` repeats the previous pixel n times; directly after another one, 256 n times,
    /// and so on.
    fn read_old_line(
        &mut self,
        first: [u8; 4],
        line: &mut Vec<[u8; 4]>,
        layout: &Layout,
        index: usize,
    ) -> Result<(), ImageError> {
        let mut pixel = first;
        let mut shift = 0u32;
        loop {
            if let [1, 1, 1, count] = pixel {
                let length = if shift > 24 { usize::MAX } else { usize::from(count) << shift };
                let previous = line.last().copied();
                match previous {
                    Some(previous) if length <= layout.line_length - line.len() => {
                        line.resize(line.len() + length, previous);
                    }
                    _ => return Err(self.bad_run(index)),
                }
                shift += 8;
            } else {
                line.push(pixel);
                shift = 0;
            }
            if line.len() == layout.line_length {
                return Ok(());
            }
            pixel = self.take::<4>(layout, index)?;
        }
    }

    fn bad_run(&self, index: usize) -> ImageError {
        self.source.malformed(FORMAT, format!("a run does not fit into scan line {index}"))
    }
}

/// The value of one mantissa step, exact; 0 for exponent 0.
fn power_of_two(exponent: u64) -> f64 {
    if exponent == 0 { 0.0 } else { f64::from_bits((exponent + 1023 - 136) << 52) }
}

/// `N` positive finite numbers.
fn factors<const N: usize>(key: &str, value: &str, source: &Source<'_>) -> Result<[f64; N], ImageError> {
    numbers(value).filter(|v: &[f64; N]| v.iter().all(|&x| x > 0.0 && x.is_finite())).ok_or_else(|| {
        let expected = if N == 1 { "a positive number".to_owned() } else { format!("{N} positive numbers") };
        source.malformed(FORMAT, format!("expected {expected} in {key}, found `{}`", value.escape_debug()))
    })
}

fn numbers<const N: usize>(value: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = value.split_ascii_whitespace().map(number).collect();
    numbers?.try_into().ok()
}

fn number(word: &str) -> Option<f64> {
    word.parse().ok()
}

const FORMAT: Format = Format::RadianceHdr;

/// A limit above the length of any command that made a picture.
const MAX_HEADER_LINE: usize = 1 << 16;
