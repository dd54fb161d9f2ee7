use image::ExtendedColorType as Colour;

use super::ldr::{jpeg_of, png_of};
use super::pfm::map;
use crate::image::{Image, ImageError, decode_mask, decode_normals, openexr};

#[test]
fn a_grey_mask_is_linear_in_its_codes() {
    let mask = decode_mask("m.png", &png_of(&[0, 51, 102, 255], 2, 2, Colour::L8)).unwrap();
    assert_eq!(mask.values(), [0.0, 0.2, 0.4, 1.0]);
    assert_eq!(mask.value(1, 0), 0.2);
    let mask = decode_mask("m.jpg", &jpeg_of(&[255; 64], 8, 8, Colour::L8)).unwrap();
    assert_eq!(mask.values(), [1.0; 64]);
}

#[test]
fn alpha_is_preferred_to_colours_unless_it_is_one_everywhere() {
    let mask = decode_mask("m.png", &png_of(&[9, 9, 9, 255, 7, 8, 9, 51], 2, 1, Colour::Rgba8)).unwrap();
    assert_eq!(mask.values(), [1.0, 0.2]);
    let mask = decode_mask("m.png", &png_of(&[51, 51, 51, 255, 0, 0, 0, 255], 2, 1, Colour::Rgba8)).unwrap();
    assert_eq!(mask.values(), [0.2, 0.0]);
}

#[test]
fn a_coloured_mask_and_values_outside_the_range_are_refused_with_coordinates() {
    let error = decode_mask("m.png", &png_of(&[0, 0, 0, 0, 0, 1], 2, 1, Colour::Rgb8)).unwrap_err();
    assert_eq!(error, ImageError::ColouredMask { name: "m.png".to_owned(), column: 1, row: 0 });
    for bad in [1.01, -0.1, f32::NAN, f32::INFINITY] {
        let error = decode_mask("m.pfm", &map("Pf\n1 2\n-1\n", &[bad, 0.5], true)).unwrap_err();
        assert!(matches!(error, ImageError::Coverage { column: 0, row: 1, .. }), "{error}");
    }
}

#[test]
fn normals_are_normalised_and_the_background_is_zero() {
    let samples = [0.0, 0.0, 0.0, 0.0, 0.0, 1.009, -0.6, 0.0, 0.8];
    let normals = decode_normals("n.pfm", &map("PF\n3 1\n-1\n", &samples, true)).unwrap();
    assert_eq!(normals.value(0, 0).to_array(), [0.0; 3]);
    assert_eq!(normals.value(1, 0).to_array(), [0.0, 0.0, 1.0]);
    assert!((normals.value(2, 0).x + 0.6).abs() < 1e-7 && (normals.value(2, 0).length() - 1.0).abs() < 1e-15);
}

#[test]
fn normals_of_another_length_are_refused_with_coordinates() {
    // The last one is a normal along +Z packed into [0, 1].
    for bad in [[0.0, 0.0, 1.02], [0.0, 0.0, 0.98], [f32::NAN, 0.0, 1.0], [f32::INFINITY, 0.0, 0.0], [0.5, 0.5, 1.0]] {
        let image = Image::from_pixels(2, 1, vec![[0.0; 3], bad]);
        let error = decode_normals("n.exr", &openexr::write(&image, None, &[]).unwrap()).unwrap_err();
        assert!(matches!(error, ImageError::Normal { column: 1, row: 0, .. }), "{error}");
    }
    let error = decode_normals("n.png", &png_of(&[128, 128, 255], 1, 1, Colour::Rgb8)).unwrap_err();
    assert!(error.to_string().contains("OpenEXR or PFM"), "{error}");
}
