//! The coordinate system of a file's world: a patient's, a scanner's, or none in particular.
//! Patients' spaces of other conventions are converted to LPS, which this crate uses. Knows no
//! format, only NRRD's names.

use glam::{DMat4, DVec3};

/// A named coordinate system of positions in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// The patient's: x to the left, y to the back (posterior), z to the head (superior). Patients'
    /// spaces in other conventions are converted to this one when they are read, as in ITK.
    Lps,
    /// The scanner's axes, independent of the patient's position.
    ScannerXyz,
    /// Right-handed; nothing else is known.
    RightHanded,
    /// Left-handed; nothing else is known.
    LeftHanded,
}

/// For each of NRRD's spaces: its name, its short name, the space that it is converted to, and the
/// signs that convert positions.
const NAMES: [(&str, &str, Space, [f64; 3]); 6] = [
    ("left-posterior-superior", "LPS", Space::Lps, [1.0, 1.0, 1.0]),
    ("right-anterior-superior", "RAS", Space::Lps, [-1.0, -1.0, 1.0]),
    ("left-anterior-superior", "LAS", Space::Lps, [1.0, -1.0, 1.0]),
    ("scanner-xyz", "", Space::ScannerXyz, [1.0, 1.0, 1.0]),
    ("3D-right-handed", "", Space::RightHanded, [1.0, 1.0, 1.0]),
    ("3D-left-handed", "", Space::LeftHanded, [1.0, 1.0, 1.0]),
];

/// Signs that convert a world with x to the right and y to the front (RAS, as in NIfTI) to LPS.
pub(super) const LPS_FROM_RAS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);

impl Space {
    /// The space's name in NRRD files and sidecars.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, _, space, _)| *space == self).map_or("", |(name, ..)| name)
    }

    /// The space that NRRD calls `text` (in upper or lower case, with or without `-time` or `T` at
    /// the end), and the transform from it to the space that is kept here. `None` if the name is
    /// unknown.
    pub fn named(text: &str) -> Option<(Self, DMat4)> {
        let text = text.trim().to_ascii_lowercase();
        let found = NAMES.iter().find(|(long, short, ..)| {
            let (long, short) = (long.to_ascii_lowercase(), short.to_ascii_lowercase());
            text == long
                || text.strip_suffix("-time") == Some(&long)
                || (!short.is_empty() && (text == short || text.strip_suffix('t') == Some(&short)))
        });
        found.map(|(_, _, space, signs)| (*space, DMat4::from_scale(DVec3::from(*signs))))
    }

    /// All names, for messages.
    pub fn names() -> String {
        NAMES.map(|(name, ..)| name).join(", ")
    }
}

/// MetaImage's letters of a patient's axes: for each axis of the voxels, the side that it comes
/// from.
pub(super) fn anatomical_orientation(steps: [DVec3; 3]) -> String {
    // Each axis of the voxels is assigned the axis of the patient that is closest in direction;
    // none is assigned twice.
    let size = |axis: usize, along: usize| (steps[axis].normalize_or_zero()[along]).abs();
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fit = |order: &[usize; 3]| (0..3).map(|axis| size(axis, order[axis])).sum::<f64>();
    let best = orders.into_iter().reduce(|a, b| if fit(&b) > fit(&a) { b } else { a });
    let letter = |axis: usize, along: usize| {
        let [from, to] = [['R', 'L'], ['A', 'P'], ['I', 'S']][along];
        if steps[axis][along] < 0.0 { to } else { from }
    };
    let order = best.unwrap_or([0, 1, 2]);
    (0..3).map(|axis| letter(axis, order[axis])).collect()
}
