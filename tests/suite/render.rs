//! `lookalike render` on the command line.

use crate::program::{data, image, lookalike, lookalike_on_threads, write_exr, write_merl};
use lookalike::image::{Decoded, decode, metadata as keys};
use std::{fs, path::Path};

const WHITE: &str = "--model cook-torrance --params kd=.5,.4,.3,ks=0,f0=0,m=.3";
const GLOSSY: &str = "--model ggx --params kd=.2,.1,.1,f0=.5,alpha=.1";

fn read(path: &Path) -> Decoded {
    decode("result", &fs::read(path).unwrap()).unwrap()
}

/// A folder with maps: `white.exr` has radiance 2 everywhere, `right.exr` and `up.exr` light from half of the directions.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("white.exr"), &image(16, 8, |_, _| [2.0; 3]));
    // +X is at u = 1/4.
    write_exr(&at("right.exr"), &image(16, 8, |column, _| [if column < 8 { 1.0 } else { 0.0 }; 3]));
    write_exr(&at("up.exr"), &image(16, 8, |_, row| [if row < 4 { 1.0 } else { 0.0 }; 3]));
    folder
}

fn entry<'a>(decoded: &'a Decoded, key: &str) -> &'a str {
    &decoded.metadata.iter().find(|(k, _)| k == key).unwrap_or_else(|| panic!("no {key}: {decoded:?}")).1
}

#[test]
fn diffuse_sphere_in_white_light_has_its_albedo() {
    let folder = folder();
    let answer =
        lookalike(folder.path(), &format!("render {WHITE} --env white.exr --size 32 --samples 512 -o a.exr")).done();
    assert_eq!(answer.stdout, "");
    for phrase in ["light: white.exr (latlong)", "mean radiance over the object: ", "noise: ", "wrote a.exr"] {
        assert!(answer.stderr.contains(phrase), "{}", answer.stderr);
    }
    let decoded = read(&folder.path().join("a.exr"));
    let alpha = decoded.alpha.as_ref().unwrap();
    assert_eq!((decoded.image.width(), decoded.image.height(), alpha[0], alpha[16 * 32 + 16]), (32, 32, 0.0, 1.0));
    let (mut sum, mut covered) = ([0.0; 3], 0.0);
    for (pixel, coverage) in decoded.image.pixels().iter().zip(alpha) {
        covered += coverage;
        sum.iter_mut().zip(pixel).for_each(|(s, x)| *s += x);
    }
    // 512 samples leave about 0.5 % per pixel, and there are 800 of them.
    for (sum, expected) in sum.iter().zip([1.0, 0.8, 0.6]) {
        assert!((sum / covered / expected - 1.0).abs() < 2e-3, "{sum} {covered} {expected}");
    }
}

#[test]
fn metadata_record_what_was_rendered() {
    let folder = folder();
    let flags = format!("render {GLOSSY} --env white.exr --env-rotation 30 --camera perspective:20 --size 16");
    lookalike(folder.path(), &format!("{flags} --samples 16 --seed 7 -o a.exr")).done();
    let decoded = read(&folder.path().join("a.exr"));
    let map = read(&folder.path().join("white.exr"));
    let hash = lookalike::image::content_hash(&map.image).to_hex();
    for (key, expected) in [
        (keys::MODEL, "ggx"),
        (keys::PARAMETERS, "kd.r=0.2,kd.g=0.1,kd.b=0.1,f0.r=0.5,f0.g=0.5,f0.b=0.5,f90=1,alpha=0.1"),
        (keys::CAMERA, "perspective:20"),
        (keys::SAMPLES, "16"),
        (keys::SEED, "7"),
        (keys::ENVIRONMENT, &format!("white.exr blake3:{hash}, latlong, rotated by 30 degrees")),
        (keys::SOFTWARE, concat!("lookalike ", env!("CARGO_PKG_VERSION"))),
    ] {
        assert_eq!(entry(&decoded, key), expected);
    }
    assert!(entry(&decoded, keys::CONVENTIONS).contains("+Y up"));
    assert!(entry(&decoded, keys::DISPLAY_EXPOSURE).parse::<f64>().unwrap() > 0.0);
}

