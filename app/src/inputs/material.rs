//! The material to render: the named parameters of a model, or a measured table.

use super::file::{InputFile, read_with};
use crate::settings::ModelParams;
use lookalike::brdf::{self, Channels, Model, ParameterError, merl::MerlTable};
use std::path::Path;

/// A measured table with its origin.
#[derive(Debug, Clone)]
pub struct LoadedTable {
    /// The BRDF.
    pub table: MerlTable,
    /// The file, with the hash of its bytes.
    pub source: InputFile,
}

/// Reads a table in MERL's file format.
///
/// # Errors
/// If the file cannot be read or is not such a table.
pub fn load_table(path: &Path) -> anyhow::Result<LoadedTable> {
    let table = read_with(path, "measured material", MerlTable::read)?;
    let source = InputFile { path: path.to_owned(), blake3: table.content_hash().to_hex().to_string() };
    Ok(LoadedTable { table, source })
}

/// The flat parameter vector of a model from values by name. Every parameter without a usual value is required; a single value for a
/// colour means grey.
///
/// # Errors
/// [`ParameterError::UnknownParameter`], [`ParameterError::Missing`] and [`ParameterError::Count`]; bounds are checked by the material.
pub fn flat_parameters(model: &'static dyn Model, given: &ModelParams) -> Result<Vec<f64>, ParameterError> {
    for (name, _) in given.entries() {
        brdf::parameter(model, name)?;
    }
    let mut flat = Vec::new();
    for parameter in model.parameters() {
        let example = match parameter.channels {
            Channels::Scalar => "0.1",
            Channels::Rgb => "0.5,0.4,0.3",
        };
        let values = match (given.entries().iter().find(|(name, _)| name == parameter.name), parameter.usual) {
            (Some((_, values)), _) => parameter.entries(values)?,
            (None, Some(usual)) => parameter.entries(&[usual])?,
            (None, None) => return Err(ParameterError::Missing { model: model.name(), name: parameter.name, example }),
        };
        flat.extend(values);
    }
    Ok(flat)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::brdf::Ggx;

    fn flat(text: &str) -> Result<Vec<f64>, String> {
        flat_parameters(&Ggx, &text.parse().unwrap()).map_err(|error| error.to_string())
    }

    #[test]
    fn parameters_by_name_in_any_order_become_the_flat_vector() {
        assert_eq!(flat("alpha=.1,kd=.5,.4,.3,f0=.04").unwrap(), [0.5, 0.4, 0.3, 0.04, 0.04, 0.04, 1.0, 0.1]);
        assert_eq!(flat("alpha=.1,kd=.5,f0=.04,f90=.3").unwrap()[6], 0.3);
    }

    #[test]
    fn wrong_names_and_counts_list_what_is_expected() {
        for (text, phrase) in [
            ("kd=.5,f0=.04", "parameter 'alpha' of model ggx is missing: give alpha=0.1"),
            ("f0=.04,alpha=.1", "give kd=0.5,0.4,0.3"),
            ("kd=.5,f0=.04,roughness=.1", "no parameter 'roughness': it has kd, f0, f90, alpha"),
            ("kd=.5,f0=.04,alpha=.1,.2,.3", "'alpha' takes 1 number(s), found 3"),
        ] {
            let message = flat(text).unwrap_err();
            assert!(message.contains(phrase), "{text}: {message}");
        }
    }
}
