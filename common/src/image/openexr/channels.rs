//! The choice of part and channels.

use std::collections::BTreeMap;

/// The kind of image to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// `R G B`, else `Y`.
    Colours,
    /// `R G B`, else `Y`, else `A`, else a single channel.
    Mask,
    /// `X Y Z`, else `R G B`.
    Normals,
}

impl Wanted {
    /// The wanted channels, for error messages.
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::Colours => "channels R, G and B, or Y",
            Self::Mask => "channels R, G and B, or Y, or A, or a single channel",
            Self::Normals => "channels X, Y and Z, or R, G and B",
        }
    }
}

/// The channels to read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Layer {
    pub(super) part: usize,
    /// One (grey) or three channel indices of the part.
    pub(super) colours: Vec<usize>,
    pub(super) alpha: Option<usize>,
    /// The layers that are not read, as a warning.
    pub(super) warning: Option<String>,
}

/// A part of a file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) name: Option<String>,
    pub(super) channels: Vec<String>,
}

/// Chooses among the layers of all parts. The first choice of channels, in any part, is preferred to the second. Within a choice the unnamed layer comes
/// first, then layers that are named like a picture, then others, then those that are named like data; of equal ones the first part, in alphabetical
/// order. `asked` is the name of a layer or of a part, or the last component of one.
///
/// # Errors
/// A description of what was expected, if the file does not have it.
pub(super) fn select(parts: &[Part], wanted: Wanted, asked: Option<&str>) -> Result<Layer, String> {
    let choices: &[&[&str]] = match wanted {
        Wanted::Colours => &[&["r", "g", "b"], &["y"]],
        Wanted::Mask => &[&["r", "g", "b"], &["y"], &["a"]],
        Wanted::Normals => &[&["x", "y", "z"], &["r", "g", "b"]],
    };
    for names in choices {
        let mut found: Vec<(Layer, String)> = Vec::new();
        for (p, part) in parts.iter().enumerate() {
            for (prefix, layer) in layers(&part.channels) {
                let of_part = part.name.as_deref().filter(|_| parts.len() > 1).unwrap_or_default();
                let name = if prefix.is_empty() { of_part } else { prefix };
                let is_asked = asked.is_none_or(|asked| {
                    [prefix, part.name.as_deref().unwrap_or_default()].iter().any(|name| is_called(name, asked))
                });
                found.extend(layer.choose(p, names).filter(|_| is_asked).map(|layer| (layer, name.to_owned())));
            }
        }
        let is_exact = |name: &str| asked.is_some_and(|asked| name.eq_ignore_ascii_case(asked));
        let rank = |name: &str| if wanted == Wanted::Normals { Named::Not } else { Named::of(name) };
        found.sort_by_key(|(_, name)| (!is_exact(name), rank(name)));
        if found.is_empty() {
            continue;
        }
        let (mut layer, name) = found.remove(0);
        let is_alone = found.is_empty() || is_exact(&name);
        let others: Vec<String> = found.iter().map(|(other, name)| title(other.part, name)).collect();
        if Named::of(&name) == Named::LikeData && asked.is_none() && wanted == Wanted::Colours {
            layer.warning =
                Some(format!("{} is read as colours, although it is named like data", title(layer.part, &name)));
        } else if !is_alone && !name.is_empty() {
            let title = title(layer.part, &name);
            layer.warning = Some(format!(
                "{title} is read; other layers are ignored: {}; --layer reads another one of the photo",
                others.join(", ")
            ));
        }
        return Ok(layer);
    }
    if let Some(asked) = asked {
        return Err(format!("a layer `{asked}` with {}", wanted.describe()));
    }
    let single = parts.iter().position(|part| part.channels.len() == 1).filter(|_| wanted == Wanted::Mask);
    let layer = single.map(|part| Layer { part, colours: vec![0], alpha: None, warning: None });
    layer.ok_or_else(|| wanted.describe().to_owned())
}

/// Whether a layer's name, or its last component, is this one.
fn is_called(name: &str, asked: &str) -> bool {
    let last = name.rsplit('.').next().unwrap_or_default();
    name.eq_ignore_ascii_case(asked) || last.eq_ignore_ascii_case(asked)
}

/// What the name of a layer says, by the conventions of renderers; preferred ones first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Named {
    Not,
    LikeAPicture,
    LikeAnything,
    LikeData,
}

impl Named {
    fn of(name: &str) -> Self {
        let last = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        let is_data =
            DATA.iter().any(|start| last.starts_with(start)) || ["n", "p", "z", "uv", "st", "id"].contains(&&*last);
        match &*last {
            "" => Self::Not,
            "combined" | "beauty" | "rgba" | "rgb" | "c" | "color" | "colour" | "composite" => Self::LikeAPicture,
            _ if is_data => Self::LikeData,
            _ => Self::LikeAnything,
        }
    }
}

/// The starts of names of layers that do not hold a picture.
const DATA: [&str; 11] =
    ["crypto", "depth", "normal", "position", "pworld", "nworld", "motion", "vector", "velocity", "objectid", "mist"];

fn title(part: usize, prefix: &str) -> String {
    if prefix.is_empty() { format!("part {part}") } else { format!("`{prefix}` of part {part}") }
}

