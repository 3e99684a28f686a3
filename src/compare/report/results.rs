//! The results for programs: JSON and CSV.

use std::fmt::Write;

use serde_json::{Value as Json, json};

use super::Report;
use crate::accuracy::{Errors, Place};
use crate::compare::bench::Row;
use crate::io::json::number;

/// The version of the JSON's layout.
const LAYOUT: u32 = 1;

/// Everything except pictures and curves. JSON has no infinity, so the PSNR of equal pictures is
/// "inf".
pub(super) fn json(report: &Report<'_>) -> String {
    let Report { bench, about, .. } = report;
    let settings = &bench.settings;
    let methods: Vec<Json> = report.rows.iter().map(row).collect();
    let points = Place::ALL.map(|place| (place.name(), bench.points(place)));
    let points: serde_json::Map<String, Json> =
        points.into_iter().map(|(name, count)| (name.to_owned(), count.into())).collect();
    let object = json!({
        "layout": LAYOUT,
        "program": about.program,
        "date": about.date,
        "machine": about.machine,
        "input": about.input,
        "volume": { "name": bench.scene.media.name(), "dims": bench.scene.media.dims() },
        "light": about.light,
        "density_scale": number(bench.scene.media.first().map_or(0.0, |body| body.medium.density_scale)),
        "largest_optical_depth": number(about.largest_optical_depth),
        "map_size": settings.map.size,
        "steps": settings.map.steps,
        "filter": settings.map.filter.name(),
        "image_size": settings.image.size,
        "exposure": number(settings.image.exposure),
        "seed": bench.seed,
        "points": points,
        "floor": row(&report.floor),
        "methods": methods,
    });
    format!("{object:#}\n")
}

fn row(row: &Row) -> Json {
    let by_place = |all: &[Errors; 4]| -> Json {
        let each = Place::ALL.into_iter().zip(all);
        each.map(|(place, own)| (place.name().to_owned(), errors(own)))
            .collect::<serde_json::Map<String, Json>>()
            .into()
    };
    let channels: serde_json::Map<String, Json> =
        row.channels.iter().map(|(name, own)| (name.clone(), by_place(own))).collect();
    let worst = row.worst.as_ref().map(|curve| {
        json!({
            "texel": curve.texel,
            "depth": number(curve.depth),
            "truth": number(curve.truth),
            "found": number(curve.found),
        })
    });
    json!({
        "label": row.label,
        "bytes": row.bytes,
        "bytes_per_texel": number(row.bytes_per_texel()),
        "build_seconds": number(row.build_seconds),
        "lookup_nanoseconds": number(row.lookup_nanoseconds),
        "errors": by_place(&row.errors),
        "channels": channels,
        "picture": {
            "psnr": number(row.difference.psnr),
            "ssim": number(row.difference.ssim),
            "flip": number(row.difference.flip),
        },
        "worst": worst,
    })
}

fn errors(errors: &Errors) -> Json {
    json!({
        "count": errors.count,
        "rms": number(errors.rms),
        "mean": number(errors.bias),
        "p99_9": number(errors.p999),
        "max": number(errors.max),
        "above_1_255": number(errors.visible),
    })
}

/// One line per method; the first one is the floor.
pub(super) fn csv(report: &Report<'_>) -> String {
    let mut text = "method,bytes,bytes_per_texel,build_seconds,lookup_nanoseconds".to_owned();
    for place in Place::ALL {
        for measure in ["rms", "mean", "p99_9", "max", "above_1_255"] {
            let _ = write!(text, ",{}_{measure}", place.name());
        }
    }
    text.push_str(",psnr,ssim,flip");
    for (name, _) in &report.floor.channels {
        for place in Place::ALL {
            let _ = write!(text, ",{name}_{}_rms", place.name());
        }
    }
    text.push('\n');
    for row in std::iter::once(&report.floor).chain(&report.rows) {
        let numbers = [row.bytes_per_texel(), row.build_seconds, row.lookup_nanoseconds];
        let errors = row.errors.iter().flat_map(|e| [e.rms, e.bias, e.p999, e.max, e.visible]);
        let picture = [row.difference.psnr, row.difference.ssim, row.difference.flip];
        let _ = write!(text, "{},{}", row.label, row.bytes);
        let channels = row.channels.iter().flat_map(|(_, errors)| errors.map(|e| e.rms));
        for number in numbers.into_iter().chain(errors).chain(picture).chain(channels) {
            let _ = write!(text, ",{number}");
        }
        text.push('\n');
    }
    text
}
