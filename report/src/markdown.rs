//! The report as Markdown, for a repository: figures and pictures are links to files in the same folder.

use super::document::{Block, Entry, Section, Strip, Table};

/// The whole page.
pub(super) fn page(title: &str, lead: &str, sections: &[Section]) -> String {
    let mut page = format!("# {title}\n\n{lead}\n");
    for (number, section) in sections.iter().enumerate() {
        page.push_str(&format!("\n## {number}. {}\n", section.title));
        for block in &section.blocks {
            let text = text_of(block);
            if !text.is_empty() {
                page.push_str(&format!("\n{text}\n"));
            }
        }
    }
    page
}

fn text_of(block: &Block) -> String {
    match block {
        Block::Text(text) => escaped(text),
        Block::Finding(verdict, text) => format!("**{}.** {}", verdict.word(), escaped(text)),
        Block::Missing(text) => format!("*{}*", escaped(text)),
        Block::Code(text) => fenced(text),
        Block::Table(table) => table_of(table),
        Block::Figure(figure) => {
            let (stem, caption) = (&figure.csv.stem, escaped(&figure.caption));
            format!("![{caption}](figures/{stem}.svg)\n\n{caption} Data: [{stem}.csv](figures/{stem}.csv).")
        }
        Block::Strip(strip) => strip_of(strip),
        Block::Data(csv) => format!("Data: [{stem}.csv](figures/{stem}.csv).", stem = csv.stem),
    }
}

fn table_of(table: &Table) -> String {
    let heading = line(table.columns.iter().map(|column| escaped(column)));
    let rule = line((0..table.columns.len()).map(|i| if i < table.labels { "---" } else { "---:" }.to_owned()));
    let rows = table.rows.iter().map(|row| line(row.iter().map(entry)));
    let caption = escaped(&table.caption);
    format!("{caption}\n\n{}", [heading, rule].into_iter().chain(rows).collect::<Vec<_>>().join("\n"))
}

fn entry(entry: &Entry) -> String {
    if entry.best || entry.verdict.is_some() { format!("**{}**", escaped(&entry.text)) } else { escaped(&entry.text) }
}

/// One table for each group of consecutive rows with equal numbers of pictures.
fn strip_of(strip: &Strip) -> String {
    let mut lines = vec![escaped(&strip.caption), String::new()];
    let mut columns = None;
    for row in &strip.rows {
        if columns.is_some_and(|columns| columns != row.panels.len()) {
            lines.push(String::new());
        }
        if columns != Some(row.panels.len()) {
            columns = Some(row.panels.len());
            lines.push(line(std::iter::repeat_n(String::new(), row.panels.len() + 1)));
            lines.push(line(std::iter::repeat_n("---".to_owned(), row.panels.len() + 1)));
        }
        let panels = row.panels.iter().map(|panel| {
            let caption = escaped(&panel.caption);
            let note = if panel.note.is_empty() { String::new() } else { format!("<br>{}", escaped(&panel.note)) };
            match &panel.file {
                Some(file) => format!("![{caption}](pictures/{file})<br>{caption}{note}"),
                None => format!("{caption}: not in this study{note}"),
            }
        });
        lines.push(line(std::iter::once(escaped(&row.label)).chain(panels)));
    }
    lines.join("\n")
}

fn line(entries: impl Iterator<Item = String>) -> String {
    format!("| {} |", entries.collect::<Vec<_>>().join(" | "))
}

/// A preformatted block; its fence has more backticks than any run of backticks in the text.
fn fenced(text: &str) -> String {
    let longest = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest.max(2) + 1);
    format!("{fence}text\n{}\n{fence}", text.trim_end())
}

/// Escapes text, so that no part of it is markup.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '\\' | '`' | '*' | '_' | '[' | ']' | '<' | '>' | '|') {
            escaped.push('\\');
        }
        escaped.push(if c == '\n' { ' ' } else { c });
    }
    escaped
}
