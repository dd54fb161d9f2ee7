//! References by the direct integrator, stored in `references.json` because integration takes minutes.
//!
//! `LOOKALIKE_BLESS=1 cargo test --release --features slow -p lookalike-tests --test suite physics::stored` writes the file again. Review
//! the difference: references change only with a scene, a lobe or the integrator. The `level` of each, to which errors are compared,
//! comes from a coarse table, so it also changes with the tables, by a few percent at most.

use super::Case;
use lookalike_tests::scene::{agreement::References, reference::Reference};
use serde_json::Value;
use std::sync::OnceLock;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/suite/physics/references.json");

impl Case {
    /// The stored references of every lobe.
    pub(super) fn stored(&self) -> Vec<References> {
        let (pixels, stored) = (self.pixels(), stored(self.name));
        assert_eq!(stored["pixels"], serde_json::json!(pixels), "the stored references are of other pixels");
        let of_model = |(model, lobes): (_, Vec<&str>)| {
            References::from_json(model, &pixels, stored, |name| lobes.contains(&name))
        };
        self.lobes().into_iter().map(of_model).collect()
    }
}

/// The stored references of the pixels at the silhouette, by material.
pub(super) fn silhouette(material: &str) -> Reference {
    Reference::from_json(&stored("silhouette")[material])
}

fn stored(name: &str) -> &'static Value {
    static STORED: OnceLock<Value> = OnceLock::new();
    &STORED.get_or_init(|| serde_json::from_str(&std::fs::read_to_string(FILE).unwrap()).unwrap())[name]
}

#[cfg(feature = "slow")]
#[test]
fn stored_references_match_the_integrator() {
    use super::tables::{MATERIALS, PERSPECTIVE, ROOM, SUN, Silhouette};
    use serde_json::{Map, json};

    let provenance = "means and variances of the direct integrator, written by physics::stored with LOOKALIKE_BLESS=1";
    let mut sections = vec![format!("\"provenance\": {}", json!(provenance))];
    for comparison in [&ROOM, &SUN, &PERSPECTIVE] {
        let case = (comparison.build)(comparison.stored, super::THOROUGH);
        let mut entries = Map::from_iter([("pixels".to_owned(), json!(case.pixels()))]);
        entries.extend(case.integrate().iter().flat_map(References::to_json));
        sections.push(section(case.name, &entries));
    }
    let silhouette = Silhouette::new(Silhouette::STORED);
    let of_material = |(name, parameters): &(&str, [f64; 8])| {
        let reference = silhouette.integrate(parameters);
        ((*name).to_owned(), reference.to_json())
    };
    sections.push(section("silhouette", &MATERIALS.iter().map(of_material).collect()));
    let text = format!("{{\n{}\n}}\n", sections.join(",\n"));
    if std::env::var_os("LOOKALIKE_BLESS").is_some() {
        std::fs::write(FILE, &text).unwrap();
    }
    assert!(text.len() < 100_000, "{} bytes", text.len());
    let stored = std::fs::read_to_string(FILE).unwrap();
    assert!(text == stored, "the integrator gives other values: see LOOKALIKE_BLESS in this file");
}

/// A section of the file, with one line for each entry.
#[cfg(feature = "slow")]
fn section(name: &str, entries: &serde_json::Map<String, Value>) -> String {
    let lines: Vec<String> = entries.iter().map(|(key, value)| format!("{key:?}: {value}")).collect();
    format!("{name:?}: {{\n{}\n}}", lines.join(",\n"))
}
