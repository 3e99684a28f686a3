//! A scatter plot on logarithmic axes with its Pareto front, as SVG.

use std::fmt::Write;

use super::axis::{LogAxis, tick_label};
use super::labels::{Area, place};
use super::page::escaped;

const WIDTH: f64 = 680.0;
const HEIGHT: f64 = 420.0;
/// Left, top, right, bottom of the drawing area.
const AREA: [f64; 4] = [70.0, 16.0, 654.0, 366.0];

/// A plot in which less is better on both axes.
pub(super) struct Plot<'a> {
    /// An id that is unique in the page.
    pub id: &'a str,
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub points: Vec<Point<'a>>,
    /// A horizontal line that no point can be below, and its name.
    pub floor: Option<(f64, &'a str)>,
}

pub(super) struct Point<'a> {
    pub label: &'a str,
    pub x: f64,
    pub y: f64,
}

/// Which of `points` are on the Pareto front: no other point is as good on both axes and better on
/// one.
fn front(points: &[Point<'_>]) -> Vec<bool> {
    let beats = |a: &Point<'_>, b: &Point<'_>| a.x <= b.x && a.y <= b.y && (a.x < b.x || a.y < b.y);
    points.iter().map(|p| !points.iter().any(|other| beats(other, p))).collect()
}

impl Plot<'_> {
    /// The plot as an SVG element with title and description.
    pub(super) fn svg(&self) -> String {
        let [left, top, right, bottom] = AREA;
        let x = LogAxis::around(self.points.iter().map(|p| p.x), [left, right]);
        let heights = self.points.iter().map(|p| p.y).chain(self.floor.map(|(y, _)| y));
        let y = LogAxis::around(heights, [bottom, top]);
        let best = front(&self.points);
        let names: Vec<&str> = self
            .points
            .iter()
            .zip(&best)
            .filter_map(|(point, &best)| best.then_some(point.label))
            .collect();
        let mut svg = String::new();
        let _ = write!(
            svg,
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
             aria-labelledby=\"{0}-t {0}-d\"><title id=\"{0}-t\">{1}</title>\
             <desc id=\"{0}-d\">{2} against {3}, both logarithmic. On the Pareto front: {4}.</desc>",
            self.id,
            escaped(self.title),
            escaped(self.y),
            escaped(self.x),
            escaped(&names.join(", ")),
        );
        self.axes(&mut svg, &x, &y);
        let places: Vec<[f64; 2]> =
            self.points.iter().map(|p| [x.place(p.x), y.place(p.y)]).collect();
        let mut lines = self.draw_floor(&mut svg, &y);
        lines.extend(draw_front(&mut svg, &places, &best));
        for (([px, py], point), best) in places.iter().zip(&self.points).zip(&best) {
            let class = if *best { "dot best" } else { "dot" };
            let _ = write!(
                svg,
                "<circle class=\"{class}\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4.5\"><title>{}: {}, {}\
                 </title></circle>",
                escaped(point.label),
                short(point.x),
                short(point.y),
            );
        }
        let letters: Vec<usize> = self.points.iter().map(|p| p.label.chars().count()).collect();
        for (placed, point) in place(&places, &letters, AREA, &lines).iter().zip(&self.points) {
            if let Some([x1, y1, x2, y2]) = placed.leader {
                let _ =
                    write!(svg, "<path class=\"leader\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\"/>");
            }
            let _ = write!(
                svg,
                "<text class=\"label\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                placed.left,
                placed.middle + 4.0,
                escaped(point.label),
            );
        }
        svg.push_str("</svg>");
        svg
    }

    /// Draws the line that no point can be below, with its name. Returns the areas that they cover.
    fn draw_floor(&self, svg: &mut String, y: &LogAxis) -> Vec<Area> {
        let [left, _, right, bottom] = AREA;
        let Some((floor, name)) = self.floor.filter(|(floor, _)| *floor > 0.0) else {
            return Vec::new();
        };
        let at = y.place(floor);
        // Small maps are far above the line, so there is room on the left.
        let text = if at + 20.0 < bottom { at + 14.0 } else { at - 6.0 };
        let _ = write!(
            svg,
            "<path class=\"floor\" d=\"M{left} {at:.1}H{right}\"/>\
             <text class=\"note\" x=\"{}\" y=\"{text:.1}\">{}</text>",
            left + 6.0,
            escaped(name),
        );
        let width = 6.5 * name.chars().count() as f64;
        vec![[left, at - 1.0, right, at + 1.0], [left, text - 11.0, left + 6.0 + width, text + 3.0]]
    }

    fn axes(&self, svg: &mut String, x: &LogAxis, y: &LogAxis) {
        let [left, top, right, bottom] = AREA;
        for tick in x.ticks() {
            let at = x.place(tick);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/>\
                 <text class=\"tick\" x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                bottom + 17.0,
                tick_label(tick),
            );
        }
        for tick in y.ticks() {
            let at = y.place(tick);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>\
                 <text class=\"tick\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 7.0,
                at + 4.0,
                tick_label(tick),
            );
        }
        let _ = write!(
            svg,
            "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>\
             <text class=\"name\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text class=\"name\" transform=\"translate(16 {}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            f64::midpoint(left, right),
            HEIGHT - 12.0,
            escaped(self.x),
            f64::midpoint(top, bottom),
            escaped(self.y),
        );
    }
}

/// Draws the Pareto front as steps from best point to best point: the least error for at most a
/// given cost. Returns the areas that it covers.
fn draw_front(svg: &mut String, places: &[[f64; 2]], best: &[bool]) -> Vec<Area> {
    let mut corners: Vec<[f64; 2]> =
        places.iter().zip(best).filter_map(|(&place, &best)| best.then_some(place)).collect();
    corners.sort_by(|a, b| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
    let mut path = String::new();
    let mut lines = Vec::new();
    let mut last: Option<[f64; 2]> = None;
    for [x, y] in corners {
        if let Some([from_x, from_y]) = last {
            let _ = write!(path, "H{x:.1}V{y:.1}");
            lines.push([from_x, from_y - 1.0, x, from_y + 1.0]);
            lines.push([x - 1.0, from_y, x + 1.0, y]);
        } else {
            let _ = write!(path, "M{x:.1} {y:.1}");
        }
        last = Some([x, y]);
    }
    let _ = write!(svg, "<path class=\"front\" d=\"{path}\"/>");
    lines
}

/// A number of any magnitude in a few characters.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if value.abs() >= 100.0 {
        format!("{value:.0}")
    } else if value.abs() >= 0.001 {
        let digits = (2.0 - value.abs().log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let point = |x, y| Point { label: "", x, y };
        let points =
            [point(1.0, 9.0), point(2.0, 9.0), point(2.0, 3.0), point(4.0, 1.0), point(9.0, 1.0)];
        assert_eq!(front(&points), [true, false, true, true, false]);
    }

    #[test]
    fn numbers_stay_short() {
        let numbers = [0.0, 12345.6, 16.0, 0.0123, 0.000_123].map(short);
        assert_eq!(numbers, ["0", "12346", "16.0", "0.0123", "1.2e-4"]);
    }
}
