//! Rays, boxes and orthonormal frames in f64, for setting up scenes and for the reference. Knows
//! nothing of volumes or light. `scene` lists the names of spaces; a transform from space `from` to
//! space `to` is called `to_from`.

use glam::{DMat4, DVec3};

/// An axis-aligned box; `min` and `max` are opposite corners, `min <= max` on each axis.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
pub struct Aabb {
    /// The corner with the smallest coordinates.
    pub min: DVec3,
    /// The corner with the largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The smallest box around `points`; `None` without points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds: Option<Self>, p| {
            Some(
                bounds.map_or(Self { min: p, max: p }, |b| Self {
                    min: b.min.min(p),
                    max: b.max.max(p),
                }),
            )
        })
    }

    /// The eight corners, with x varying fastest.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i & bit == 0 { lo } else { hi };
            DVec3::new(
                pick(1, self.min.x, self.max.x),
                pick(2, self.min.y, self.max.y),
                pick(4, self.min.z, self.max.z),
            )
        })
    }

    /// Edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The centre.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// The bounding box of this box's corners after the transform `to_from`.
    #[must_use]
    pub fn transformed(&self, to_from: &DMat4) -> Self {
        let corners = self.corners().map(|p| to_from.transform_point3(p));
        let fold = |f: fn(DVec3, DVec3) -> DVec3| corners.into_iter().reduce(f).unwrap_or_default();
        Self { min: fold(DVec3::min), max: fold(DVec3::max) }
    }

    /// The interval of `t >= 0` in which `origin + t * direction` is inside; `None` if there is
    /// none. `direction` need not be a unit vector; `t` counts its lengths.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        let (mut enter, mut exit) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            if d == 0.0 {
                // A ray along a face is inside.
                if o < self.min[axis] || o > self.max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.min[axis] - o) / d, (self.max[axis] - o) / d);
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        (enter < exit).then_some((enter, exit))
    }
}

/// Two unit vectors (right, up) that form a right-handed frame with the unit vector `forward`:
/// `right x up = -forward`, with `up` as close to `up_hint` as possible.
pub fn frame_of(forward: DVec3, up_hint: DVec3) -> (DVec3, DVec3) {
    let right = forward.cross(up_hint);
    let right = if right.length_squared() > 1e-12 * up_hint.length_squared() {
        right.normalize()
    } else {
        forward.any_orthonormal_vector()
    };
    (right, right.cross(forward))
}

/// `map` of small arrays, compiled where it is called. The standard library's goes through closures
/// that are compiled elsewhere, which the innermost loops pay for with a fifth of their time.
pub(crate) trait Each<T> {
    /// As many of another type.
    type Of<U>;

    /// What `f` makes of each element.
    fn each<U>(self, f: impl FnMut(T) -> U) -> Self::Of<U>;
}

macro_rules! each {
    ($count:literal: $($element:ident),*) => {
        impl<T> Each<T> for [T; $count] {
            type Of<U> = [U; $count];

            #[inline]
            fn each<U>(self, mut f: impl FnMut(T) -> U) -> [U; $count] {
                let [$($element),*] = self;
                [$(f($element)),*]
            }
        }
    };
}
each!(2: a, b);
each!(3: a, b, c);
each!(4: a, b, c, d);

/// A number to three digits, as people are told it.
pub(crate) fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
