use super::*;
use crate::scene::{Camera, Circle};

const SIZE: usize = 32;

fn input() -> CaptureInput {
    let geometry = Geometry::sphere(SIZE, SIZE, Circle::inscribed(SIZE, SIZE), Camera::Orthographic).unwrap();
    let shade = |k: usize| if geometry.coverage(k % SIZE, k / SIZE) > 0.0 { [0.5, 0.4, 0.3] } else { [0.0; 3] };
    let photo = Image::from_pixels(SIZE, SIZE, (0..SIZE * SIZE).map(shade).collect());
    let environment = Environment::new(Image::from_pixels(4, 2, vec![[1.0; 3]; 8])).unwrap();
    CaptureInput { photo, clipped: None, mask: None, geometry, environment: Arc::new(environment) }
}

fn with(change: impl FnOnce(&mut CaptureInput)) -> Result<Capture, SceneError> {
    let mut input = input();
    change(&mut input);
    Capture::new(input)
}

fn full_mask(value: impl Fn(usize) -> f32) -> Mask {
    Mask::new(SIZE, SIZE, (0..SIZE * SIZE).map(value).collect()).unwrap()
}

/// Row-major index of a pixel in the middle of the sphere.
const MIDDLE: usize = 16 * SIZE + 16;

#[test]
fn a_clean_photo_is_usable_inside_the_silhouette_without_a_warning() {
    let capture = with(|_| {}).unwrap();
    let counts = capture.counts();
    assert_eq!(counts.usable + counts.outside + counts.silhouette, SIZE * SIZE);
    assert!((700..760).contains(&counts.usable) && counts.outside > 100, "{counts}");
    assert_eq!(capture.usable().count(), counts.usable);
    assert!(capture.usable().all(|k| capture.coverage()[k] == 1.0));
    assert_eq!(capture.warnings(), &[] as &[String]);
    assert!(!capture.has_background());
    assert_eq!(capture.scoring_coverage(), capture.coverage());
    assert_eq!(capture.status()[0], PixelStatus::Outside);
    assert_eq!(capture.status()[MIDDLE], PixelStatus::Usable);
}

#[test]
fn every_reason_of_exclusion_has_its_status() {
    let capture = with(|input| {
        let mut clipped = vec![false; SIZE * SIZE];
        (clipped[MIDDLE + 1], clipped[0]) = (true, true);
        input.clipped = Some(clipped);
        input.photo.pixels_mut()[MIDDLE + 2] = [f32::NAN, 1.0, 1.0];
        input.photo.pixels_mut()[MIDDLE + 3] = [f32::INFINITY, 1.0, 1.0];
        input.mask = Some(full_mask(|k| {
            [1.0, 0.0, 0.5][[MIDDLE + 4, MIDDLE + 5].iter().position(|&p| p == k).map_or(0, |i| i + 1)]
        }));
    })
    .unwrap();
    let status = capture.status();
    assert_eq!(status[MIDDLE + 1], PixelStatus::Clipped);
    assert_eq!((status[MIDDLE + 2], status[MIDDLE + 3]), (PixelStatus::NotFinite, PixelStatus::NotFinite));
    assert_eq!((status[MIDDLE + 4], status[MIDDLE + 5]), (PixelStatus::Masked, PixelStatus::Masked));
    assert_eq!(status[0], PixelStatus::Outside);
    let counts = capture.counts();
    assert_eq!((counts.clipped, counts.not_finite, counts.masked), (1, 2, 2), "{counts}");
    assert!(capture.warnings().iter().any(|w| w.contains("clipped")));
    assert!(capture.warnings().iter().any(|w| w.contains("2 pixels of the object are not finite")));
}

#[test]
fn pixels_that_are_not_finite_are_not_scored() {
    let capture = with(|input| {
        input.photo.pixels_mut()[MIDDLE] = [f32::NAN; 3];
        input.photo.pixels_mut()[1] = [f32::NAN; 3];
    })
    .unwrap();
    assert_eq!((capture.photo().pixels()[MIDDLE], capture.photo().pixels()[1]), ([0.0; 3], [0.0; 3]));
    assert_eq!((capture.coverage()[MIDDLE], capture.scoring_coverage()[MIDDLE]), (0.0, 0.0));
    // Pixel 1 lies outside the object and is not counted.
    assert_eq!(capture.counts().not_finite, 1);
}

#[test]
fn with_a_background_only_full_pixels_are_scored() {
    for capture in [
        with(|input| input.mask = Some(full_mask(|_| 1.0))).unwrap(),
        with(|input| input.photo.pixels_mut()[..SIZE].fill([0.9; 3])).unwrap(),
    ] {
        assert!(capture.has_background());
        let scoring = capture.scoring_coverage();
        assert!(scoring.iter().zip(capture.coverage()).all(|(&s, &c)| s == if c == 1.0 { 1.0 } else { 0.0 }));
    }
    let lit_outside = with(|input| input.photo.pixels_mut()[..SIZE].fill([0.9; 3])).unwrap();
    assert!(lit_outside.warnings().iter().any(|w| w.contains("--mask")), "{:?}", lit_outside.warnings());
}