#[test]
fn light_comes_from_its_direction_in_the_map() {
    let folder = folder();
    let luminance = |flags: &str, column: usize, row: usize| {
        lookalike(folder.path(), &format!("render {WHITE} {flags} --size 32 --samples 64 -o side.exr")).done();
        read(&folder.path().join("side.exr")).image.pixel(column, row)[0]
    };
    let (right, left) = (luminance("--env right.exr", 27, 16), luminance("--env right.exr", 4, 16));
    assert!(right > 4.0 * left, "{right} {left}");
    let (top, bottom) = (luminance("--env up.exr", 16, 4), luminance("--env up.exr", 16, 27));
    assert!(top > 4.0 * bottom, "{top} {bottom}");
    // A turn by 180 degrees about +Y brings +X to -X.
    let (right, left) = (
        luminance("--env right.exr --env-rotation 180", 27, 16),
        luminance("--env right.exr --env-rotation 180", 4, 16),
    );
    assert!(left > 4.0 * right, "{right} {left}");
}

#[test]
fn rendered_file_has_the_same_bytes_on_any_number_of_threads() {
    let folder = folder();
    let file = |threads: usize| {
        let flags = format!("render {GLOSSY} --env right.exr --size 24 --samples 32 -o {threads}.exr");
        lookalike_on_threads(folder.path(), threads, &flags).done();
        fs::read(folder.path().join(format!("{threads}.exr"))).unwrap()
    };
    let one = file(1);
    assert_eq!(one, file(2));
    assert_eq!(one, file(5));
}

#[test]
fn measured_material_is_rendered_and_named_in_metadata() {
    let folder = folder();
    write_merl(&folder.path().join("flat.binary"), [0.3, 0.2, 0.1]);
    lookalike(folder.path(), "render --brdf flat.binary --env white.exr --size 16 --samples 1024 -o a.exr").done();
    let decoded = read(&folder.path().join("a.exr"));
    for (found, f) in decoded.image.pixel(8, 8).into_iter().zip([0.3, 0.2, 0.1]) {
        let expected = 2.0 * std::f64::consts::PI * f;
        assert!((f64::from(found) / expected - 1.0).abs() < 0.02, "{found} {expected}");
    }
    let hash = blake3_of(&folder.path().join("flat.binary"));
    assert_eq!(
        (entry(&decoded, keys::MODEL), entry(&decoded, keys::BRDF)),
        ("merl", &*format!("flat.binary blake3:{hash}"))
    );
}

fn blake3_of(path: &Path) -> String {
    let bytes = fs::read(path).unwrap();
    lookalike::brdf::merl::MerlTable::read("flat", &bytes).unwrap().content_hash().to_hex().to_string()
}

#[test]
fn normal_map_determines_size_and_shape() {
    let folder = folder();
    // The left half faces the camera, the right half is turned to +X; the frame is background.
    let turned = [0.8, 0.0, 0.6];
    let normal = |column: usize, row: usize| match (column, row) {
        (0 | 19, _) | (_, 0 | 11) => [0.0; 3],
        (..10, _) => [0.0, 0.0, 1.0],
        _ => turned,
    };
    write_exr(&folder.path().join("normals.exr"), &image(20, 12, normal));
    let flags = "--env right.exr --normals normals.exr --samples 256 -o a.exr";
    let answer = lookalike(folder.path(), &format!("render {WHITE} {flags}")).done();
    assert!(answer.stderr.contains("warning: a shape from normals is lit as if convex"), "{}", answer.stderr);
    let decoded = read(&folder.path().join("a.exr"));
    assert_eq!((decoded.image.width(), decoded.image.height()), (20, 12));
    // Half of the light of a wall that faces the boundary of the lit half; (1 + cos) / 2 of it when turned by 53 degrees.
    let (front, side) = (decoded.image.pixel(5, 6)[0], decoded.image.pixel(15, 6)[0]);
    assert!((front - 0.25).abs() < 0.02 && (side - 0.45).abs() < 0.03, "{front} {side}");
    assert_eq!(decoded.image.pixel(0, 6), [0.0; 3]);
}

