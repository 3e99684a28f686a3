//! A small plot: transmittance over depth along the ray where a method has its largest error, with
//! the truth.

use std::fmt::Write;

use super::page::escaped;
use crate::compare::bench::{Curve, Row};

const WIDTH: f64 = 320.0;
const HEIGHT: f64 = 200.0;
/// Left, top, right, bottom of the drawing area.
const AREA: [f64; 4] = [34.0, 8.0, 312.0, 166.0];

/// The curve of a method's worst texel; `None` if there is none.
pub(super) fn svg(row: &Row, id: usize) -> Option<String> {
    let curve = row.worst.as_ref()?;
    let [left, top, right, bottom] = AREA;
    let (&[from, ..], &[to, ..]) = (curve.points.first()?, curve.points.last()?);
    let x =
        |depth: f64| left + (depth - from) / (to - from).max(f64::MIN_POSITIVE) * (right - left);
    let y = |t: f64| bottom + t.clamp(-0.05, 1.05) * (top - bottom);
    let line = |value: fn(&[f64; 3]) -> f64| {
        let mut path = String::new();
        for (i, point) in curve.points.iter().enumerate() {
            let letter = if i == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{letter}{:.1} {:.1}", x(point[0]), y(value(point)));
        }
        path
    };
    let mut svg = format!(
        "<svg class=\"curve\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
         aria-labelledby=\"curve{id}\"><title id=\"curve{id}\">{}</title>",
        escaped(&described(row, curve)),
    );
    for (tick, name) in [(0.0, "0"), (0.5, "0.5"), (1.0, "1")] {
        let at = y(tick);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>\
             <text class=\"tick\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            left - 5.0,
            at + 4.0,
        );
    }
    for (depth, name) in curve.extent.into_iter().zip(["entry", "exit"]) {
        let at = x(depth);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/>\
             <text class=\"tick\" x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{name}</text>",
            bottom + 15.0,
        );
    }
    let at = x(curve.depth);
    let _ = write!(
        svg,
        "<text class=\"name\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">depth</text>\
         <path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>\
         <path class=\"truth\" d=\"{}\"/><path class=\"found\" d=\"{}\"/>\
         <path class=\"worst\" d=\"M{at:.1} {:.1}V{:.1}\"/></svg>",
        f64::midpoint(left, right),
        HEIGHT - 6.0,
        line(|p| p[1]),
        line(|p| p[2]),
        y(curve.truth),
        y(curve.found),
    );
    Some(svg)
}

fn described(row: &Row, curve: &Curve) -> String {
    let [x, y] = curve.texel;
    format!(
        "Transmittance over depth in texel ({x}, {y}): {} says {:.4} where the truth is {:.4}",
        row.label, curve.found, curve.truth,
    )
}
