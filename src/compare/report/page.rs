//! The report as a page: one HTML file that needs no other.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::Path;

use super::plot::{Plot, Point, short};
use super::{Report, curves, heat, tables};
use crate::accuracy::Place;
use crate::compare::bench::Row;
use crate::error::Result;

/// The fixed part of the page; `{{name}}` stands for a variable part.
const TEMPLATE: &str = include_str!("page.html");

/// The report as HTML.
pub(super) fn html(report: &Report<'_>) -> Result<String> {
    let places = Place::ALL.iter().map(|&place| {
        let about = match place {
            Place::Volume => {
                "random points anywhere in the volume\u{2019}s box, filtered between texels: what a \
                 renderer gets"
            }
            Place::Medium => {
                "random points in voxels above 0: the volume\u{2019}s shadow on itself, without empty \
                 space"
            }
            Place::Rays => {
                "random depths between entry and exit on the central rays of random texels, looked up \
                 in that texel alone: the representation without the map\u{2019}s resolution"
            }
            Place::Behind => {
                "random points behind the volume: the shadow that it casts on the ground and on others"
            }
        };
        let count = report.bench.points(place);
        format!(
            "<h3 id=\"{0}\">{0}</h3><p>{count} {about}.</p>{1}",
            place.name(),
            tables::of_place(report, place)
        )
    });
    let parts = [
        ("title", escaped(&format!("{}: shadow maps compared", name(&report.about.input)))),
        ("about", about(report)),
        ("summary", tables::summary(report)),
        ("plots", plots(report)),
        ("places", places.chain([tables::of_channels(report)]).collect()),
        ("curves", worst(report)),
        ("gradient", heat::gradient()),
        ("least", heat::LEAST.to_string()),
        ("pictures", pictures(report)?),
        ("program", escaped(report.about.program)),
    ];
    Ok(filled(TEMPLATE, &parts))
}

/// Replaces every `{{name}}` in `template` by the part of that name; parts are not searched again.
fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut pieces = template.split("{{");
    let mut page = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        if let Some((_, part)) = parts.iter().find(|(known, _)| *known == name) {
            page.push_str(part);
        }
        page.push_str(rest);
    }
    page
}

/// An input's name without its folder.
fn name(input: &str) -> Cow<'_, str> {
    Path::new(input).file_name().map_or(Cow::Borrowed(input), OsStr::to_string_lossy)
}

/// Text escaped for HTML.
pub(super) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            letter => html.push(letter),
        }
    }
    html
}

fn about(report: &Report<'_>) -> String {
    let Report { bench, about, .. } = report;
    let (scene, settings) = (bench.scene, &bench.settings);
    let [nx, ny, nz] = scene.media.dims();
    let [width, height] = settings.image.size;
    let counts = Place::ALL.map(|p| format!("{} {}", bench.points(p), p.name()));
    let facts = [
        ("volume", format!("{}, {nx} \u{d7} {ny} \u{d7} {nz} voxels", scene.media.name())),
        ("light", about.light.clone()),
        (
            "density scale",
            format!(
                "{}: largest optical depth over the map {}",
                short(scene.media.first().map_or(0.0, |body| body.medium.density_scale)),
                short(about.largest_optical_depth)
            ),
        ),
        (
            "map",
            format!(
                "{0} \u{d7} {0} texels, at most {1} steps, filter {2}",
                settings.map.size,
                settings.map.steps,
                settings.map.filter.name()
            ),
        ),
        (
            "picture",
            format!("{width} \u{d7} {height} pixels, exposure {}", settings.image.exposure),
        ),
        ("points", format!("{}; seed {}", counts.join(", "), bench.seed)),
        ("machine", about.machine.clone()),
        ("made", format!("{} by {}", about.date, about.program)),
    ];
    let mut html = "<dl>".to_owned();
    for (name, value) in facts {
        let _ = write!(html, "<div><dt>{name}</dt><dd>{}</dd></div>", escaped(&value));
    }
    html.push_str("</dl>");
    html
}