#[test]
fn the_edge_of_a_normal_map_is_silhouette() {
    let capture = with(|input| {
        let at = |k: usize| if k % SIZE >= 8 { [0.0, 0.0, 1.0] } else { [0.0; 3] };
        let map = Image::from_pixels(SIZE, SIZE, (0..SIZE * SIZE).map(at).collect());
        input.geometry = Geometry::normals(&map, Camera::Orthographic).unwrap();
        input.photo.pixels_mut().fill([0.5; 3]);
    })
    .unwrap();
    let status = |column: usize| capture.status()[10 * SIZE + column];
    assert_eq!(
        [status(7), status(8), status(9), status(31)],
        [PixelStatus::Outside, PixelStatus::Silhouette, PixelStatus::Usable, PixelStatus::Usable]
    );
}

#[test]
fn a_photo_brighter_than_its_light_is_reported() {
    let capture = with(|input| input.photo.pixels_mut().iter_mut().for_each(|p| *p = p.map(|x| 4.0 * x))).unwrap();
    assert!(capture.warnings().iter().any(|w| w.contains("different exposures")), "{:?}", capture.warnings());
}

#[test]
fn a_sphere_cut_off_by_the_border_is_reported() {
    let capture = with(|input| {
        let circle = Circle { x: 4.0, y: 16.0, radius: 14.0 };
        input.geometry = Geometry::sphere(SIZE, SIZE, circle, Camera::Orthographic).unwrap();
    })
    .unwrap();
    assert!(capture.warnings().iter().any(|w| w.contains("outside the photo")), "{:?}", capture.warnings());
}

#[test]
fn faults_are_named() {
    let mask = Mask::new(8, 4, vec![1.0; 32]).unwrap();
    let error = with(|input| input.mask = Some(mask)).unwrap_err();
    assert_eq!(error, SceneError::Size { what: "mask", width: 32, height: 32, found_width: 8, found_height: 4 });
    assert!(error.to_string().contains("8 x 4") && error.to_string().contains("32 x 32"), "{error}");

    let error = with(|input| input.photo = Image::new(16, 16)).unwrap_err();
    assert!(matches!(error, SceneError::Size { what: "geometry", .. }));
    let error = with(|input| input.photo = Image::new(1, 1)).unwrap_err();
    assert_eq!(error, SceneError::TooSmall { width: 1, height: 1 });

    let error = with(|input| input.photo.pixels_mut().fill([0.0; 3])).unwrap_err();
    assert!(matches!(error, SceneError::Black { .. }), "{error}");
    let error = with(|input| input.photo.pixels_mut()[..600].fill([f32::NAN; 3])).unwrap_err();
    assert!(matches!(error, SceneError::NotFinite { row: 0, .. }), "{error}");
    let error = with(|input| input.mask = Some(full_mask(|_| 0.0))).unwrap_err();
    assert!(error.to_string().contains("0 usable") && error.to_string().contains("masked"), "{error}");
    let error = with(|input| input.clipped = Some(vec![true; SIZE * SIZE])).unwrap_err();
    assert!(matches!(error, SceneError::NothingUsable(counts) if counts.clipped > 600), "{error}");
}

/// A ball that is brightest in its middle, in all channels alike, cut off at a level.
fn cut_off(level: f32, channels: [f32; 3]) -> Capture {
    with(|input| {
        for (k, pixel) in input.photo.pixels_mut().iter_mut().enumerate() {
            let at = |k: usize| (k as f32 - 16.3) / 16.0;
            let light = 2.0 - at(k % SIZE).powi(2) - 1.1 * at(k / SIZE).powi(2);
            *pixel = channels.map(|channel| (channel * light).min(level).max(0.0));
        }
    })
    .unwrap()
}

#[test]
fn pixels_at_a_level_where_the_photo_was_cut_off_are_clipped() {
    let capture = cut_off(1.8, [1.0, 0.99, 0.4]);
    assert_eq!((capture.clipped_at(), capture.status()[MIDDLE]), (Some(1.8), PixelStatus::Clipped));
    // About pi 16^2 (.2 / sqrt(1.1)) of them.
    assert!((140..170).contains(&capture.counts().clipped), "{}", capture.counts());
    assert!(capture.warnings().iter().any(|text| text.contains("the photo ends at 1.8")), "{:?}", capture.warnings());
    let whole = cut_off(3.0, [1.0, 0.99, 0.4]);
    assert_eq!((whole.clipped_at(), whole.counts().clipped), (None, 0));
    // A reflection of constant radiance has another level in each channel.
    let mut reflection = input();
    for (k, pixel) in reflection.photo.pixels_mut().iter_mut().enumerate() {
        let light = if k % SIZE < 18 && k % SIZE > 12 { 5.0 } else { 0.001 * k as f32 };
        *pixel = [0.9, 0.6, 0.3].map(|f0| f0 * light);
    }
    assert_eq!(Capture::new(reflection).unwrap().clipped_at(), None);
}
