//! The pictures of a study: as a display shows them, for the report; linear ones of the main methods, for other metrics.

use super::{
    cells::{Cell, Scene, Task},
    inputs::{Inputs, geometry},
    planner::Outcome,
    record::{write_image, write_picture},
};
use lookalike::image::Image;
use lookalike_report::measured::Method as MethodName;

/// Writes the pictures of a cell. `exposure` is that of the scene's photo.
pub(super) fn write(
    inputs: &Inputs,
    cell: &Cell,
    outcome: &Outcome,
    exposure: impl Fn(Scene) -> f64,
) -> anyhow::Result<()> {
    let exposure = match outcome {
        Outcome::Photo(image, _) => own_exposure(image, cell.scene.size)?,
        _ => exposure(cell.scene),
    };
    let base = base(inputs, cell.scene);
    let picture = |what: &str, image: &Image| write_picture(&inputs.out, &format!("{base}-{what}"), image, exposure);
    let linear = |what: &str, image: &Image| write_image(&inputs.out, &format!("{base}-{what}"), image);
    match (&cell.task, outcome) {
        (Task::Photo, Outcome::Photo(image, _)) => picture("photo", image),
        (Task::Fit(task), Outcome::Fit(fit)) => {
            let Some(what) = task.pictures else { return Ok(()) };
            picture(what, &fit.winner_image)?;
            if task.name != MethodName::Ours || fit.polished.is_none() {
                return Ok(());
            }
            picture("ours+polish", &fit.matched)?;
            linear("ours+polish", &fit.matched)?;
            for (gamma, image) in &fit.extra {
                let what = if *gamma == 1.0 { "l2" } else { "cuberoot" };
                picture(what, image)?;
                linear(what, image)?;
            }
            Ok(())
        }
        (Task::Brute { direct: None, .. }, Outcome::Survey(survey)) => {
            let Some(image) = survey.images.last() else { return Ok(()) };
            picture("brute", image)?;
            linear("brute", image)
        }
        (Task::Appraise { of, .. }, Outcome::Survey(survey)) => {
            let Some(from) = of.first().map(|(from, _)| &inputs.cells[*from]) else { return Ok(()) };
            if matches!(from.task, Task::LowRes) {
                let Some(image) = survey.images.first() else { return Ok(()) };
                return picture(&format!("lowres{}", from.scene.size), image);
            }
            let name = |what: &str| format!("{}-{what}", held_out_base(inputs, from.scene, cell.scene));
            for (what, image) in ["ours+polish", "l2"].iter().zip(&survey.images) {
                write_picture(&inputs.out, &name(what), image, exposure)?;
            }
            let photo = super::record::read_image(&inputs.out, &format!("{base}-photo"))?;
            photo.map_or(Ok(()), |photo| write_picture(&inputs.out, &name("photo"), &photo, exposure))
        }
        _ => Ok(()),
    }
}

/// A scene's part of file names.
pub(super) fn base(inputs: &Inputs, scene: Scene) -> String {
    let (material, light) = (&inputs.study.materials[scene.material].0, &inputs.study.lights[scene.light].0);
    format!("{material}-{light}-{}", scene.size)
}

/// The file name of a match under another light.
fn held_out_base(inputs: &Inputs, fitted: Scene, shown: Scene) -> String {
    let material = &inputs.study.materials[fitted.material].0;
    let (light, at) = (&inputs.study.lights[fitted.light].0, &inputs.study.lights[shown.light].0);
    format!("{material}-{light}-at-{at}-{}", shown.size)
}

/// The exposure for a photo that has no capture yet.
fn own_exposure(photo: &Image, size: u32) -> anyhow::Result<f64> {
    let geometry = geometry(size)?;
    let (width, height) = (photo.width(), photo.height());
    let coverage: Vec<f32> = (0..width * height).map(|i| geometry.coverage(i % width, i / width)).collect();
    Ok(lookalike::metric::auto_exposure(photo, &coverage)?)
}