fn plots(report: &Report<'_>) -> String {
    let points = |x: fn(&Row) -> f64, place: Place| -> Vec<Point<'_>> {
        let row = |row: &'_ Row| (x(row), row.at(place).rms);
        let rows = report.rows.iter();
        rows.map(|r| (r, row(r))).map(|(r, (x, y))| Point { label: &r.label, x, y }).collect()
    };
    let floor = Some((report.floor.at(Place::Volume).rms, "the map's resolution alone"));
    let on_rays = "RMS error on texel-centre rays";
    let in_volume = "RMS error in the volume";
    let plots = [
        Plot {
            id: "rays-bytes",
            title: "Error of the representation against its size",
            x: "bytes per texel",
            y: on_rays,
            points: points(Row::bytes_per_texel, Place::Rays),
            floor: None,
        },
        Plot {
            id: "volume-bytes",
            title: "Error at any point against size",
            x: "bytes per texel",
            y: in_volume,
            points: points(Row::bytes_per_texel, Place::Volume),
            floor,
        },
        Plot {
            id: "rays-lookup",
            title: "Error of the representation against the time of a lookup",
            x: "nanoseconds per filtered lookup, one thread",
            y: on_rays,
            points: points(|row| row.lookup_nanoseconds, Place::Rays),
            floor: None,
        },
        Plot {
            id: "rays-build",
            title: "Error of the representation against the time to build the map",
            x: "seconds to build the map",
            y: on_rays,
            points: points(|row| row.build_seconds, Place::Rays),
            floor: None,
        },
    ];
    let figure = |plot: &Plot<'_>| {
        format!("<figure><figcaption>{}</figcaption>{}</figure>", plot.title, plot.svg())
    };
    plots.iter().map(figure).collect()
}

fn worst(report: &Report<'_>) -> String {
    let mut html = String::new();
    for (i, row) in report.rows.iter().enumerate() {
        let (Some(curve), Some(svg)) = (&row.worst, curves::svg(row, i)) else { continue };
        let [x, y] = curve.texel;
        let _ = write!(
            html,
            "<figure><figcaption><b>{}</b><br>texel ({x}, {y}), off by {}</figcaption>{svg}</figure>",
            escaped(&row.label),
            short(curve.found - curve.truth),
        );
    }
    html
}

fn pictures(report: &Report<'_>) -> Result<String> {
    let settings = &report.bench.settings;
    let exposure = settings.image.exposure as f32;
    let [width, height] = settings.image.size;
    let image = |uri: &str, alt: &str| {
        format!(
            "<img src=\"{uri}\" alt=\"{}\" width=\"{width}\" height=\"{height}\" loading=\"lazy\">",
            escaped(alt)
        )
    };
    let truth = heat::picture(&report.bench.true_image, exposure)?;
    let mut html = format!(
        "<figure><figcaption><b>truth</b> lit through the exact integral</figcaption>\
         <div class=\"pair\">{}</div></figure>",
        image(&truth, "The true picture")
    );
    for row in std::iter::once(&report.floor).chain(&report.rows) {
        let difference = &row.difference;
        let picture = heat::picture(&row.image, exposure)?;
        let heat = heat::differences(width, &difference.map)?;
        let _ = write!(
            html,
            "<figure><figcaption><b>{}</b> PSNR {:.1} dB, SSIM {:.5}, FLIP {:.5}</figcaption>\
             <div class=\"pair\">{}{}</div></figure>",
            escaped(&row.label),
            difference.psnr,
            difference.ssim,
            difference.flip,
            image(&picture, &format!("Picture lit through {}", row.label)),
            image(&heat, &format!("FLIP differences of {}", row.label)),
        );
    }
    Ok(html)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_go_where_they_are_named() {
        let parts = [("a", "1".to_owned()), ("b", "{{a}}".to_owned())];
        assert_eq!(filled("x{{a}}y{{b}}z{{c}}", &parts), "x1y{{a}}z");
        assert_eq!(escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }
}
