//! Unusable files: the real program names the file, the reason and the remedy, exits with code 2, and never panics.

use crate::program::{image, lookalike, write_exr, write_merl, write_png};
use lookalike::{
    image::Image,
    scene::{Camera, CircleSource, PixelStatus},
};
use lookalike_app::{
    inputs::{LoadedCapture, load_capture},
    settings::{CaptureSettings, EnvironmentSettings, ViewSettings},
};
use std::{fs, path::Path};

fn grey(width: usize, height: usize) -> Image {
    image(width, height, |_, _| [0.5; 3])
}

/// A folder of usable and unusable files.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("map.exr"), &grey(16, 8));
    write_exr(&at("photo.exr"), &grey(24, 24));
    write_exr(&at("black.exr"), &image(16, 8, |_, _| [0.0; 3]));
    write_exr(&at("tiny.exr"), &grey(1, 1));
    write_exr(&at("square.exr"), &grey(16, 16));
    write_exr(&at("negative.exr"), &image(16, 8, |c, r| [if (c, r) == (3, 2) { -0.5 } else { 1.0 }; 3]));
    write_exr(&at("nan24.exr"), &image(24, 24, |c, r| [0.1, if (c, r) == (5, 4) { f32::NAN } else { 1.0 }, 0.1]));
    write_exr(&at("nan.exr"), &image(16, 8, |c, r| [0.1, if (c, r) == (5, 4) { f32::NAN } else { 1.0 }, 0.1]));
    write_png(&at("map.png"), &grey(16, 8));
    write_png(&at("small.png"), &grey(12, 12));
    write_png(&at("coloured.png"), &image(24, 24, |c, _| [if c == 7 { 0.2 } else { 1.0 }, 1.0, 1.0]));
    let whole = fs::read(at("map.exr")).unwrap();
    fs::write(at("half.exr"), &whole[..whole.len() / 2]).unwrap();
    fs::write(at("empty.exr"), []).unwrap();
    fs::write(at("notes.txt"), "not an image").unwrap();
    fs::create_dir(at("folder.exr")).unwrap();
    folder
}

const PAINT: &str = "render --model ggx --params kd=.5,f0=.04,alpha=.1 --size 8 --samples 1 -o out.exr";

#[test]
fn unusable_environment_maps_are_refused() {
    let folder = folder();
    for (file, phrases) in [
        ("missing.exr", &["there is no such file; check the path"][..]),
        ("folder.exr", &["expected a file, found a folder"]),
        ("half.exr", &["not a valid OpenEXR file", "copy or export it again"]),
        ("empty.exr", &["found an empty file"]),
        ("notes.txt", &["expected OpenEXR, Radiance HDR, PFM, PNG, JPEG or TIFF"]),
        ("map.png", &["found display values (PNG)", "clipped", "use the HDR file"]),
        ("tiny.exr", &["size 1 x 1", "--env-mapping latlong, cross, angular or mirror-ball"]),
        ("square.exr", &["size 16 x 16", "--env-mapping"]),
        ("black.exr", &["black everywhere"]),
        ("negative.exr", &["radiance (-0.5, -0.5, -0.5) at column 3, row 2"]),
        ("nan.exr", &["radiance (0.1, NaN, 0.1) at column 5, row 4"]),
        ("map.exr --env-mapping cross", &["layout cross must be 3:4", "found 16 x 8"]),
    ] {
        let answer = lookalike(folder.path(), &format!("{PAINT} --env {file}"));
        let name = file.split(' ').next().unwrap_or(file);
        answer.refused(&[&[&*format!("cannot use {name} as the environment map")], phrases].concat());
        assert!(!folder.path().join("out.exr").exists());
    }
    lookalike(folder.path(), &format!("{PAINT} --env square.exr --env-mapping angular")).done();
}

#[test]
fn unusable_measured_materials_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    write_merl(&at("good.binary"), [0.1; 3]);
    let good = fs::read(at("good.binary")).unwrap();
    let mut nan = good.clone();
    nan[12..20].copy_from_slice(&f64::NAN.to_le_bytes());
    for (name, bytes) in [("nan.binary", &nan[..]), ("half.binary", &good[..1 << 20]), ("gone.binary", &[])] {
        fs::write(at(name), bytes).unwrap();
    }
    write_merl(&at("holes.binary"), [-1.0; 3]);
    for (file, phrase) in [
        ("missing.binary", "there is no such file"),
        ("folder.exr", "found a folder"),
        ("map.exr", "90, 90, 180, found"),
        ("half.binary", "34992012 bytes, found 1048576"),
        ("gone.binary", "34992012 bytes, found 0"),
        ("nan.binary", "found NaN in channel 0 at theta_h 0, theta_d 0, phi_d 0"),
        ("holes.binary", "only negative cells"),
    ] {
        let answer = lookalike(folder.path(), &format!("render --brdf {file} --env map.exr -o out.exr"));
        answer.refused(&[&format!("cannot use {file} as the measured material"), phrase]);
    }
}

#[test]
fn unusable_normal_maps_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("away.exr"), &image(8, 8, |_, _| [0.0, 0.0, -1.0]));
    write_exr(&at("packed.exr"), &image(8, 8, |_, _| [0.5, 0.5, 1.0]));
    write_exr(&at("nan.exr"), &image(8, 8, |_, _| [f32::NAN; 3]));
    for (file, phrase) in [
        ("missing.exr", "there is no such file"),
        ("map.png", "export the normals as OpenEXR or PFM"),
        ("away.exr", "no normal that faces the camera"),
        ("packed.exr", "decode them by 2 c - 1"),
        ("nan.exr", "(NaN, NaN, NaN) at column 0, row 0"),
        ("tiny.exr", "1 x 1"),
        ("half.exr", "not a valid OpenEXR file"),
    ] {
        let answer = lookalike(folder.path(), &format!("{PAINT} --env map.exr --normals {file}"));
        answer.refused(&[&format!("cannot use {file} as the normal map"), phrase]);
    }
}

