//! `lookalike render`: a sphere, or a map of normals, of one material under one light, by the direct integrator.

mod encode;
mod material;

use super::output::{check_writable, write_file};
use crate::{
    exit::Exit,
    inputs::{LoadedEnvironment, LoadedGeometry, load_environment, load_normals, show_warnings, sphere_geometry},
    progress::Activity,
    settings::RenderSettings,
    wrap::wrap,
};
use anyhow::Context;
use encode::{Format, Subject};
use indicatif::{ProgressBar, ProgressStyle};
use lookalike::{
    light::LightDistribution,
    math::Rgb,
    render::image::{Noise, Rendering, Shot},
    scene::Circle,
};
use material::LoadedMaterial;
use std::process::ExitCode;

/// Renders a material.
pub(crate) fn run(settings: RenderSettings) -> anyhow::Result<ExitCode> {
    let format = Format::of(&settings.out)?;
    let samples = u32::try_from(settings.samples.get())
        .with_context(|| format!("--samples must be at most {}, found {}", u32::MAX, settings.samples))?;
    check_writable(&settings.out, &settings.files())?;
    let activity = Activity::new(|| "reading the inputs".to_owned());
    let material = LoadedMaterial::load(&settings.material)?;
    let shape = shape(&settings)?;
    let light = load_environment(&settings.environment)?;
    show_warnings(&[&light.warnings[..], &shape.warnings].concat());

    let distribution = LightDistribution::new(light.environment.clone());
    drop(activity);
    let shot = Shot {
        geometry: &shape.geometry,
        light: &distribution,
        reflectance: material.reflectance.as_ref(),
        samples,
        seed: settings.seed,
    };
    let rendering = with_progress(&shot);
    let subject = Subject { settings: &settings, material: &material, shape: &shape, light: &light };
    let file = subject.encode(format, &rendering)?;
    write_file(&settings.out, &file.bytes)?;
    tell(&settings, &light, &rendering, file.exposure);
    Ok(Exit::Done.into())
}

fn shape(settings: &RenderSettings) -> anyhow::Result<LoadedGeometry> {
    match &settings.view.normals {
        Some(path) => load_normals(path, settings.view.camera),
        None => {
            let size = settings.size_px.get();
            if size > LARGEST_PX {
                anyhow::bail!("--size must be at most {LARGEST_PX} pixels, found {size}");
            }
            let geometry = sphere_geometry(size, size, Circle::inscribed(size, size), &settings.view);
            let geometry = geometry.context("cannot place the sphere in the image")?;
            Ok(LoadedGeometry { geometry, normals: None, warnings: Vec::new() })
        }
    }
}

/// Renders with a progress bar of rows on stderr, or with lines where no bar can be drawn.
fn with_progress(shot: &Shot<'_>) -> Rendering {
    let rows = ProgressBar::new(shot.geometry.height() as u64);
    if let Ok(style) = ProgressStyle::with_template("rendering {wide_bar} {pos}/{len} rows, {eta} left") {
        rows.set_style(style);
    }
    let _activity = rows.is_hidden().then(|| {
        let (rows, height) = (rows.clone(), shot.geometry.height());
        Activity::new(move || format!("rendering: {} of {height} rows", rows.position()))
    });
    let rendering = shot.render(|| rows.inc(1));
    rows.finish_and_clear();
    rendering
}

/// Prints a summary of the rendering on stderr.
fn tell(settings: &RenderSettings, light: &LoadedEnvironment, rendering: &Rendering, exposure: Option<f64>) {
    let Rgb { x: r, y: g, z: b } = rendering.mean_radiance;
    eprintln!("light: {} ({})", light.source.path.display(), light.mapping);
    eprintln!("mean radiance over the object: {r:.5} {g:.5} {b:.5} (linear Rec. 709)");
    match rendering.noise {
        Some(Noise { typical, rms }) => {
            let noise = format!(
                "noise: {:.2} % of its luminance for a typical pixel, {:.2} % of the mean radiance by root mean square \
                 (standard errors, from two independent halves of {} samples)",
                100.0 * typical,
                100.0 * rms,
                settings.samples
            );
            eprintln!("{}", wrap(&noise));
        }
        None => eprintln!("noise: not estimated (needs two samples per pixel and some light)"),
    }
    if let Some(exposure) = exposure {
        let exposure = format!(
            "display exposure: {exposure} (auto: the 97th percentile of the object's largest channel becomes 0.9), clipped, sRGB"
        );
        eprintln!("{}", wrap(&exposure));
    }
    eprintln!("wrote {}", settings.out.display());
}

/// The largest width or height that the image writers and readers support.
const LARGEST_PX: usize = 1 << 14;
