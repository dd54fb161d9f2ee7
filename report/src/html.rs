//! The report as one self-contained HTML file: style, drawings and pictures are embedded.

use super::{
    document::{Block, Entry, Panel, Section, Strip, Table},
    verdict::Verdict,
};
use anyhow::Context;
use base64::{Engine, engine::general_purpose::STANDARD};
use std::{collections::BTreeMap, fs, path::Path};

/// The whole page; pictures are read from `pictures`.
///
/// # Errors
/// If a picture cannot be read.
pub(super) fn page(title: &str, lead: &str, sections: &[Section], pictures: &Path) -> anyhow::Result<String> {
    let mut album = Album { folder: pictures, read: BTreeMap::new() };
    let mut contents = String::new();
    let mut body = String::new();
    for (number, section) in sections.iter().enumerate() {
        let (id, title) = (section.id, escaped(&section.title));
        contents.push_str(&format!("<li><a href=\"#{id}\"><b>{number}</b>{title}</a></li>\n"));
        body.push_str(&format!("<section id=\"{id}\">\n<h2><b>{number}</b>{title}</h2>\n"));
        let mut charts = false;
        for block in &section.blocks {
            // Consecutive charts share the width of the page.
            let chart = matches!(block, Block::Figure(_));
            if chart != charts {
                body.push_str(if chart { "<div class=\"charts\">\n" } else { "</div>\n" });
                charts = chart;
            }
            body.push_str(&block_html(block, &mut album)?);
        }
        body.push_str(if charts { "</div>\n</section>\n" } else { "</section>\n" });
    }
    let title = escaped(title);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<nav aria-label=\"Contents\">\n<ol>\n{contents}</ol>\n</nav>\n<main>\n\
         <h1>{title}</h1>\n<p class=\"lead\">{}</p>\n{body}</main>\n</body>\n</html>\n",
        escaped(lead)
    ))
}

const STYLE: &str = include_str!("style.css");

/// The pictures of the page; each file is read once.
struct Album<'a> {
    folder: &'a Path,
    read: BTreeMap<String, String>,
}

impl Album<'_> {
    fn uri(&mut self, file: &str) -> anyhow::Result<String> {
        if let Some(uri) = self.read.get(file) {
            return Ok(uri.clone());
        }
        let path = self.folder.join(file);
        let bytes = fs::read(&path).with_context(|| format!("cannot read the picture {}", path.display()))?;
        let uri = format!("data:image/png;base64,{}", STANDARD.encode(bytes));
        self.read.insert(file.to_owned(), uri.clone());
        Ok(uri)
    }
}

fn block_html(block: &Block, album: &mut Album<'_>) -> anyhow::Result<String> {
    Ok(match block {
        Block::Text(text) => format!("<p>{}</p>\n", escaped(text)),
        Block::Finding(verdict, text) => {
            let word = verdict.word();
            let class = class(*verdict);
            format!("<p class=\"finding {class}\"><b>{word}</b> {}</p>\n", escaped(text))
        }
        Block::Missing(text) => format!("<p class=\"missing\">{}</p>\n", escaped(text)),
        Block::Code(text) => format!("<pre><code>{}</code></pre>\n", escaped(text.trim_end())),
        Block::Table(table) => table_html(table),
        Block::Figure(figure) => {
            let caption = escaped(&figure.caption);
            let data = data_link(&figure.csv.stem, &figure.csv.text);
            format!("<figure>\n{}<figcaption>{caption} {data}</figcaption>\n</figure>\n", figure.svg)
        }
        Block::Strip(strip) => strip_html(strip, album)?,
        Block::Data(csv) => format!("<p class=\"data\">{}</p>\n", data_link(&csv.stem, &csv.text)),
    })
}

/// A link that contains the data, so that the page stays one file.
fn data_link(stem: &str, text: &str) -> String {
    let encoded = STANDARD.encode(text);
    format!("<a class=\"csv\" download=\"{stem}.csv\" href=\"data:text/csv;base64,{encoded}\">{stem}.csv</a>")
}

fn table_html(table: &Table) -> String {
    let cell = |tag: &str, column: usize, inside: &str| {
        let class = if column < table.labels { " class=\"label\"" } else { "" };
        format!("<{tag}{class}>{inside}</{tag}>")
    };
    let heading: String = table.columns.iter().enumerate().map(|(i, name)| cell("th", i, &escaped(name))).collect();
    // Sentences may wrap, names and numbers do not.
    let shape = match table.columns.len() {
        columns if columns == table.labels => " class=\"prose\"",
        columns if columns > 9 => " class=\"wide\"",
        _ => "",
    };
    let totals = table.rows.len().saturating_sub(table.totals);
    let rows: String = table
        .rows
        .iter()
        .enumerate()
        .map(|(number, row)| {
            let cells: String = row.iter().enumerate().map(|(i, entry)| cell("td", i, &entry_html(entry))).collect();
            let class = if number >= totals { " class=\"total\"" } else { "" };
            format!("<tr{class}>{cells}</tr>\n")
        })
        .collect();
    format!(
        "<div class=\"table\"><table{shape}>\n<caption>{}</caption>\n<thead><tr>{heading}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n",
        escaped(&table.caption)
    )
}

fn entry_html(entry: &Entry) -> String {
    let text = escaped(&entry.text);
    match entry.verdict {
        Some(verdict) => format!("<span class=\"verdict {}\">{text}</span>", class(verdict)),
        None if entry.best => format!("<b>{text}</b>"),
        None => text,
    }
}

/// The CSS class of a verdict, which sets its colour.
fn class(verdict: Verdict) -> String {
    verdict.word().to_lowercase().replace(' ', "-")
}

fn strip_html(strip: &Strip, album: &mut Album<'_>) -> anyhow::Result<String> {
    let mut html = String::from("<figure class=\"strips\">\n");
    for row in &strip.rows {
        html.push_str(&format!("<div class=\"strip\"><h3>{}</h3>\n", escaped(&row.label)));
        for panel in &row.panels {
            html.push_str(&panel_html(panel, album)?);
        }
        html.push_str("</div>\n");
    }
    html.push_str(&format!("<figcaption>{}</figcaption>\n</figure>\n", escaped(&strip.caption)));
    Ok(html)
}

fn panel_html(panel: &Panel, album: &mut Album<'_>) -> anyhow::Result<String> {
    let caption = escaped(&panel.caption);
    let picture = match &panel.file {
        Some(file) => format!("<img src=\"{}\" alt=\"{caption}\">", album.uri(file)?),
        None => "<span class=\"absent\">not in this study</span>".to_owned(),
    };
    let note = if panel.note.is_empty() { String::new() } else { format!("<small>{}</small>", escaped(&panel.note)) };
    Ok(format!("<div class=\"panel\">{picture}<span>{caption}</span>{note}</div>\n"))
}

/// Escapes text, so that no part of it is markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
