//! The material that a rendering shows: a measured table, or a model with its parameters.

use crate::{
    inputs::{InputFile, LoadedTable, flat_parameters, load_table},
    settings,
};
use anyhow::Context;
use lookalike::brdf::{Material, Reflectance, flat_names};

/// A material and its description for metadata.
#[derive(Debug)]
pub(super) struct LoadedMaterial {
    pub(super) reflectance: Box<dyn Reflectance>,
    /// The model's name; `merl` for a measured one.
    pub(super) model: &'static str,
    /// `name=value` pairs of a model.
    pub(super) parameters: Option<String>,
    /// The file of a measured material, with its hash.
    pub(super) file: Option<InputFile>,
}

impl LoadedMaterial {
    pub(super) fn load(material: &settings::Material) -> anyhow::Result<Self> {
        match material {
            settings::Material::Measured(path) => {
                let LoadedTable { table, source } = load_table(path)?;
                Ok(Self { reflectance: Box::new(table), model: "merl", parameters: None, file: Some(source) })
            }
            settings::Material::Analytic { model, params } => {
                let model = model.model();
                let flat = flat_parameters(model, params).context("--params")?;
                let pairs = flat_names(model.parameters()).into_iter().zip(&flat);
                let parameters = pairs.map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(",");
                let reflectance = Box::new(Material::new(model, flat).context("--params")?);
                Ok(Self { reflectance, model: model.name(), parameters: Some(parameters), file: None })
            }
        }
    }
}
