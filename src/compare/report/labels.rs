//! Places labels beside points so that none covers another one or a point.

/// Half the height of a label, in the plot's units.
const HALF_HEIGHT: f64 = 7.0;
const LETTER: f64 = 6.5;
/// Room kept free around a point.
const RADIUS: f64 = 6.0;
/// Directions from a point to its label, right first.
const WAYS: [[f64; 2]; 12] = [
    [1.0, 0.0],
    [-1.0, 0.0],
    [0.7, -0.7],
    [0.7, 0.7],
    [-0.7, -0.7],
    [-0.7, 0.7],
    [0.0, -1.0],
    [0.0, 1.0],
    [0.9, -0.35],
    [0.9, 0.35],
    [-0.9, -0.35],
    [-0.9, 0.35],
];

/// A box: left, top, right, bottom.
pub(super) type Area = [f64; 4];

/// A placed label: the left end of its text, the height of its middle, and, if it stands apart from
/// its point, the line that connects them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    pub left: f64,
    pub middle: f64,
    pub leader: Option<[f64; 4]>,
}

/// Places a label of the given number of letters at each of `points`, inside `frame`. Labels do not
/// cover each other or points, and avoid the `lines` where there is room.
pub(super) fn place(
    points: &[[f64; 2]],
    letters: &[usize],
    frame: Area,
    lines: &[Area],
) -> Vec<Placed> {
    let around = |[x, y]: [f64; 2]| [x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS];
    let mut taken: Vec<Area> = points.iter().copied().map(around).collect();
    let mut placed = vec![None; points.len()];
    // Points with few neighbours have room anyway, so the crowded ones choose first.
    let near = |i: usize| {
        let [x, y] = points[i];
        points.iter().filter(|[a, b]| (a - x).abs() < 90.0 && (b - y).abs() < 30.0).count()
    };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(near(i)));
    for i in order {
        let width = letters[i] as f64 * LETTER;
        let free = |area: Area, drawn: &[Area]| drawn.iter().all(|other| !overlap(area, *other));
        let fits = |(area, _): &(Area, Placed)| inside(*area, frame) && free(*area, &taken);
        let found = candidates(points[i], width)
            .find(|candidate| fits(candidate) && free(candidate.0, lines))
            .or_else(|| candidates(points[i], width).find(fits));
        // A plot that is too full for all labels still has this one.
        let (area, placing) =
            found.or_else(|| candidates(points[i], width).next()).unwrap_or_default();
        taken.push(area);
        placed[i] = Some(placing);
    }
    placed.into_iter().map(Option::unwrap_or_default).collect()
}

impl Default for Placed {
    fn default() -> Self {
        Self { left: 0.0, middle: 0.0, leader: None }
    }
}

/// Candidate positions of a label, the nearest first.
fn candidates([x, y]: [f64; 2], width: f64) -> impl Iterator<Item = (Area, Placed)> {
    let distances = (0..14).map(|i| 9.0 + 8.0 * f64::from(i));
    distances.flat_map(move |distance| {
        WAYS.into_iter().map(move |[dx, dy]| {
            let (ax, ay) = (x + dx * distance, y + dy * distance);
            let left = if dx > 0.0 {
                ax
            } else if dx < 0.0 {
                ax - width
            } else {
                ax - width / 2.0
            };
            let middle = ay + dy * HALF_HEIGHT;
            let area = [left, middle - HALF_HEIGHT, left + width, middle + HALF_HEIGHT];
            let leader = (distance > 10.0).then_some([
                x + dx * 5.0,
                y + dy * 5.0,
                ax - dx * 2.0,
                ay - dy * 2.0,
            ]);
            (area, Placed { left, middle, leader })
        })
    })
}

fn overlap(a: Area, b: Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn inside(a: Area, frame: Area) -> bool {
    a[0] >= frame[0] && a[1] >= frame[1] && a[2] <= frame[2] && a[3] <= frame[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crowded_labels_do_not_overlap() {
        let points: Vec<[f64; 2]> = (0..20)
            .map(|i| [150.0 + f64::from(i % 5) * 25.0, 100.0 + f64::from(i / 5) * 12.0])
            .collect();
        let letters = vec![12; points.len()];
        let (frame, line) = ([0.0, 0.0, 640.0, 400.0], [0.0, 80.0, 640.0, 81.0]);
        let placed = place(&points, &letters, frame, &[line]);
        let areas: Vec<Area> = placed
            .iter()
            .map(|p| {
                [p.left, p.middle - HALF_HEIGHT, p.left + 12.0 * LETTER, p.middle + HALF_HEIGHT]
            })
            .collect();
        for (i, a) in areas.iter().enumerate() {
            assert!(inside(*a, frame) && !overlap(*a, line), "{a:?}");
            assert!(areas[..i].iter().all(|b| !overlap(*a, *b)), "label {i}");
        }
    }
}