/// Channel indices of one layer by the last, lower-cased component of their names.
#[derive(Debug, Default)]
struct Names(BTreeMap<String, usize>);

/// The layers of a part: `diffuse.R` is channel `r` of layer `diffuse`; the unnamed layer comes first.
fn layers(channels: &[String]) -> BTreeMap<&str, Names> {
    let mut layers: BTreeMap<&str, Names> = BTreeMap::new();
    for (index, channel) in channels.iter().enumerate() {
        let (prefix, name) = channel.rsplit_once('.').unwrap_or(("", channel));
        let short = match name.to_ascii_lowercase().as_str() {
            "red" => "r".to_owned(),
            "green" => "g".to_owned(),
            "blue" => "b".to_owned(),
            "alpha" => "a".to_owned(),
            other => other.to_owned(),
        };
        layers.entry(prefix).or_default().0.entry(short).or_insert(index);
    }
    layers
}

impl Names {
    fn choose(&self, part: usize, names: &[&str]) -> Option<Layer> {
        // A `Y` beside other axes or chroma channels is not grey.
        if names == ["y"] && ["x", "z", "ry", "by"].iter().any(|other| self.0.contains_key(*other)) {
            return None;
        }
        let colours: Option<Vec<usize>> = names.iter().map(|name| self.0.get(*name).copied()).collect();
        let alpha = self.0.get("a").copied().filter(|_| names != ["a"]);
        Some(Layer { part, colours: colours?, alpha, warning: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(names: &[&[&str]]) -> Vec<Part> {
        let part = |channels: &&[&str]| Part {
            name: None,
            channels: channels.iter().map(|name| (*name).to_owned()).collect(),
        };
        names.iter().map(part).collect()
    }

    fn select(parts: &[Part], wanted: Wanted) -> Result<Layer, String> {
        super::select(parts, wanted, None)
    }

    #[test]
    fn the_unnamed_layer_is_preferred() {
        let layer = select(
            &parts(&[&["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "diffuse.B", "diffuse.G", "diffuse.R"]]),
            Wanted::Colours,
        )
        .unwrap();
        assert_eq!(layer, Layer { part: 0, colours: vec![6, 2, 1], alpha: Some(0), warning: None });
    }

    #[test]
    fn a_named_layer_of_a_later_part_is_found_and_reported() {
        let file = parts(&[&["Z"], &["beauty.B", "beauty.G", "beauty.R", "sss.B", "sss.G", "sss.R"]]);
        let layer = select(&file, Wanted::Colours).unwrap();
        assert_eq!((layer.part, layer.colours), (1, vec![2, 1, 0]));
        assert_eq!(
            layer.warning.unwrap(),
            "`beauty` of part 1 is read; other layers are ignored: `sss` of part 1; --layer reads another one of the photo"
        );
    }

    /// Blender writes the first, renderers of films the second.
    #[test]
    fn picture_is_preferred_to_data_and_a_layer_can_be_asked_for() {
        let rgb = |prefix: &str| ["B", "G", "R"].map(|channel| format!("{prefix}.{channel}")).to_vec();
        let channels =
            [rgb("View.Combined"), rgb("View.CryptoObject00"), rgb("View.Diffuse"), rgb("View.Normal")].concat();
        let blender = [Part { name: None, channels }];
        let of = |asked| super::select(&blender, Wanted::Colours, asked).map(|layer| layer.colours[0]);
        assert_eq!((of(None), of(Some("diffuse")), of(Some("View.Normal"))), (Ok(2), Ok(8), Ok(11)));
        assert!(of(Some("specular")).unwrap_err().contains("a layer `specular` with channels R, G and B"));
        let part =
            |name: &str| Part { name: Some(name.to_owned()), channels: ["B", "G", "R"].map(str::to_owned).to_vec() };
        let parts = [part("cryptomatte"), part("depth"), part("beauty"), part("albedo")];
        assert_eq!(select(&parts, Wanted::Colours).unwrap().part, 2);
        assert_eq!(super::select(&parts, Wanted::Colours, Some("albedo")).unwrap().part, 3);
        let warning = select(&parts[..2], Wanted::Colours).unwrap().warning.unwrap();
        assert!(warning.contains("named like data"), "{warning}");
    }

    #[test]
    fn normals_are_not_read_as_grey_nor_depth_as_colour() {
        assert!(select(&parts(&[&["N.X", "N.Y", "N.Z"], &["Z"]]), Wanted::Colours).is_err());
        assert_eq!(select(&parts(&[&["N.X", "N.Y", "N.Z"]]), Wanted::Normals).unwrap().colours, [0, 1, 2]);
        assert_eq!(select(&parts(&[&["A", "Y"]]), Wanted::Colours).unwrap().alpha, Some(0));
        assert!(select(&parts(&[&["BY", "RY", "Y"]]), Wanted::Colours).is_err());
    }

    #[test]
    fn a_mask_may_be_alpha_or_any_single_channel() {
        assert_eq!(select(&parts(&[&["A", "Z"]]), Wanted::Mask).unwrap().colours, [0]);
        assert_eq!(select(&parts(&[&["coverage"]]), Wanted::Mask).unwrap().colours, [0]);
        assert!(select(&parts(&[&["u", "v"]]), Wanted::Mask).is_err());
    }
}
