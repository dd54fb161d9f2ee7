//! No file of the user's is replaced: every command that writes to a folder refuses before any work.

use crate::{
    fit::scene::{QUICK, folder},
    program::{image, lookalike, write_png},
};
use std::fs;

#[test]
fn every_command_refuses_to_replace_a_file_and_leaves_it_unchanged() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("batch.toml"), "photos = ['photo.exr']\nenvironments = 'map.exr'\n").unwrap();
    for (name, command) in [
        ("candidates.csv", format!("fit photo.exr --env map.exr {QUICK}")),
        ("reference.png", format!("fit photo.exr --env map.exr {QUICK} --resume")),
        ("summary.csv", "batch batch.toml --progress none".to_owned()),
        ("photo-map-auto/match.png", "batch batch.toml --progress none --resume".to_owned()),
        ("strip.png", "demo --progress none".to_owned()),
    ] {
        let file = at("out").join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, "mine").unwrap();
        lookalike(folder.path(), &format!("{command} --out out")).refused(&[name.rsplit('/').next().unwrap(), "--out"]);
        assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
        assert!(!at("out/run.sqlite").exists(), "{name} was refused after work had begun");
        fs::remove_dir_all(at("out")).unwrap();
    }
}

#[test]
fn demo_refuses_to_replace_a_fit_and_a_fit_its_own_photo() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("own")).unwrap();
    fs::write(at("own/fit.json"), r#"{ "inputs": { "photo": { "path": "photo.exr" } } }"#).unwrap();
    fs::copy(at("photo.exr"), at("own/match.exr")).unwrap();
    let photo = fs::read(at("photo.exr")).unwrap();
    lookalike(folder.path(), "demo -o own --progress none")
        .refused(&["own holds files that are not from a demo (fit.json)"]);
    for flags in ["", "--resume", "--force"] {
        lookalike(folder.path(), &format!("fit own/match.exr --env map.exr --out own {QUICK} {flags}"))
            .refused(&["own/match.exr is an input of this run", "choose another --out"]);
    }
    assert!(fs::read(at("own/match.exr")).unwrap() == photo && at("own/fit.json").exists());
}

#[test]
fn render_and_compare_replace_no_input_and_follow_no_link() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    let grey = image(40, 36, |_, _| [0.5; 3]);
    for name in ["a.png", "b.png", "kept.png", "precious.png"] {
        write_png(&at(name), &grey);
    }
    std::os::unix::fs::symlink(at("precious.png"), at("link.png")).unwrap();
    fs::write(at("other.png.partial"), "mine").unwrap();
    let old = |name: &str| fs::read(at(name)).unwrap();
    let before = ["a.png", "b.png", "map.exr", "precious.png", "other.png.partial"].map(old);
    let render = "render --model ggx --params kd=.5,f0=0,alpha=.3 --env map.exr --size 16 --samples 16 -o";
    for (line, phrases) in [
        (format!("{render} map.exr"), ["cannot write map.exr", "it is the input map.exr"]),
        (format!("{render} sub/../map.exr"), ["cannot write sub/../map.exr", "it is the input map.exr"]),
        (format!("{render} link.png"), ["cannot write link.png", "symbolic link"]),
        (format!("{render} other.png"), ["cannot write other.png", "other.png.partial would be replaced"]),
        ("compare a.png b.png --map a.png".to_owned(), ["cannot write a.png", "it is the input a.png"]),
        ("compare a.png b.png --map ./b.png".to_owned(), ["cannot write ./b.png", "it is the input b.png"]),
        ("compare a.png b.png --mask kept.png --map kept.png".to_owned(), ["cannot write", "the input kept.png"]),
        ("compare a.png b.png --map link.png".to_owned(), ["cannot write link.png", "symbolic link"]),
    ] {
        lookalike(folder.path(), &line).refused(&phrases);
    }
    assert!(before == ["a.png", "b.png", "map.exr", "precious.png", "other.png.partial"].map(old));
    let mut protected = fs::metadata(at("kept.png")).unwrap().permissions();
    protected.set_readonly(true);
    fs::set_permissions(at("kept.png"), protected).unwrap();
    lookalike(folder.path(), "compare a.png b.png --map kept.png")
        .refused(&["cannot write kept.png", "write-protected"]);
    fs::remove_file(at("kept.png")).unwrap();
    write_png(&at("kept.png"), &grey);
    // Another old file is replaced.
    lookalike(folder.path(), "compare a.png b.png --map kept.png").done();
    assert!(old("kept.png") != before[0] && !at("kept.png.partial").exists());
}

#[test]
fn force_replaces_a_finished_fit_and_its_journal() {
    let folder = folder();
    let out = folder.path().join("out");
    let line = format!("fit photo.exr --env map.exr --out out {QUICK} --polish off");
    lookalike(folder.path(), &line).done();
    fs::write(out.join("match.png"), "mine").unwrap();
    lookalike(folder.path(), &format!("{line} --seed 1")).refused(&["out already holds a finished fit", "--force"]);
    lookalike(folder.path(), &format!("{line} --seed 1 --force")).done();
    assert!(fs::read_to_string(out.join("fit.json")).unwrap().contains("\"seed\": 1,"));
    lookalike(folder.path(), &format!("{line} --seed 1 --resume")).done();
}
