//! Manifests and what they ask for; every kind of mistake, with its line.

use super::*;
use lookalike::fit::SearchKind;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with `batch.toml` and some empty files.
fn folder(text: &str, files: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("batch.toml"), text).unwrap();
    for file in files {
        let path = folder.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    folder
}

fn read_with(folder: &TempDir, given: &[&str]) -> anyhow::Result<Vec<BatchFit>> {
    let given: Vec<OsString> = given.iter().map(OsString::from).collect();
    read(&folder.path().join("batch.toml"), &given)
}

fn fits(text: &str, files: &[&str]) -> Vec<BatchFit> {
    read_with(&folder(text, files), &[]).unwrap()
}

fn names(fits: &[BatchFit]) -> Vec<&str> {
    fits.iter().map(|fit| fit.name.as_str()).collect()
}

#[test]
fn product_is_every_photo_under_every_light_with_every_model() {
    let text = "photos = 'in/*.exr'\nenvironments = ['m.hdr', 'n.hdr']\nmodels = ['ggx', 'cook-torrance']\n";
    let folder = folder(text, &["in/b.exr", "in/a.exr", "in/c.png", "in/deep/d.exr"]);
    let fits = read_with(&folder, &[]).unwrap();
    let expected = [
        "a-m-ggx",
        "a-m-cook-torrance",
        "b-m-ggx",
        "b-m-cook-torrance",
        "a-n-ggx",
        "a-n-cook-torrance",
        "b-n-ggx",
        "b-n-cook-torrance",
    ];
    assert_eq!(names(&fits), expected);
    assert_eq!(fits[7].capture.photo, folder.path().join("in/b.exr"));
    assert_eq!(fits[7].capture.environment.path, folder.path().join("n.hdr"));
    assert_eq!((&*fits[7].methods.name(), fits[7].line), ("cook-torrance", 1));
}

#[test]
fn single_files_need_no_list_and_need_not_exist() {
    let fits = fits("photos = 'a [1].exr'\nenvironments = 'm.hdr'\n", &["a 1.exr"]);
    assert_eq!(names(&fits), ["a_1-m-auto"], "brackets are a pattern");
    let fits = self::fits("photos = 'not-there.exr'\nenvironments = 'm.hdr'\n", &[]);
    assert_eq!(names(&fits), ["not-there-m-auto"]);
}

#[test]
fn later_settings_win_defaults_then_set_or_fit_then_the_command_line() {
    let text = "[defaults]\nsamples = 64\nseed = 1\nenv = 'm.hdr'\nenv_rotation = 10\n\
                [[set]]\nphotos = 'a.exr'\nseed = 2\nmask = 'mask.png'\n\
                [[fit]]\nphoto = 'b.exr'\nenv = 'n.hdr'\nseed = 3\nname = 'other'\nmax-cssim = 0.1\nsphere = [1, 2, 3]\n";
    let folder = folder(text, &[]);
    let of = |given: &[&str]| read_with(&folder, given).unwrap();
    let fits = of(&[]);
    assert_eq!(names(&fits), ["a-m-auto", "other"]);
    assert_eq!((fits[0].methods.common().seed, fits[1].methods.common().seed), (2, 3));
    assert_eq!(
        (fits[0].methods.common().samples, fits[1].methods.common().samples),
        (fits[0].methods.common().samples, "64".parse().unwrap())
    );
    assert_eq!([0, 1].map(|i: usize| fits[i].capture.environment.rotation_deg), [10.0, 10.0]);
    assert_eq!([0, 1].map(|i: usize| fits[i].capture.mask.clone()), [Some(folder.path().join("mask.png")), None]);
    assert_eq!((fits[0].max_cssim, fits[1].max_cssim), (None, Some(0.1)));
    assert_eq!(fits[1].capture.sphere.unwrap().to_string(), "1,2,3");
    assert_eq!((fits[0].line, fits[1].line), (6, 10));
    let fits = of(&["--seed=9", "--model=cook-torrance"]);
    assert_eq!(names(&fits), ["a-m-cook-torrance", "other"]);
    assert!(fits.iter().all(|fit| fit.methods.common().seed == 9));
}

#[test]
fn presets_come_before_everything_else() {
    let text = "photos = ['a.exr', 'b.exr']\nenvironments = 'm.hdr'\n[defaults]\npreset = 'paper'\nsamples = 32\n";
    let fits = fits(text, &[]);
    assert_eq!(names(&fits), ["a-m-cook-torrance", "b-m-cook-torrance"]);
    assert_eq!(
        (fits[1].methods.common().search, fits[1].methods.common().samples),
        (SearchKind::Pattern, "32".parse().unwrap())
    );
}

#[test]
fn name_of_a_set_is_a_prefix_of_the_names_of_its_fits() {
    let text = "[[set]]\nname = 'day'\nphotos = 'a.exr'\nenv = 'm.hdr'\n[[set]]\nname = 'turned'\nphotos = 'a.exr'\n\
                env = 'm.hdr'\nenv-rotation = 90\n";
    assert_eq!(names(&fits(text, &[])), ["day-a-m-auto", "turned-a-m-auto"]);
}

/// What is said of a manifest.
fn refusal(text: &str) -> String {
    let folder = folder(text, &["in/a.exr"]);
    let place = format!("{}/", folder.path().display());
    read_with(&folder, &[]).unwrap_err().to_string().replace(&place, "")
}

