//! The tables of the page.

use std::fmt::Write;

use super::Report;
use super::page::escaped;
use super::plot::short;
use crate::accuracy::{Errors, Place};
use crate::compare::bench::Row;

/// A column: its heading, the value of a row (`None` if it has no such number), and the number
/// format.
struct Column {
    head: &'static str,
    value: Value,
    write: fn(f64) -> String,
    best: Best,
}

/// A row's value in a column.
type Value = Box<dyn Fn(&Row) -> Option<f64>>;

/// Which number of a column is highlighted.
#[derive(Clone, Copy, PartialEq)]
enum Best {
    Least,
    Most,
    Nearest0,
}

fn error(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 { format!("{value:.1e}") } else { format!("{value:.5}") }
}

fn percent(value: f64) -> String {
    format!("{:.2}", 100.0 * value)
}

/// Bytes, times, the RMS error of each place and the picture's errors.
pub(super) fn summary(report: &Report<'_>) -> String {
    let cost = |head, pick: fn(&Row) -> f64| {
        column(head, move |row| (row.bytes > 0).then(|| pick(row)), short, Best::Least)
    };
    let rms =
        |place: Place| column(place.name(), move |row| Some(row.at(place).rms), error, Best::Least);
    let columns = [
        cost("bytes per texel", Row::bytes_per_texel),
        cost("build, s", |row| row.build_seconds),
        cost("lookup, ns", |row| row.lookup_nanoseconds),
        rms(Place::Volume),
        rms(Place::Medium),
        rms(Place::Rays),
        rms(Place::Behind),
        column("PSNR, dB", |r| Some(r.difference.psnr), |v| format!("{v:.1}"), Best::Most),
        column("SSIM", |r| Some(r.difference.ssim), |v| format!("{v:.5}"), Best::Most),
        column("FLIP", |r| Some(r.difference.flip), error, Best::Least),
    ];
    let groups = [("", 1), ("cost", 3), ("RMS error of transmittance", 4), ("picture", 3)];
    table("All methods", &groups, &columns, report)
}

/// All error measures at one place.
pub(super) fn of_place(report: &Report<'_>, place: Place) -> String {
    let measure = |head, pick: fn(&Errors) -> f64, write, best| {
        let value = move |row: &Row| {
            let errors = row.at(place);
            (errors.count > 0).then(|| pick(errors))
        };
        column(head, value, write, best)
    };
    let columns = [
        measure("RMS", |e| e.rms, error, Best::Least),
        measure("mean", |e| e.bias, |v| format!("{v:+.5}"), Best::Nearest0),
        measure("99.9 %", |e| e.p999, error, Best::Least),
        measure("largest", |e| e.max, error, Best::Least),
        measure("above 1/255, %", |e| e.visible, percent, Best::Least),
    ];
    table(&format!("Errors: {}", place.name()), &[], &columns, report)
}

/// RMS errors of each channel or light separately; empty if there is only one.
pub(super) fn of_channels(report: &Report<'_>) -> String {
    let names = report.floor.channels.iter().map(|(name, _)| name.as_str());
    let groups: Vec<(&str, u32)> = std::iter::once(("", 1)).chain(names.map(|n| (n, 4))).collect();
    let count = groups.len() - 1;
    if count == 0 {
        return String::new();
    }
    let columns: Vec<Column> = (0..count)
        .flat_map(|channel| {
            Place::ALL.map(|place| {
                let rms = move |row: &Row| {
                    row.channels.get(channel).map(|(_, errors)| errors[place as usize].rms)
                };
                column(place.name(), rms, error, Best::Least)
            })
        })
        .collect();
    let html = table("RMS errors by channel", &groups, &columns, report);
    format!("<h3 id=\"channels\">channels</h3><p>Each has a map of its own.</p>{html}")
}

fn column(
    head: &'static str,
    value: impl Fn(&Row) -> Option<f64> + 'static,
    write: fn(f64) -> String,
    best: Best,
) -> Column {
    Column { head, value: Box::new(value), write, best }
}

fn table(name: &str, groups: &[(&str, u32)], columns: &[Column], report: &Report<'_>) -> String {
    let mut html = format!(
        "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{0}\"><table>\
         <caption>{0}</caption><thead>",
        escaped(name)
    );
    if !groups.is_empty() {
        html.push_str("<tr>");
        for (name, span) in groups {
            let _ =
                write!(html, "<th colspan=\"{span}\" scope=\"colgroup\">{}</th>", escaped(name));
        }
        html.push_str("</tr>");
    }
    html.push_str("<tr><th scope=\"col\">method</th>");
    for column in columns {
        let _ = write!(html, "<th scope=\"col\">{}</th>", escaped(column.head));
    }
    html.push_str("</tr></thead><tbody>");
    let best: Vec<Option<f64>> = columns.iter().map(|c| best_of(c, &report.rows)).collect();
    for row in &report.rows {
        line(&mut html, row, columns, &best, "");
    }
    let none = vec![None; columns.len()];
    line(&mut html, &report.floor, columns, &none, " class=\"floor-row\"");
    html.push_str("</tbody></table></div>");
    html
}

fn line(html: &mut String, row: &Row, columns: &[Column], best: &[Option<f64>], class: &str) {
    let _ = write!(html, "<tr{class}><th scope=\"row\">{}</th>", escaped(&row.label));
    for (column, best) in columns.iter().zip(best) {
        let cell = (column.value)(row).map_or_else(|| "\u{2013}".to_owned(), column.write);
        let stands_out = best.is_some_and(|best| (column.write)(best) == cell);
        let mark = if stands_out { " class=\"best\"" } else { "" };
        let _ = write!(html, "<td{mark}>{cell}</td>");
    }
    html.push_str("</tr>");
}

fn best_of(column: &Column, rows: &[Row]) -> Option<f64> {
    let values = rows.iter().filter_map(&column.value).filter(|v| !v.is_nan());
    let order = |v: &f64| match column.best {
        Best::Least => *v,
        Best::Most => -*v,
        Best::Nearest0 => v.abs(),
    };
    values.min_by(|a, b| order(a).total_cmp(&order(b)))
}
