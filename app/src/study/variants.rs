//! Scores the matches of the main methods by variants of the metric, to test whether the study's conclusions depend on CSSIM's
//! settings.

use lookalike::{
    image::Image,
    math::to_f32,
    metric::{
        CidOptions, DisplayImage, IcidOptions, Judge, JudgeOptions, MetricError, Scales, SpatialFilter, cid, icid,
    },
};

/// The smallest width and height for variants: half and a quarter of the photo must still hold the metric's windows.
pub(super) const SMALLEST: u32 = 44;

/// Scores of an image against a photo over black, by name of the variant.
pub(super) fn scores(photo: &Image, image: &Image, exposure: f64) -> Result<Vec<(&'static str, f64)>, MetricError> {
    let coverage: Vec<f32> = vec![1.0; photo.width() * photo.height()];
    let displayed = |image: &Image, exposure| {
        DisplayImage::from_linear(image, &vec![1.0; image.width() * image.height()], exposure)
    };
    let (reference, shown) = (displayed(photo, exposure)?, displayed(image, exposure)?);
    let with = |options: CidOptions| cid(&reference, &shown, &options);
    let judged = |exposure| {
        let judge = Judge::new(photo, &coverage, exposure, &JudgeOptions::default())?;
        judge.score(image)
    };
    let (small_photo, small_image) = (halved(photo), halved(image));
    let mut scores = vec![
        ("half exposure", judged(0.5 * exposure)?.cssim),
        ("double exposure", judged(2.0 * exposure)?.cssim),
        ("iCAM filter", with(CidOptions { filter: SpatialFilter::Icam, ..CidOptions::default() })?),
        ("40 cycles/degree", with(CidOptions { cycles_per_degree: 40.0, ..CidOptions::default() })?),
        ("10 cycles/degree", with(CidOptions { cycles_per_degree: 10.0, ..CidOptions::default() })?),
        (
            "half size",
            cid(&displayed(&small_photo, exposure)?, &displayed(&small_image, exposure)?, &CidOptions::default())?,
        ),
        ("iCID", icid(&reference, &shown, &coverage, &IcidOptions::default())?.icid),
    ];
    scores.push(("three scales", with(CidOptions { scales: Scales::Three, ..CidOptions::default() })?));
    // The coarsest of five scales has a sixteenth of the columns and rows.
    if photo.width().min(photo.height()) >= 176 {
        scores.push(("five scales", with(CidOptions { scales: Scales::Five, ..CidOptions::default() })?));
    }
    Ok(scores)
}

/// Halves columns and rows; a pixel is the mean of four.
fn halved(image: &Image) -> Image {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mean = |i: usize| {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| image.pixel(x, y));
        std::array::from_fn(|c| to_f32(four.iter().map(|rgb| f64::from(rgb[c])).sum::<f64>() / 4.0))
    };
    Image::from_pixels(width, height, (0..width * height).map(mean).collect())
}
