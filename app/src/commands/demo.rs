//! `lookalike demo`: fits a scene that the program generates itself.

use crate::{
    demo::{environment, material, photo},
    fit::{self, FitJob},
    outputs::{Claim, ClaimedFolder, FIT_FILES, OutFolder, Panel, Pictures, print_result, strip},
    progress::print_line,
    settings::{ClusterSettings, DemoSettings},
};
use anyhow::Context;
use lookalike::{
    fit::Methods,
    image::{Image, content_hash, openexr, png},
    light::Environment,
    metric::auto_exposure,
    plan::FitOutcome,
    scene::{Camera, Capture, CaptureInput, Circle, Geometry},
};
use serde_json::{Value, json};
use std::{process::ExitCode, sync::Arc, time::Instant};

/// Columns and rows of the photo.
const SIZE: usize = 192;
/// Rows of the environment map.
const MAP_ROWS: usize = 256;
/// The files that the demo writes in addition to those of its fit.
const FILES: [&str; 4] = ["photo.exr", "environment.exr", "environment.png", "strip.png"];
/// The gammas whose candidates the strip shows in addition to the winner.
const SHOWN: [f64; 3] = [1.0, 2.0, 3.0];

pub(crate) fn run(settings: DemoSettings) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    let files = FIT_FILES.into_iter().chain(FILES).collect();
    let out =
        ClaimedFolder::take(&Claim { command: "demo", files, ..Claim::of_fit(&settings.out, settings.old_files) })?
            .begin()?;
    print_line("making a photo of a pearl paint under lacquer, in a pavilion with four windows");
    let map = environment::lat_long(MAP_ROWS);
    let light = Arc::new(Environment::new(map.clone()).context("the demo's light")?);
    let geometry = Geometry::sphere(SIZE, SIZE, Circle::inscribed(SIZE, SIZE), Camera::Orthographic)
        .context("the demo's sphere")?;
    let photo = photo::take(&geometry, &light);
    write_scene(&out, &photo, &map)?;
    let inputs = json!({ "photo": generated("photo.exr", &photo), "environment": generated("environment.exr", &map) });
    let input = CaptureInput { photo, clipped: None, mask: None, geometry, environment: light };
    let capture = Arc::new(Capture::new(input).context("the demo's photo")?);
    let exposure = auto_exposure(capture.photo(), &capture.scoring_coverage()).context("the demo's photo")?;
    let out_name = settings.out.display().to_string();
    let job = FitJob {
        capture: Arc::clone(&capture),
        methods: Methods::default(),
        exposure,
        inputs,
        cluster: ClusterSettings { workers: settings.workers, log: settings.log, ..ClusterSettings::default() },
        progress: settings.progress,
        metrics: None,
        out: out.clone(),
        out_name: out_name.clone(),
        max_cssim: None,
        also_render: SHOWN.to_vec(),
        resume: false,
        input_seconds: began.elapsed().as_secs_f64(),
    };
    let finished = fit::run(job)?.context("the demo's run was finished before it began; please report this")?;
    let picture = picture(&finished.outcome, &finished.pictures);
    out.write("strip.png", &png::write(&picture, &[]).context("strip.png")?)?;
    print_result(&format!(
        "\nlook at {out_name}/strip.png; the same fit from its files:\n  \
         lookalike fit {out_name}/photo.exr --env {out_name}/environment.exr --out again\n"
    ))
    .context("cannot write to stdout")?;
    Ok(finished.code)
}

/// A generated input, as `fit.json` describes it.
fn generated(path: &str, image: &Image) -> Value {
    json!({ "path": path, "blake3": content_hash(image).to_hex().to_string(), "generated": true })
}

fn write_scene(out: &OutFolder, photo: &Image, map: &Image) -> anyhow::Result<()> {
    let about = [("comments".to_owned(), format!("made by lookalike demo; {}", material::DESCRIPTION))];
    out.write("photo.exr", &openexr::write(photo, None, &about).context("photo.exr")?)?;
    out.write("environment.exr", &openexr::write(map, None, &about).context("environment.exr")?)?;
    out.write("environment.png", &png::write(map, &about).context("environment.png")?)
}

/// The strip: photo, candidates of a few gammas, winner, polished match, difference.
fn picture(outcome: &FitOutcome, pictures: &Pictures) -> Image {
    let winner = &outcome.judged[outcome.winner];
    let scored = |title: String, object: f64, image: f64| {
        [title, format!("object CSSIM {object:.4}"), format!("image CSSIM {image:.4}")]
    };
    let reference = ["photo".to_owned(), "measured-like noise".to_owned(), String::new()];
    let mut panels: Vec<(Image, [String; 3])> = vec![(pictures.displayed(&pictures.reference), reference)];
    for (gamma, image) in outcome.extra.iter().filter(|(gamma, _)| SHOWN.contains(gamma)) {
        let title = if *gamma == 1.0 { "gamma 1 (L2)".to_owned() } else { format!("gamma {gamma}") };
        let found = outcome.judged.iter().find(|j| j.candidate.gamma == *gamma);
        let (object, whole) = found.map_or((f64::NAN, f64::NAN), |j| (j.cssim_object, j.cssim));
        panels.push((pictures.displayed(image), scored(title, object, whole)));
    }
    let won = scored(format!("winner: gamma {}", winner.candidate.gamma), winner.cssim_object, winner.cssim);
    panels.push((pictures.displayed(&outcome.winner_image), won));
    if let Some(polished) = &outcome.polished {
        let label = scored("polished".to_owned(), polished.cssim_object, polished.cssim);
        panels.push((pictures.displayed(&pictures.matched), label));
    }
    let label = ["difference".to_owned(), format!("yellow: {} and up", pictures.difference_scale), String::new()];
    panels.push((pictures.difference.clone(), label));
    let panels: Vec<Panel<'_>> = panels.iter().map(|(image, label)| Panel { image, label: label.clone() }).collect();
    strip(&panels)
}
