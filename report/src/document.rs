//! The parts of a report, independent of Markdown and HTML.

use super::verdict::Verdict;

/// A numbered section of the report: text, tables and figures for one question.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Section {
    /// Anchor in the page; lower case.
    pub(super) id: &'static str,
    /// The heading.
    pub(super) title: String,
    /// The content below the heading, in order.
    pub(super) blocks: Vec<Block>,
}

/// A paragraph, a table or a figure.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Block {
    /// An explanation.
    Text(String),
    /// A conclusion, with the rule that it follows from.
    Finding(Verdict, String),
    /// The entries that the study needs for this section.
    Missing(String),
    /// Preformatted text.
    Code(String),
    /// Rows and columns.
    Table(Table),
    /// A chart.
    Figure(Figure),
    /// Pictures side by side.
    Strip(Strip),
    /// A CSV without a figure.
    Data(Csv),
}

/// Rows and columns; the first `labels` columns are words, the rest are numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Table {
    /// What it shows, in one sentence.
    pub(super) caption: String,
    /// Headings of the columns.
    pub(super) columns: Vec<String>,
    /// How many columns on the left are words.
    pub(super) labels: usize,
    /// The rows, each as long as `columns`.
    pub(super) rows: Vec<Vec<Entry>>,
    /// Number of rows at the end that are totals.
    pub(super) totals: usize,
}

/// One entry of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Entry {
    /// What it shows.
    pub(super) text: String,
    /// Whether it is the best of its row.
    pub(super) best: bool,
    /// The verdict, if the entry is one.
    pub(super) verdict: Option<Verdict>,
}

/// A chart and the data behind it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Figure {
    /// What it shows, in one sentence.
    pub(super) caption: String,
    /// The drawing.
    pub(super) svg: String,
    /// The data; the drawing's file has the same stem.
    pub(super) csv: Csv,
}

/// A file of values separated by commas.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Csv {
    /// The file's name without its extension.
    pub(super) stem: String,
    /// Its text.
    pub(super) text: String,
}

/// Rows of pictures.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Strip {
    /// What it shows, in one sentence.
    pub(super) caption: String,
    /// One row for each cell.
    pub(super) rows: Vec<StripRow>,
}

/// Pictures of one cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StripRow {
    /// The label of the row.
    pub(super) label: String,
    /// From left to right.
    pub(super) panels: Vec<Panel>,
}

/// A picture and its caption.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Panel {
    /// The line below it.
    pub(super) caption: String,
    /// A second line, of numbers.
    pub(super) note: String,
    /// File name in `pictures/`, if there is a picture.
    pub(super) file: Option<String>,
}

impl Section {
    /// An empty section.
    pub(super) fn new(id: &'static str, title: &str) -> Self {
        Self { id, title: title.to_owned(), blocks: Vec::new() }
    }

    /// A section without data; `needs` are the entries of `STUDY.toml` that it needs.
    pub(super) fn missing(mut self, needs: &str) -> Self {
        self.blocks.push(Block::Missing(format!("Not in this study: STUDY.toml needs {needs}.")));
        self
    }

    /// Adds a paragraph.
    pub(super) fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a conclusion.
    pub(super) fn finding(&mut self, verdict: Verdict, text: impl Into<String>) {
        self.blocks.push(Block::Finding(verdict, text.into()));
    }
}

impl Entry {
    /// A plain text.
    pub(super) fn of(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// The word of a verdict.
    pub(super) fn verdict(verdict: Verdict) -> Self {
        Self { verdict: Some(verdict), ..Self::of(verdict.word()) }
    }
}

impl Table {
    /// An empty table, of which the first `labels` columns are words.
    pub(super) fn new(caption: &str, labels: usize, columns: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { caption: caption.to_owned(), labels, columns, ..Self::default() }
    }

    /// Adds a row of texts.
    pub(super) fn row(&mut self, texts: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(texts.into_iter().map(Entry::of).collect());
    }

    /// Adds a row of labels and scores; the lowest score, as printed, is marked.
    pub(super) fn scores(&mut self, labels: impl IntoIterator<Item = impl Into<String>>, scores: &[Option<f64>]) {
        let printed: Vec<String> = scores.iter().map(|score| super::text::score(*score)).collect();
        let lowest = scores.iter().flatten().copied().filter(|score| score.is_finite()).min_by(f64::total_cmp);
        let lowest = lowest.map(|score| super::text::score(Some(score)));
        let mut row: Vec<Entry> = labels.into_iter().map(Entry::of).collect();
        row.extend(printed.into_iter().map(|text| Entry { best: Some(&text) == lowest.as_ref(), ..Entry::of(text) }));
        self.rows.push(row);
    }

    /// The table as CSV, with numbers in a form for programs.
    pub(super) fn csv(&self, stem: &str) -> Csv {
        let mut csv = CsvText::new(stem, &self.columns);
        for row in &self.rows {
            csv.row(row.iter().map(|entry| super::text::plain(&entry.text)));
        }
        csv.done()
    }
}

/// A CSV being written.
#[derive(Debug)]
pub(super) struct CsvText {
    stem: String,
    text: String,
}

impl CsvText {
    /// A CSV with these column headings.
    pub(super) fn new(stem: &str, columns: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        let mut csv = Self { stem: stem.to_owned(), text: String::new() };
        csv.row(columns);
        csv
    }

    /// Adds a line; fields with a comma, a quote or a line break are quoted.
    pub(super) fn row(&mut self, fields: impl IntoIterator<Item = impl AsRef<str>>) {
        let fields: Vec<String> = fields.into_iter().map(|field| quoted(field.as_ref())).collect();
        self.text.push_str(&fields.join(","));
        self.text.push('\n');
    }

    /// The finished CSV.
    pub(super) fn done(self) -> Csv {
        Csv { stem: self.stem, text: self.text }
    }
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}