#[test]
fn mistakes_are_reported_with_line_and_key() {
    for (text, phrase) in [
        ("", "batch.toml: the manifest has no fit"),
        ("photos = ", "batch.toml:1: "),
        ("\nfotos = 'a.exr'", "batch.toml:2: unknown field `fotos`, expected one of `photos`"),
        ("environments = 'm.hdr'", "batch.toml:1: \"environments\" at the top needs \"photos\" at the top"),
        (
            "models = ['ggx']\n[[set]]\nphotos = 'a.exr'\nenv = 'm.hdr'",
            "batch.toml:1: \"models\" at the top needs \"photos\" at the top; add them, move \"models\" into each [[set]], or give one \
             of them in [defaults] as \"model\"",
        ),
        ("[[set]]\nmodels = 'ggx'", "batch.toml:1: there are no photos"),
        ("photos = []\nenvironments = 'm.hdr'", "batch.toml:1: \"photos\" is an empty list"),
        (
            "photos = ['a.exr', 3]\nenvironments = 'm.hdr'",
            "batch.toml:1: \"photos\" must be a text or a list of texts, found 3",
        ),
        ("photos = 'in/*.png'\nenvironments = 'm.hdr'", "batch.toml:1: no file matches \"in/*.png\""),
        ("photos = 'in/[.png'\nenvironments = 'm.hdr'", "batch.toml:1: the pattern \"in/[.png\" is malformed"),
        ("photos = 'a.exr'", "batch.toml:1: a.exr has no light; give env or environments"),
        (
            "photos = 'a.exr'\nenvironments = 'm.hdr'\nmodels = 'phong'",
            "batch.toml:1: invalid value 'phong' for '--model <NAME[,..]>'",
        ),
        (
            "[defaults]\nsampels = 3\n[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'",
            "batch.toml:2: unknown key \"sampels\"; the nearest one is \"samples\"",
        ),
        ("[defaults]\nphoto = 'a.exr'", "batch.toml:2: a photo belongs to one fit: move it from [defaults]"),
        ("[defaults]\nworkers = 3", "batch.toml:2: \"workers\" is a setting of the whole batch: give it as --workers"),
        ("[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\nout = 'x'", "batch.toml:4: \"out\" is a setting of the whole batch"),
        ("[[fit]]\nenv = 'm.hdr'", "batch.toml:1: this fit has no photo"),
        ("[[fit]]\nphoto = 'a.exr'", "batch.toml:1: a.exr has no light"),
        (
            "[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\ngammas = '3:1:1'",
            "batch.toml:4: invalid value '3:1:1' for '--gammas",
        ),
        (
            "[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\nname = 'a/b'",
            "batch.toml:4: the name \"a/b\" is not a valid folder name on every system",
        ),
        ("[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\nname = 3", "batch.toml:4: \"name\" must be text"),
        (
            "[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\nnormals = 'n.exr'\nsphere = [1,2,3]",
            "batch.toml:1: --sphere places the built-in sphere",
        ),
        ("[[set]]\nphoto = 'a.exr'\nenv = 'm.hdr'", "batch.toml:2: a [[set]] lists its photos under \"photos\""),
        (
            "[[fit]]\nphotos = 'a.exr'\nenv = 'm.hdr'",
            "batch.toml:2: unknown key \"photos\"; the nearest one is \"photo\"",
        ),
        ("photos = ['a.exr', 'in/a.exr']\nenvironments = 'm.hdr'", "two fits are named \"a-m-auto\"; list a file once"),
        (
            "[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\nname = 'x'\n[[fit]]\nphoto = 'b.exr'\nenv = 'm.hdr'\nname = 'X'",
            "batch.toml:5: two fits are named \"X\", the other one on line 1",
        ),
    ] {
        let said = refusal(text);
        assert!(said.contains(phrase), "{text:?}: {said}");
    }
}

#[test]
fn name_that_is_too_long_by_itself_has_a_way_out() {
    let said = refusal(&format!("photos = '{}.exr'\nenvironments = 'm.hdr'", "x".repeat(200)));
    assert!(said.ends_with("; give the fit a name in a [[fit]], or rename the photo"), "{said}");
    assert_eq!(names(&fits("photos = 'run.0001.exr'\nenvironments = 'm.hdr'", &[])), ["run.0001-m-auto"]);
}

#[test]
fn all_mistakes_are_reported_together() {
    let said = refusal(
        "photos = 'in/*.png'\nenvironments = 'm.hdr'\n[defaults]\nsampels = 3\n[[fit]]\nphoto = 'a.exr'\nenv = 'm.hdr'\n\
         seed = 'x'\n[[fit]]\nenv = 'm.hdr'\n",
    );
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines[0], "batch.toml: 4 problems");
    for (line, start) in
        lines[1..].iter().zip(["  batch.toml:4: ", "  batch.toml:1: ", "  batch.toml:8: ", "  batch.toml:9: "])
    {
        assert!(line.starts_with(start), "{said}");
    }
}

#[test]
fn missing_manifest_is_named() {
    let error = read(&PathBuf::from("nowhere.toml"), &[]).unwrap_err();
    assert!(format!("{error:#}").starts_with("cannot read the manifest nowhere.toml"), "{error:#}");
}
