//! Every method in every cell of the grid.

use crate::{
    document::{Block, Entry, Section, Table},
    measured::Method,
    statistics::mean,
    study::{Pick, Study},
    text,
    verdict::Verdict,
};
use std::collections::BTreeSet;

/// A column: a method, and the size at which it searched if that is not the grid's.
type Column = (Method, Option<u32>);

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("cells", "Every method in every cell");
    let cells = study.cells();
    if cells.is_empty() {
        return Ok(section.missing("the experiment \"methods\", at least one material and one probe"));
    }
    let columns = columns(study, &cells);
    let scores: Vec<Vec<Option<f64>>> =
        cells.iter().map(|cell| columns.iter().map(|column| score(study, *cell, *column)).collect()).collect();
    let headings = ["material", "light"].into_iter().map(str::to_owned).chain(columns.iter().map(heading));
    let caption = "CSSIM, lower is better, the best of each row in bold; brute force is the best of its starts. The last \
                   rows are means over the cells that have every method.";
    let mut table = Table::new(caption, 2, headings);
    for ((material, probe), scores) in cells.iter().zip(&scores) {
        table.scores([*material, text::light(probe)], scores);
    }
    let complete: Vec<_> = cells.iter().zip(&scores).filter(|(_, scores)| scores.iter().all(Option::is_some)).collect();
    let mut total = |name: &str, keep: &dyn Fn(&str) -> bool| {
        let kept: Vec<_> = complete.iter().filter(|(cell, _)| keep(cell.1)).collect();
        let means: Vec<Option<f64>> = (0..columns.len())
            .map(|i| mean(&kept.iter().filter_map(|(_, scores)| scores[i]).collect::<Vec<_>>()))
            .collect();
        if !kept.is_empty() {
            table.scores([format!("mean of {}", kept.len()), name.to_owned()], &means);
            table.totals += 1;
        }
    };
    for probe in &study.data.about.probes {
        total(text::light(probe), &|other| other == probe);
    }
    total("all lights", &|_| true);
    let csv = table.csv("cells");
    let best = wins(&table);
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    if columns.len() > 1 {
        section.finding(
            Verdict::Measured,
            format!("Best or equal to four decimals, of {}: {best}.", text::count(cells.len(), "cell")),
        );
    }
    Ok(section)
}

/// The methods of the grid that have a match in some cell.
fn columns(study: &Study<'_>, cells: &[(&str, &str)]) -> Vec<Column> {
    let sizes: BTreeSet<u32> = study
        .data
        .rows
        .iter()
        .filter(|row| row.method == Method::LowRes && row.size == study.size() && row.searched_size < row.size)
        .map(|row| row.searched_size)
        .collect();
    let one = |method| (method, None);
    let before = [Method::OursPolished, Method::Ours, Method::Paper, Method::Brute].map(one);
    let after = [Method::L2, Method::Log, Method::CubeRoot].map(one);
    let low = sizes.into_iter().map(|size| (Method::LowRes, Some(size)));
    let all = before.into_iter().chain(low).chain(after);
    all.filter(|column| cells.iter().any(|cell| score(study, *cell, *column).is_some())).collect()
}

fn score(study: &Study<'_>, cell: (&str, &str), (method, searched_size): Column) -> Option<f64> {
    Some(study.find(&Pick { searched_size, ..study.pick(method, cell) })?.cssim)
}

fn heading((method, size): &Column) -> String {
    let size = || size.map_or_else(String::new, |size| format!(" {size}"));
    match method {
        Method::LowRes => format!("low res.{}", size()),
        Method::L2 => "L2".to_owned(),
        Method::CubeRoot => "cube root".to_owned(),
        other => text::method(*other).to_owned(),
    }
}

/// How often each column is the best, counted from the marks in the table.
fn wins(table: &Table) -> String {
    let cells = &table.rows[..table.rows.len() - table.totals];
    let count = |i: usize| cells.iter().filter(|row: &&Vec<Entry>| row[i].best).count();
    let wins = (table.labels..table.columns.len()).map(|i| format!("{} {}", table.columns[i], count(i)));
    wins.collect::<Vec<_>>().join(", ")
}
