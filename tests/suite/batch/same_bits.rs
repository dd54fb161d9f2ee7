//! A fit in a batch has the same bits as a single fit, wherever its second stage runs and whatever it shares with other fits.

use super::{batch, folder, scene, states, summary};
use crate::program::lookalike;
use std::fs;

const PICTURES: [&str; 5] = ["match.exr", "match.png", "reference.png", "difference.png", "candidates.csv"];

#[test]
fn fits_of_a_batch_equal_single_fits_wherever_they_are_judged() {
    let models = if cfg!(feature = "slow") { "'ggx', 'cook-torrance'" } else { "'ggx'" };
    let folder = folder(&format!(
        "photos = ['photo.exr', 'red.exr']\nenvironments = 'map.exr'\nmodels = [{models}]\n[defaults]\nmodel = 'ggx'\nsamples = 32\ngammas = '1:2:0.5'\n\
         [[fit]]\nname = 'again'\nphoto = 'photo.exr'\nenv = 'map.exr'\njudge = 'object'\n"
    ));
    batch(&folder, "here", "--workers 1").done();
    batch(&folder, "there", "--workers 2 --stage-two workers").done();
    let alone = [
        ("photo-map-ggx", "photo.exr", ""),
        ("red-map-ggx", "red.exr", ""),
        ("again", "photo.exr", "--judge object"),
        ("photo-map-cook-torrance", "photo.exr", "--model cook-torrance"),
        ("red-map-cook-torrance", "red.exr", "--model cook-torrance"),
    ];
    let alone = &alone[..if cfg!(feature = "slow") { 5 } else { 3 }];
    for (name, photo, flags) in alone {
        let quick = "--model ggx --samples 32 --gammas 1:2:0.5 --workers 1 --progress none";
        lookalike(folder.path(), &format!("fit {photo} --env map.exr --out alone/{name} {quick} {flags}")).done();
        let at = |run: &str| folder.path().join(run).join(name);
        for run in ["here", "there"] {
            assert_eq!(scene::without_timing(&at("alone")), scene::without_timing(&at(run)), "{name} {run}");
            for file in PICTURES {
                let [one, same] = ["alone", run].map(|run| fs::read(at(run).join(file)).unwrap());
                assert!(one == same, "{file} of {name} {run}");
            }
        }
    }
    assert_eq!(states(&summary(&folder.path().join("there"))), vec!["done"; alone.len()]);
}
