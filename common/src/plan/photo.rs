//! The plan of a study's photo: one rendering by the direct integrator.

use super::{encode::encode, verify::wrong as wrong_output};
use crate::{
    graph::{Blob, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError, Planner},
    image::Image,
    nodes::{self, wire::read},
    scene::GeometrySpec,
};

/// The material in a photo of a study.
#[derive(Debug, Clone)]
pub enum Subject {
    /// A measured material: its file in MERL's format.
    Measured(Blob),
    /// A model's name and flat parameters.
    Model(String, Vec<f64>),
}

/// The planner of one rendering by the direct integrator.
#[derive(Debug)]
pub struct PhotoPlanner {
    light: Blob,
    subject: Subject,
    geometry: GeometrySpec,
    samples: u32,
    seed: u64,
    photo: Option<(Image, Option<f64>)>,
}

impl PhotoPlanner {
    /// Plans a rendering of a sphere under an [encoded light](super::encode_light), with this number of samples per pixel.
    #[must_use]
    pub fn new(light: Blob, subject: Subject, geometry: GeometrySpec, samples: u32, seed: u64) -> Self {
        Self { light, subject, geometry, samples, seed, photo: None }
    }

    /// The image, linear Rec. 709 over black, and the standard error of a typical pixel relative to its own luminance.
    #[must_use]
    pub fn into_photo(self) -> Option<(Image, Option<f64>)> {
        self.photo
    }
}

impl Planner for PhotoPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let mut inputs = vec![Input::Blob(graph.keep(self.light.clone())?)];
        let (material, what) = match &self.subject {
            Subject::Measured(file) => {
                inputs.push(Input::Blob(graph.keep(file.clone())?));
                (None, "a measured material".to_owned())
            }
            Subject::Model(model, flat) => (Some((model.clone(), flat.clone())), model.clone()),
        };
        let (samples, seed, geometry) = (self.samples, self.seed, self.geometry);
        let parameters = nodes::RenderParameters { geometry, samples, seed, material };
        graph.add_node(NodeSpec {
            kind: nodes::RENDER.to_owned(),
            label: format!("render {what}").into(),
            parameters: encode("parameters", &parameters)?,
            inputs,
            placement: Placement::Worker,
            priority: 0,
        })?;
        Ok(())
    }

    fn completed(&mut self, _node: NodeId, output: &Blob, _graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let wrong = |failure: &dyn std::fmt::Display| wrong_output("a rendering", failure);
        let rendered: nodes::RenderedWire = read("rendering", output).map_err(|failure| wrong(&failure))?;
        let image = rendered.image.image().map_err(|failure| wrong(&failure))?;
        let expected = (self.geometry.width as usize, self.geometry.height as usize);
        let found = (image.width(), image.height());
        if expected != found {
            return Err(wrong(&format!("{found:?} instead of {expected:?} pixels")));
        }
        if let Some(value) = image.pixels().iter().flatten().find(|value| !value.is_finite()) {
            return Err(wrong(value));
        }
        self.photo = Some((image, rendered.noise));
        Ok(())
    }
}