#[test]
fn unusable_images_to_compare_are_refused() {
    let folder = folder();
    for (files, phrases) in [
        ("missing.exr photo.exr", &["cannot use missing.exr as the reference", "no such file"][..]),
        ("photo.exr missing.exr", &["cannot use missing.exr as the image", "no such file"]),
        ("photo.exr folder.exr", &["cannot use folder.exr as the image", "found a folder"]),
        ("photo.exr half.exr", &["cannot use half.exr as the image", "not a valid OpenEXR file"]),
        ("photo.exr map.exr", &["cannot compare photo.exr and map.exr", "expected 24 x 24 pixels, found 16 x 8"]),
        ("tiny.exr tiny.exr", &["1 x 1 pixels is too small", "at least 11 x 11"]),
        ("nan24.exr nan24.exr", &["found NaN", "column 5, row 4"]),
        ("photo.exr photo.exr --mask small.png", &["cannot use small.png as the mask", "12 x 12", "24 x 24"]),
        ("photo.exr photo.exr --mask coloured.png", &["cannot use coloured.png as the mask", "column 7, row 0"]),
        ("photo.exr photo.exr --mask missing.png", &["cannot use missing.png as the mask", "no such file"]),
    ] {
        lookalike(folder.path(), &format!("compare {files}")).refused(phrases);
    }
    write_exr(&folder.path().join("dark.exr"), &image(24, 24, |_, _| [0.0; 3]));
    lookalike(folder.path(), "compare dark.exr photo.exr --display-exposure auto")
        .refused(&["--display-exposure auto", "is 0, expected a positive radiance"]);
    write_png(&folder.path().join("nothing.png"), &image(24, 24, |_, _| [0.0; 3]));
    lookalike(folder.path(), "compare photo.exr photo.exr --mask nothing.png").refused(&["check the mask"]);
}

#[cfg(unix)]
#[test]
fn unreadable_file_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let path = folder.path().join("map.exr");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::File::open(&path).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    lookalike(folder.path(), &format!("{PAINT} --env map.exr")).refused(&["this user may not read the file"]);
}

/// The photo of a fit, through the loader that `fit` uses.
fn capture(folder: &Path, photo: &str, mask: Option<&str>, normals: Option<&str>) -> Result<LoadedCapture, String> {
    let environment = EnvironmentSettings { path: folder.join("map.exr"), mapping: None, rotation_deg: 0.0 };
    let view = ViewSettings { camera: Camera::Orthographic, normals: normals.map(|name| folder.join(name)) };
    let (photo, mask) = (folder.join(photo), mask.map(|name| folder.join(name)));
    let files = CaptureSettings { photo, layer: None, mask, environment, view, sphere: None };
    load_capture(&files).map_err(|error| format!("{error:#}"))
}

#[test]
fn unusable_photos_of_a_fit_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let half_nan = |c: usize, _| if c < 13 { [f32::NAN; 3] } else { [0.5; 3] };
    write_exr(&at("half_nan.exr"), &image(24, 24, half_nan));
    write_exr(&at("dark.exr"), &image(24, 24, |_, _| [0.0; 3]));
    write_png(&at("white.png"), &image(24, 24, |_, _| [1.0; 3]));
    write_png(&at("nothing.png"), &image(24, 24, |_, _| [0.0; 3]));
    write_exr(&at("wide.exr"), &image(20, 8, |_, _| [0.0, 0.0, 1.0]));
    for (photo, mask, normals, phrases) in [
        ("missing.exr", None, None, &["missing.exr as the photo", "there is no such file"][..]),
        ("half.exr", None, None, &["half.exr as the photo", "not a valid OpenEXR file"]),
        ("tiny.exr", None, None, &["at least 2 x 2"]),
        ("dark.exr", None, None, &["dark.exr as the photo", "black over the whole object"]),
        ("half_nan.exr", None, None, &["are not finite, the first at column"]),
        ("white.png", None, None, &["no usable pixel", "clipped"]),
        ("photo.exr", Some("small.png"), None, &["small.png as the mask", "12 x 12"]),
        ("photo.exr", Some("nothing.png"), None, &["cannot place the sphere", "make the object white"]),
        ("photo.exr", None, Some("wide.exr"), &["wide.exr as the normal map", "20 x 8", "24 x 24"]),
    ] {
        let message = capture(folder.path(), photo, mask, normals).unwrap_err();
        for phrase in phrases {
            assert!(message.contains(phrase), "{photo}: expected {phrase:?} in: {message}");
        }
    }
}

#[test]
fn photo_with_a_few_bad_pixels_is_used_without_them() {
    let folder = folder();
    let mut photo = grey(24, 24);
    photo.pixels_mut()[12 * 24 + 12] = [f32::INFINITY, 0.0, 0.0];
    write_exr(&folder.path().join("spot.exr"), &photo);
    let loaded = capture(folder.path(), "spot.exr", None, None).unwrap();
    assert_eq!(loaded.capture.status()[12 * 24 + 12], PixelStatus::NotFinite);
    assert_eq!((loaded.circle_source, loaded.mask.is_none()), (Some(CircleSource::Inscribed), true));
    let said = |phrase: &str| loaded.warnings.iter().filter(|text| text.contains(phrase)).count();
    assert_eq!((said("1 pixel of the object is not finite"), said("not black around the object")), (1, 1));
    assert_eq!(loaded.photo.blake3, lookalike::image::content_hash(&photo).to_hex().to_string());
}
