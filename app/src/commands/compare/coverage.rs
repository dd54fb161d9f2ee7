//! Selects the pixels to compare and those of the object.

use crate::inputs::{LoadedMask, LoadedPhoto};
use anyhow::Context;
use lookalike::scene::SceneError;

/// The coverage of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coverage {
    /// Both images are multiplied by this before they are scored. The object is where it is above 0.
    pub(super) judged: Vec<f32>,
    /// The pixels of value 1 decide an automatic exposure.
    pub(super) exposed: Vec<f32>,
    /// How the object was determined.
    pub(super) object: Object,
}

/// How the object was determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Object {
    /// By a mask that was given.
    Mask,
    /// By an alpha channel.
    Alpha,
    /// Neither: the object is the whole image.
    Image,
}

impl Object {
    /// The word for it in JSON.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Mask => "mask",
            Self::Alpha => "alpha",
            Self::Image => "image",
        }
    }
}

impl Coverage {
    /// Uses the mask, if there is one. Otherwise uses the alpha channels (opaque in either image), but only if both images are
    /// black outside, so that the score of the whole image does not change; the coverage is not applied again, because colours
    /// with alpha are already multiplied by it. Otherwise uses the whole image.
    ///
    /// # Errors
    /// If the mask has another size than the images.
    pub(super) fn choose(
        mask: Option<&LoadedMask>,
        reference: &LoadedPhoto,
        image: &LoadedPhoto,
    ) -> anyhow::Result<Self> {
        let (width, height) = (reference.image.width(), reference.image.height());
        if let Some(LoadedMask { mask, source }) = mask {
            let (found_width, found_height) = (mask.width(), mask.height());
            if (found_width, found_height) != (width, height) {
                let error = SceneError::Size { what: "mask", width, height, found_width, found_height };
                return Err(error).with_context(|| format!("cannot use {} as the mask", source.path.display()));
            }
            let values = mask.coverage().to_vec();
            return Ok(Self { judged: values.clone(), exposed: values, object: Object::Mask });
        }
        Ok(Self::from_alpha(reference, image).unwrap_or_else(|| {
            let all = vec![1.0; width * height];
            Self { judged: all.clone(), exposed: all, object: Object::Image }
        }))
    }

    fn from_alpha(reference: &LoadedPhoto, image: &LoadedPhoto) -> Option<Self> {
        let at = |photo: &LoadedPhoto, i: usize| photo.alpha.as_ref().map_or(0.0, |alpha| alpha[i].clamp(0.0, 1.0));
        let exposed: Vec<f32> =
            (0..reference.image.pixels().len()).map(|i| at(reference, i).max(at(image, i))).collect();
        let says_something = exposed.iter().any(|&a| a > 0.0) && exposed.contains(&0.0);
        let is_black = |photo: &LoadedPhoto| {
            photo.image.pixels().iter().zip(&exposed).all(|(&pixel, &a)| a > 0.0 || pixel == [0.0; 3])
        };
        if !says_something || !is_black(reference) || !is_black(image) {
            return None;
        }
        let judged = exposed.iter().map(|&a| if a > 0.0 { 1.0 } else { 0.0 }).collect();
        Some(Self { judged, exposed, object: Object::Alpha })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inputs::InputFile;
    use lookalike::image::{Encoding, Image};

    fn photo(pixels: [f32; 4], alpha: Option<[f32; 4]>) -> LoadedPhoto {
        let image = Image::from_pixels(2, 2, pixels.map(|x| [x; 3]).to_vec());
        LoadedPhoto {
            source: InputFile::of_image("a.exr".as_ref(), &image),
            image,
            alpha: alpha.map(Vec::from),
            clipped: None,
            encoding: Encoding::Linear,
            metadata: Vec::new(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn alpha_marks_the_object_only_over_black() {
        let plain = photo([0.0, 1.0, 1.0, 1.0], None);
        let rendered = photo([0.0, 0.2, 0.5, 1.0], Some([0.0, 0.25, 0.5, 1.0]));
        let choose = |a: &LoadedPhoto, b: &LoadedPhoto| Coverage::choose(None, a, b).unwrap();
        let both = choose(&plain, &rendered);
        assert_eq!((both.object, both.judged), (Object::Alpha, vec![0.0, 1.0, 1.0, 1.0]));
        assert_eq!(both.exposed, [0.0, 0.25, 0.5, 1.0]);
        let behind = photo([0.1, 1.0, 1.0, 1.0], None);
        assert_eq!(choose(&behind, &rendered).object, Object::Image);
        assert_eq!(choose(&plain, &plain).judged, [1.0; 4]);
        let opaque = photo([0.0; 4], Some([1.0; 4]));
        assert_eq!(choose(&opaque, &plain).object, Object::Image);
    }
}
