//! Pictures of the difference between a match and its photo, for the figure that compares samples with all pixels.

use anyhow::Context;
use lookalike::{
    image::{Image, decode, png, srgb},
    math::to_f32,
};
use std::{collections::BTreeSet, fs, path::Path};

/// Factor on the shown differences of displayed values.
pub(super) const GAIN: f64 = 4.0;
/// The matches for which these pictures are made.
const SHOWN: [&str; 2] = ["ours", "full"];

/// Writes `X-difference-ours.png` and `X-difference-full.png` for every `X` that has its photo and both matches, and adds
/// their names.
///
/// # Errors
/// If a picture cannot be read, has another size than its photo, or cannot be written.
pub(super) fn write(
    folder: &Path,
    names: &mut BTreeSet<String>,
    mut write: impl FnMut(&str, &[u8]) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let scenes: Vec<String> =
        names.iter().filter_map(|name| name.strip_suffix("-full.png")).map(str::to_owned).collect();
    for scene in scenes {
        let file = |what: &str| format!("{scene}-{what}.png");
        if ["photo", SHOWN[0], SHOWN[1]].iter().any(|what| !names.contains(&file(what))) {
            continue;
        }
        let photo = read(folder, &file("photo"))?;
        for what in SHOWN {
            let name = file(&format!("difference-{what}"));
            let image = difference(&photo, &read(folder, &file(what))?)
                .with_context(|| format!("the pictures {} and {} differ in size", file("photo"), file(what)))?;
            write(&format!("pictures/{name}"), &png::write(&image, &[])?)?;
            names.insert(name);
        }
    }
    Ok(())
}

fn read(folder: &Path, name: &str) -> anyhow::Result<Image> {
    let path = folder.join(name);
    let shown = path.display().to_string();
    let bytes = fs::read(&path).with_context(|| format!("cannot read the picture {shown}"))?;
    Ok(decode(&shown, &bytes)?.image)
}

/// [`GAIN`] times the absolute difference of displayed values; `None` if the pictures differ in size.
fn difference(photo: &Image, image: &Image) -> Option<Image> {
    let size = (photo.width(), photo.height());
    if (image.width(), image.height()) != size {
        return None;
    }
    let shown = |linear: f32| srgb::from_linear(linear.into());
    let channel = |a: f32, b: f32| to_f32(srgb::to_linear((GAIN * (shown(a) - shown(b)).abs()).min(1.0)));
    let pixels = photo.pixels().iter().zip(image.pixels());
    let pixels = pixels.map(|(a, b)| std::array::from_fn(|c| channel(a[c], b[c]))).collect();
    Some(Image::from_pixels(size.0, size.1, pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_black_where_pictures_agree_and_bright_where_not() {
        let picture =
            |values: [f32; 2]| Image::from_pixels(2, 1, values.map(|v| [to_f32(srgb::to_linear(v.into())); 3]).into());
        let image = difference(&picture([0.5, 0.5]), &picture([0.5, 0.4])).unwrap();
        assert_eq!(image.pixel(0, 0), [0.0; 3]);
        assert!((srgb::from_linear(image.pixel(1, 0)[1].into()) - 0.4).abs() < 1e-3);
        assert!(difference(&image, &Image::new(1, 1)).is_none());
    }
}
