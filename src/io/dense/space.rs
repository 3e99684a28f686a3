//! What a file's world is: a patient's, a scanner's or none in particular, and how what is said in
//! other conventions comes into ours, which is LPS. It knows no format, only NRRD's names.

use glam::{DMat4, DVec3};

/// A named world that a file's places are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// The patient's: x to the left, y to the back (posterior), z to the head (superior). Patients'
    /// spaces of other conventions are brought into this one when they are read, as ITK does.
    Lps,
    /// The scanner's axes, whichever way the patient lies.
    ScannerXyz,
    /// Right-handed, and nothing more is known.
    RightHanded,
    /// Left-handed, and nothing more is known.
    LeftHanded,
}

/// NRRD's names, short ones, the space that it becomes, and what turns its places into that.
const NAMES: [(&str, &str, Space, [f64; 3]); 6] = [
    ("left-posterior-superior", "LPS", Space::Lps, [1.0, 1.0, 1.0]),
    ("right-anterior-superior", "RAS", Space::Lps, [-1.0, -1.0, 1.0]),
    ("left-anterior-superior", "LAS", Space::Lps, [1.0, -1.0, 1.0]),
    ("scanner-xyz", "", Space::ScannerXyz, [1.0, 1.0, 1.0]),
    ("3D-right-handed", "", Space::RightHanded, [1.0, 1.0, 1.0]),
    ("3D-left-handed", "", Space::LeftHanded, [1.0, 1.0, 1.0]),
];

/// From a world whose x points right and y forward (RAS: NIfTI's) to ours.
pub(super) const LPS_FROM_RAS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);

impl Space {
    /// Its name, as NRRD and sidecars have it.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, _, space, _)| *space == self).map_or("", |(name, ..)| name)
    }

    /// The space that NRRD calls `text` (in any case, with or without `-time` or `T` behind it),
    /// and the transform from places in it to those that are kept here.
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

    /// All names, for people.
    pub fn names() -> String {
        NAMES.map(|(name, ..)| name).join(", ")
    }
}

/// MetaImage's letters of a patient's axes: for each axis of the voxels where it comes from.
pub(super) fn anatomical_orientation(steps: [DVec3; 3]) -> String {
    // Each axis of the voxels takes the axis of the patient that it runs along most, and none
    // twice.
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
