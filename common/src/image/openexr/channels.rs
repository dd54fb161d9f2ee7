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

/// Chooses among the channel names of all parts. The first choice of names, in any part, is preferred to the second.
/// Within a part the unnamed layer comes first, then the named ones in alphabetical order.
///
/// # Errors
/// A description of the expected channels, if the file has none of them.
pub(super) fn select(parts: &[Vec<String>], wanted: Wanted) -> Result<Layer, &'static str> {
    let choices: &[&[&str]] = match wanted {
        Wanted::Colours => &[&["r", "g", "b"], &["y"]],
        Wanted::Mask => &[&["r", "g", "b"], &["y"], &["a"]],
        Wanted::Normals => &[&["x", "y", "z"], &["r", "g", "b"]],
    };
    for names in choices {
        let mut found = parts.iter().enumerate().flat_map(|(part, channels)| {
            layers(channels).into_iter().filter_map(move |(prefix, layer)| Some((layer.choose(part, names)?, prefix)))
        });
        let Some((mut layer, prefix)) = found.next() else { continue };
        let others: Vec<String> = found.map(|(other, prefix)| title(other.part, prefix)).collect();
        let is_main = layer.part == 0 && prefix.is_empty();
        if !is_main && !others.is_empty() {
            let title = title(layer.part, prefix);
            layer.warning = Some(format!("{title} is read; other layers are ignored: {}", others.join(", ")));
        }
        return Ok(layer);
    }
    let single = parts.iter().position(|channels| channels.len() == 1).filter(|_| wanted == Wanted::Mask);
    single.map(|part| Layer { part, colours: vec![0], alpha: None, warning: None }).ok_or(wanted.describe())
}

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

    fn parts(names: &[&[&str]]) -> Vec<Vec<String>> {
        names.iter().map(|part| part.iter().map(|name| (*name).to_owned()).collect()).collect()
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
        assert_eq!(layer.warning.unwrap(), "`beauty` of part 1 is read; other layers are ignored: `sss` of part 1");
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