#[test]
fn png_and_pfm_are_written_by_extension() {
    let folder = folder();
    let flags = format!("render {GLOSSY} --env right.exr --size 16 --samples 64");
    for name in ["a.exr", "a.pfm", "a.PNG"] {
        lookalike(folder.path(), &format!("{flags} -o {name}")).done();
    }
    let [exr, pfm, png] = ["a.exr", "a.pfm", "a.PNG"].map(|name| read(&folder.path().join(name)));
    assert_eq!(exr.image, pfm.image);
    let exposure: f64 = entry(&png, keys::DISPLAY_EXPOSURE).parse().unwrap();
    for (shown, radiance) in png.image.pixels().iter().flatten().zip(exr.image.pixels().iter().flatten()) {
        let expected = (f64::from(*radiance) * exposure).clamp(0.0, 1.0);
        // Half a code near white, in linear light.
        assert!((f64::from(*shown) - expected).abs() < 0.005, "{shown} {expected}");
    }
    lookalike(folder.path(), &format!("{flags} -o a.tif")).refused(&["cannot write a.tif", ".exr, .pfm or .png"]);
}

#[test]
fn renderings_with_other_seeds_differ_by_their_noise_only() {
    let folder = folder();
    for seed in [1, 2] {
        let flags = format!("--env right.exr --size 48 --samples 1024 --seed {seed} -o {seed}.exr");
        lookalike(folder.path(), &format!("render {GLOSSY} {flags}")).done();
    }
    let answer = lookalike(folder.path(), "compare 1.exr 2.exr --display-exposure from:1.exr --json").done();
    let json: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    let score = json["score"].as_f64().unwrap();
    assert!(score > 0.0 && score < 2e-3, "{score}");
    assert_eq!(json["object"], "alpha");
}

#[test]
fn bad_settings_are_refused_with_the_valid_values() {
    let folder = folder();
    let render = |flags: &str| lookalike(folder.path(), &format!("render --env white.exr -o a.exr {flags}"));
    for (flags, phrases) in [
        ("--model ggx --params kd=.5,f0=.04", &["--params", "'alpha' of model ggx is missing: give alpha=0.1"][..]),
        ("--model ggx --params kd=.5,f0=.04,roughness=.3", &["no parameter 'roughness': it has kd, f0, f90, alpha"]),
        ("--model ggx --params kd=.5,f0=3,alpha=.3", &["parameter 'f0' is 3: expected a value in [0, 2]"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3,.3,.3", &["'alpha' takes 1 number(s), found 3"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3 --size 1", &["cannot place the sphere", "at least 2 x 2"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3 --size 99999", &["--size must be at most 16384"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3 --samples 9999999999", &["--samples must be at most 4294967295"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3 --camera perspective:175", &["perspective:175", "0.1 and 170"]),
        ("--model ggx --params kd=.5,f0=0,alpha=.3 -o there/a.exr", &["cannot write there/a.exr", "create it first"]),
        (
            "--model ggx --params kd=.5,f0=0,alpha=.3 --normals white.exr",
            &["cannot use white.exr as the normal map", "neither 0 nor of length 1"],
        ),
    ] {
        render(flags).refused(phrases);
    }
}

/// The table written by `make_merl.py` against the network from which it was made.
#[test]
fn table_of_a_real_material_agrees_with_its_network() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let network = data.join("materials/gold-metallic-paint3.nbrdf.json");
    let table = folder.path().join("gold.binary");
    let script = data.join("../tools/make_merl.py");
    let made = std::process::Command::new("python3").arg(script).args([&network, &table]).output();
    if !made.is_ok_and(|output| output.status.success()) {
        println!("skipped: python3 with numpy and make_merl.py beside the data are needed");
        return;
    }
    let gold = lookalike::brdf::merl::MerlTable::read("gold", &fs::read(&table).unwrap()).unwrap();
    let formula = super::network::Network::read(&network);
    let mut errors = Vec::new();
    for n in 0..20_000_u64 {
        let [wi, wo] = [2 * n, 2 * n + 1].map(|k| super::network::direction(k, 0.1));
        let (found, expected) = (gold.eval(wi, wo), formula.eval(wi, wo));
        errors.push((found - expected).abs().max_element() / expected.max_element());
    }
    errors.sort_by(f64::total_cmp);
    let [median, upper, last] = [10_000, 19_800, 19_999].map(|i| errors[i]);
    println!("relative error: median {median:.2e}, 99th percentile {upper:.2e}, largest {last:.2e}");
    assert!(median < 1e-3 && upper < 0.02 && last < 0.2, "{median} {upper} {last}");
}
