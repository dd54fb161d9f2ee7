//! The written files: pages, figures and data, without values that are not numbers.

use super::{
    super::write,
    synthetic::{MATERIALS, PROBES, empty, pictures, row, whole},
};
use crate::measured::{Method, Row, StudyData};
use std::{collections::BTreeMap, fs, path::Path};

/// Every text file of a report, by its path below the folder.
fn written(data: &StudyData, with_pictures: bool) -> BTreeMap<String, String> {
    let folder = tempfile::tempdir().unwrap();
    if with_pictures {
        pictures(folder.path());
    }
    fs::create_dir_all(folder.path().join("figures")).unwrap();
    write(data, folder.path(), |name, bytes| Ok(fs::write(folder.path().join(name), bytes)?)).unwrap();
    let mut files = BTreeMap::new();
    for place in ["", "figures"] {
        for entry in fs::read_dir(folder.path().join(place)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let name = Path::new(place).join(path.file_name().unwrap()).to_string_lossy().into_owned();
                files.insert(name, fs::read_to_string(path).unwrap());
            }
        }
    }
    // To keep the files and print their folder: LOOKALIKE_KEEP=1 cargo test ... -- --nocapture
    if std::env::var_os("LOOKALIKE_KEEP").is_some() {
        println!("kept in {}", folder.keep().display());
    }
    files
}

#[test]
fn the_same_study_writes_the_same_bytes_and_no_number_is_missing_silently() {
    let mut data = whole();
    data.rows.push(row(Method::Ours, "aluminium", "nowhere", f64::NAN));
    data.rows.push(Row { gamma: Some(f64::NAN), ..row(Method::Candidate, "aluminium", "uffizi", 0.1) });
    data.direct[0].seconds.push(f64::INFINITY);
    let (files, again) = (written(&data, true), written(&data, true));
    assert_eq!(files, again);
    for (name, text) in files.iter().filter(|(name, _)| *name != "data.json") {
        for word in text.split(|c: char| !c.is_ascii_alphanumeric()) {
            assert!(!["NaN", "nan", "inf", "Some", "None"].contains(&word), "{name} holds {word}");
        }
    }
}

#[test]
fn pages_hold_every_section_and_every_link_of_markdown_is_a_file() {
    let files = written(&whole(), false);
    let (page, html) = (&files["results.md"], &files["report.html"]);
    assert_eq!((page.matches("\n## ").count(), html.matches("<section id=").count()), (17, 17));
    for link in page.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(files.contains_key(link), "{link} is not written");
    }
    assert!(page.contains("Pictures: not in this study"), "{page}");
    assert!(!html.contains("<img"));
}

#[test]
fn the_html_page_needs_no_other_file_and_escapes_the_study() {
    let html = &written(&whole(), true)["report.html"];
    assert!(html.contains("size = 128 # &lt;tag&gt; &amp; &quot;quote&quot; | pipe"));
    for link in html.split("src=\"").skip(1).chain(html.split("href=\"").skip(1)) {
        assert!(link.starts_with("data:") || link.starts_with('#'), "{}", &link[..40]);
    }
    assert!(html.matches("data:image/png;base64,").count() > 20);
    // Every element except void ones is closed, as XML requires.
    let xml = html.split_once("<body>").unwrap().1.split_once("</body>").unwrap().0;
    let xml = xml.replace("<img ", "<img/><i ").replace("\"><span>", "\"/><span>");
    let closed = ["section", "figure", "table", "div", "p", "svg", "main", "nav"];
    for tag in closed {
        let open = xml.matches(&format!("<{tag}>")).count() + xml.matches(&format!("<{tag} ")).count();
        assert_eq!(open, xml.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

#[test]
fn figures_are_svg_with_labelled_axes_and_their_data() {
    let files = written(&whole(), false);
    let svgs: Vec<_> = files.iter().filter(|(name, _)| name.ends_with(".svg")).collect();
    assert!(svgs.len() >= 14, "{}", svgs.len());
    for (name, text) in svgs {
        let svg = roxmltree::Document::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let root = svg.root_element();
        assert_eq!((root.tag_name().name(), root.attribute("role")), ("svg", Some("img")));
        let texts: Vec<&str> = svg.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        assert!(texts.len() > 6, "{name}: {texts:?}");
        let labelled = ["CSSIM", "γ", "CPU", "lobe", "diffuse", "rank"];
        assert!(texts.iter().any(|text| labelled.iter().any(|label| text.contains(label))), "{name}: {texts:?}");
        let sizes = svg.descendants().filter_map(|n| n.attribute("font-size")).map(|size| size.parse::<f64>().unwrap());
        sizes.for_each(|size| assert!(size >= 4.0 * 11.9, "{name}: {size}"));
        let csv = &files[&name.replace(".svg", ".csv")];
        assert!(csv.lines().count() > 1, "{name}");
    }
    let csv = &files["figures/fig2-gamma-uffizi.csv"];
    assert_eq!(csv.lines().next(), Some("material,gamma,cssim,cost,evaluations"));
    assert!(csv.contains("\naluminium,1.5,0.055") && csv.contains(",0.015,400\n"), "{csv}");
    assert_eq!(csv.lines().count(), 1 + 3 * 21);
}

#[test]
fn results_have_one_line_for_each_match_with_starts_summed_up() {
    let files = written(&whole(), false);
    let rows: Vec<serde_json::Value> = serde_json::from_str(&files["results.json"]).unwrap();
    assert_eq!(files["results.json"].lines().count(), rows.len() + 2);
    let names: Vec<&String> = rows[0].as_object().unwrap().keys().take(8).collect();
    assert_eq!(names, ["material", "probe", "method", "samples", "size", "cssim", "cpu_seconds", "seed"]);
    let of = |method: &str| rows.iter().filter(|row| row["method"] == method).collect::<Vec<_>>();
    let cells = MATERIALS.len() * PROBES.len();
    for (method, each) in
        [("brute", 1), ("l2", 1), ("paper", 1), ("log", 1), ("cuberoot", 1), ("lowres", 3), ("ours+polish", 3)]
    {
        assert_eq!(of(method).len(), cells * each, "{method}");
    }
    let brute = of("brute")[0];
    assert_eq!((&brute["material"], &brute["samples"]), (&MATERIALS[0].into(), &serde_json::Value::Null));
    assert_eq!((brute["cssim"].as_f64(), brute["cpu_seconds"].as_f64()), (Some(0.041), Some(80.0)));
    assert!(rows.iter().all(|row| !["candidate", "subsets"].iter().any(|method| row["method"] == *method)));
    let data: StudyData = serde_json::from_str(&files["data.json"]).unwrap();
    assert_eq!(data, whole());
}

#[test]
fn an_empty_study_says_what_it_needs() {
    let files = written(&empty(), false);
    let page = &files["results.md"];
    assert!(page.matches("Not in this study: STUDY.toml needs").count() >= 14, "{page}");
    assert_eq!(files["results.json"], "[\n\n]\n");
    assert!(!files.keys().any(|name| name.ends_with(".svg")));
}
