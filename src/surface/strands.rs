//! Strands: polylines with a thickness, such as hair, fur or fibres.

use glam::{DVec3, Vec3};

use crate::error::{Error, Result};

/// A value that is the same everywhere, or has a number for each point.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Varying<T> {
    Same(T),
    PerPoint(Vec<T>),
}

impl<T: Copy> Varying<T> {
    /// The value at a point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    pub fn at(&self, point: usize) -> T {
        match self {
            Self::Same(value) => *value,
            Self::PerPoint(values) => values[point],
        }
    }

    /// The values: one, or one for each point.
    pub fn values(&self) -> &[T] {
        match self {
            Self::Same(value) => std::slice::from_ref(value),
            Self::PerPoint(values) => values,
        }
    }
}

/// Polylines with a thickness. A strand is the union of its segments, each of which is the convex
/// hull of the spheres around its two ends.
#[derive(Clone, Debug)]
pub struct Strands {
    /// Its name in the source: a file's stem.
    pub name: String,
    points: Vec<Vec3>,
    /// The index of each strand's first point, and the number of points at the end.
    starts: Vec<u32>,
    /// Diameters.
    thickness: Varying<f32>,
    opacity: Varying<f32>,
    albedo: Varying<Vec3>,
    skipped: usize,
}

/// A part of a strand between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The two ends.
    pub ends: [Vec3; 2],
    /// The strand's radius at each.
    pub radii: [f32; 2],
    /// The opacity of one crossing at each, 0..1.
    pub opacities: [f32; 2],
}

impl Strands {
    /// Strands of `points`, one strand after another; `counts` are their numbers of points.
    /// `thickness` is the diameter in the points' unit, `opacity` the share of light that one
    /// crossing takes, 0..1, and `albedo` the reflectance, linear RGB, 0..1.
    ///
    /// Strands of fewer than two points, and those with a number that is not finite, are left out
    /// and counted ([`Strands::skipped`]).
    ///
    /// # Errors
    /// If the counts do not add up to the number of points, or those of varying values differ from
    /// it; if a thickness is negative, or an opacity or albedo is not in 0..1; if no strand is left;
    /// or if the points exceed 32 bits.
    pub fn new(
        name: impl Into<String>,
        points: Vec<Vec3>,
        counts: &[u32],
        thickness: Varying<f32>,
        opacity: Varying<f32>,
        albedo: Varying<Vec3>,
    ) -> Result<Self> {
        let name = name.into();
        let wrong = |why: String| Err(Error::value(format!("hair '{name}'"), why));
        let (count, said) = (points.len(), counts.iter().map(|&n| u64::from(n)).sum::<u64>());
        if said != count as u64 || u32::try_from(count).is_err() {
            return wrong(format!("its strands have {said} points, but there are {count}"));
        }
        let given = |values: usize| values == 1 || values == count;
        let arrays = [
            ("thicknesses", thickness.values().len()),
            ("opacities", opacity.values().len()),
            ("colours", albedo.values().len()),
        ];
        if let Some((what, number)) = arrays.into_iter().find(|(_, number)| !given(*number)) {
            return wrong(format!("{number} {what} for {count} points"));
        }
        if let Some(bad) = thickness.values().iter().find(|&&value| value < 0.0) {
            return wrong(format!("a thickness of {bad}"));
        }
        // NaN passes here; its strand is left out below.
        let outside = |x: f32| !x.is_nan() && !(0.0..=1.0).contains(&x);
        if let Some(bad) = opacity.values().iter().find(|&&value| outside(value)) {
            return wrong(format!("an opacity of {bad}, which is not in 0..1"));
        }
        let bad = albedo.values().iter().find(|value| value.to_array().into_iter().any(outside));
        if let Some(bad) = bad {
            return wrong(format!("a colour of {bad}, which is not in 0..1"));
        }
        let all = Self { name, points, starts: Vec::new(), thickness, opacity, albedo, skipped: 0 };
        all.kept(counts)
    }

