//! Grids of any value type derived from others: fewer voxels, other numbers. Knows nothing of
//! files.

use super::edit::EVERYWHERE;
use super::grid::{Grid, with_tree};
use super::index_box::IndexBox;
use super::tree::Tree;
use super::value::Value;
use crate::error::{Error, Result};
use crate::io::number::ValueType as Number;
use crate::io::remap::{Remap, Span};

impl Grid {
    /// The grid with only the voxels of `bounds`; all others become inactive and get the
    /// background's value.
    #[must_use]
    pub fn cropped(self, bounds: IndexBox) -> Self {
        with_tree!(self, tree => tree.rebuilt(bounds, &|value, active| (value, active)).into())
    }

    /// The grid with every active voxel whose value (or length) is below `least` made inactive and
    /// set to the background's value.
    #[must_use]
    pub fn without_below(self, least: f64) -> Self {
        with_tree!(self, tree => {
            let background = tree.background();
            tree.rebuilt(EVERYWHERE, &|value, active| {
                let below = active && measure(value) < least;
                if below { (background, false) } else { (value, active) }
            })
            .into()
        })
    }

    /// Vectors replaced by their length; other grids unchanged.
    #[must_use]
    pub fn magnitude(self) -> Self {
        match self {
            Self::Vec3s(tree) => Self::Float(tree.map(Value::to_f32)),
            Self::Vec3i(tree) => Self::Float(tree.map(Value::to_f32)),
            Self::Vec3d(tree) => Self::Double(tree.map(measure)),
            other => other,
        }
    }

    /// Properties of the background and the active values together.
    pub fn span(&self) -> Span {
        with_tree!(self, tree => {
            let of = |span: Span, value| with_parts(span, value);
            tree.active_values().fold(of(Span::EMPTY, tree.background()), |span, tile| of(span, tile.value))
        })
    }

    /// Checks that OpenVDB has grids like this one with numbers of type `to`.
    ///
    /// # Errors
    /// If it has none.
    pub fn check_type(&self, to: Number) -> Result<()> {
        use Number::{F16, F32, F64, I32, I64};
        let vector = matches!(self, Self::Vec3s(_) | Self::Vec3d(_) | Self::Vec3i(_));
        match to {
            F16 | F32 | F64 | I32 => Ok(()),
            I64 if !vector => Ok(()),
            _ if vector => Err(no_such_grids(to, "f16, f32, f64, i32 as vectors")),
            _ => Err(no_such_grids(to, "f16, f32, f64, i32, i64")),
        }
    }

    /// The same values as numbers of another type; `F16` becomes `F32`.
    ///
    /// # Errors
    /// If OpenVDB has no grids of such numbers.
    pub fn retyped(self, to: Number, remap: Remap) -> Result<Self> {
        let whole = to.limits().is_some();
        let number = |value: f64| remap.apply(value, whole);
        match self {
            // Converted through `f64`, which holds all but the last digits of 64-bit integers.
            Self::Float(tree) => scalar(tree.map(|value| number(value.into())), to),
            Self::Double(tree) => scalar(tree.map(number), to),
            Self::Half(tree) => scalar(tree.map(|value| number(value.into())), to),
            Self::Int32(tree) => scalar(tree.map(|value| number(value.into())), to),
            Self::Int64(tree) if to == Number::I64 && remap == Remap::Cast => Ok(tree.into()),
            Self::Int64(tree) => scalar(tree.map(|value| number(value as f64)), to),
            Self::Bool(tree) => scalar(tree.map(|value| number(value.component(0))), to),
            Self::Vec3s(tree) => vector(tree.map(|value| value.map(|x| number(x.into()))), to),
            Self::Vec3d(tree) => vector(tree.map(|value| value.map(number)), to),
            Self::Vec3i(tree) => vector(tree.map(|value| value.map(|x| number(x.into()))), to),
        }
    }
}

fn scalar(tree: Tree<f64>, to: Number) -> Result<Grid> {
    Ok(match to {
        Number::F16 | Number::F32 => tree.map(|value| value as f32).into(),
        Number::F64 => tree.into(),
        Number::I32 => tree.map(|value| value.round() as i32).into(),
        Number::I64 => tree.map(|value| value.round() as i64).into(),
        _ => return Err(no_such_grids(to, "f16, f32, f64, i32, i64")),
    })
}

fn vector(tree: Tree<[f64; 3]>, to: Number) -> Result<Grid> {
    Ok(match to {
        Number::F16 | Number::F32 => tree.map(|value| value.map(|x| x as f32)).into(),
        Number::F64 => tree.into(),
        Number::I32 => tree.map(|value| value.map(|x| x.round() as i32)).into(),
        _ => return Err(no_such_grids(to, "f16, f32, f64, i32 as vectors")),
    })
}

fn no_such_grids(to: Number, known: &str) -> Error {
    let why = format!("OpenVDB has no grids of {}, only of {known}", to.name());
    Error::value("type", why)
}

/// The value, or the length of a vector.
fn measure<T: Value>(value: T) -> f64 {
    match T::COMPONENTS {
        1 => value.component(0),
        count => (0..count).map(|part| value.component(part).powi(2)).sum::<f64>().sqrt(),
    }
}

fn with_parts<T: Value>(span: Span, value: T) -> Span {
    (0..T::COMPONENTS).fold(span, |span, part| span.with(value.component(part)))
}