    /// The same points, as those strands that can be used.
    fn kept(mut self, counts: &[u32]) -> Result<Self> {
        let is_finite = |i: usize| {
            let numbers = self.points[i].is_finite() && self.albedo.at(i).is_finite();
            numbers && self.thickness.at(i).is_finite() && self.opacity.at(i).is_finite()
        };
        let (mut keep, mut starts) = (Vec::with_capacity(self.points.len()), vec![0]);
        let (mut begin, mut kept) = (0, 0);
        for &count in counts {
            let own = begin..begin + count as usize;
            let usable = count >= 2 && own.clone().all(is_finite);
            keep.extend(own.map(|_| usable));
            begin += count as usize;
            if usable {
                kept += count;
                starts.push(kept);
            }
        }
        self.skipped = counts.len() + 1 - starts.len();
        if starts.len() == 1 {
            let why = match counts.len() {
                0 => "it has no strands".to_owned(),
                some => format!("none of its {some} strands has two points that are finite"),
            };
            return Err(Error::value(format!("hair '{}'", self.name), why));
        }
        if keep.contains(&false) {
            retain(&mut self.points, &keep);
            for values in [&mut self.thickness, &mut self.opacity] {
                if let Varying::PerPoint(values) = values {
                    retain(values, &keep);
                }
            }
            if let Varying::PerPoint(values) = &mut self.albedo {
                retain(values, &keep);
            }
        }
        self.starts = starts;
        Ok(self)
    }

    /// The same strands, with some values the same everywhere: `thickness` (a diameter in the
    /// points' unit), `opacity` of a crossing and `albedo` (linear RGB), both 0..1.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn with_values(
        mut self,
        thickness: Option<f64>,
        opacity: Option<f64>,
        albedo: Option<DVec3>,
    ) -> Result<Self> {
        let wrong = |what: &str, why: String| Err(Error::value(format!("hair.{what}"), why));
        if let Some(thickness) = thickness {
            if !(thickness > 0.0 && thickness < 1e30) {
                return wrong("thickness", format!("{thickness} is not above 0"));
            }
            self.thickness = Varying::Same(thickness as f32);
        }
        if let Some(opacity) = opacity {
            if !(0.0..=1.0).contains(&opacity) {
                return wrong("opacity", format!("{opacity} is not in 0..1"));
            }
            self.opacity = Varying::Same(opacity as f32);
        }
        if let Some(albedo) = albedo {
            if albedo.to_array().iter().any(|c| !(0.0..=1.0).contains(c)) {
                return wrong("albedo", format!("{albedo} is not in 0..1"));
            }
            self.albedo = Varying::Same(albedo.as_vec3());
        }
        Ok(self)
    }

    /// Number of strands.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// All points, one strand after another.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The indices of a strand's points.
    ///
    /// # Panics
    /// If there is no such strand.
    #[inline]
    pub fn strand(&self, index: usize) -> std::ops::Range<usize> {
        self.starts[index] as usize..self.starts[index + 1] as usize
    }

    /// The segment between point `first` of a strand and the next one.
    ///
    /// # Panics
    /// If there are no such points.
    #[inline]
    pub fn segment(&self, first: usize) -> Segment {
        let both = [first, first + 1];
        Segment {
            ends: both.map(|i| self.points[i]),
            radii: both.map(|i| 0.5 * self.thickness.at(i)),
            opacities: both.map(|i| self.opacity.at(i)),
        }
    }

    /// The direction of the strand at each point, of unit length: between those of the two segments
    /// that meet there. Zero where a strand has no length.
    pub fn tangents(&self) -> Vec<Vec3> {
        let mut tangents = vec![Vec3::ZERO; self.points.len()];
        for own in (0..self.count()).map(|index| self.strand(index)) {
            for first in own.start..own.end - 1 {
                let along = self.points[first + 1].as_dvec3() - self.points[first].as_dvec3();
                let along = along.normalize_or_zero().as_vec3();
                tangents[first] += along;
                tangents[first + 1] += along;
            }
        }
        for tangent in &mut tangents {
            *tangent = tangent.normalize_or_zero();
        }
        tangents
    }

    /// Diameters, in the points' unit.
    pub fn thickness(&self) -> &Varying<f32> {
        &self.thickness
    }

    /// The shares of light that one crossing takes, 0..1.
    pub fn opacity(&self) -> &Varying<f32> {
        &self.opacity
    }

    /// Reflectances, linear RGB, 0..1.
    pub fn albedo(&self) -> &Varying<Vec3> {
        &self.albedo
    }

    /// How many strands were left out: of fewer than two points, or with numbers that are not
    /// finite.
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        let numbers = size_of_val(self.thickness.values()) + size_of_val(self.opacity.values());
        let vectors = size_of_val(&*self.points) + size_of_val(self.albedo.values());
        (numbers + vectors + size_of_val(&*self.starts)) as u64
    }
}

/// Keeps the items at which `keep` says so.
fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    items.retain(|_| keep.next() == Some(&true));
}
