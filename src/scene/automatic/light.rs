//! The lights of a scene file, and how bright they are where that is left out.

use std::f64::consts::PI;

use glam::DVec3;

use super::chosen::{Choices, short};
use super::{Surroundings, finite, radiance_of};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::scene::file::{LightTable, SceneFile};
use crate::scene::{Light, LightKind};

/// The direction of the light: from the upper left, over the camera's shoulder.
const LIGHT_DIRECTION: DVec3 = DVec3::new(0.64, -0.72, -0.27);

/// The irradiance of lights that do not say theirs: a fully lit white medium has radiance 1. In a
/// studio, white surfaces alone have that too, and where there are both, they are twice as bright and
/// media half as bright.
pub(super) fn usual_irradiance(file: &SceneFile, surroundings: Surroundings) -> f64 {
    match (surroundings, file.has_surfaces(), file.volume.is_empty()) {
        (Surroundings::Void, ..) | (_, false, _) => Light::UNIT_IRRADIANCE,
        (_, _, true) => PI,
        (_, _, false) => 2.0 * PI,
    }
}

/// The lights of `file`, of which one is chosen if it has none, around a scene of these bounds.
/// Where they are omitted, irradiances there are `irradiance`.
pub(super) fn lights(
    file: &SceneFile,
    bounds: &Aabb,
    irradiance: f64,
    choices: &mut Choices,
) -> Result<Vec<Light>> {
    let usual = [LightTable::default()];
    let lights = if file.light.is_empty() { &usual[..] } else { &file.light };
    lights.iter().map(|table| light(table, bounds, irradiance, choices)).collect()
}

fn light(
    table: &LightTable,
    bounds: &Aabb,
    irradiance: f64,
    choices: &mut Choices,
) -> Result<Light> {
    let vector = |key: &str, given: [f64; 3]| finite(&format!("light.{key}"), given);
    let kind = match kind_of(table) {
        "directional" => LightKind::Directional {
            direction: match table.direction {
                Some(given) => vector("direction", given)?,
                None => {
                    let direction = LIGHT_DIRECTION.normalize();
                    choices.took("light direction (`light.direction`)", short(direction));
                    direction
                }
            },
        },
        kind @ ("point" | "spot") => {
            let Some(position) = table.position else {
                return Err(Error::value("light.position", format!("a {kind} light needs one")));
            };
            let position = vector("position", position)?;
            if kind == "point" {
                LightKind::Point { position }
            } else {
                spot(table, position, bounds, choices)?
            }
        }
        other => {
            let why = format!("'{other}' is not one of directional, point, spot");
            return Err(Error::value("light.kind", why));
        }
    };
    if let LightKind::Directional { direction } | LightKind::Spot { direction, .. } = kind
        && direction.length_squared() == 0.0
    {
        return Err(Error::value("light.direction", "0, 0, 0 has no direction"));
    }
    let mut light = Light { kind, irradiance: DVec3::splat(irradiance) };
    if let Some(irradiance) = table.irradiance {
        light.irradiance = radiance_of("light.irradiance", irradiance)?;
    } else if let Some(position) = light.position() {
        // A light inside the bounds is as bright half an edge away.
        let among = position.cmpge(bounds.min).all() && position.cmple(bounds.max).all();
        let least = if among { 0.5 * bounds.size().max_element() } else { 0.0 };
        light.irradiance *= (position - bounds.center()).length().max(least).powi(2);
        choices.took("light irradiance at distance 1 (light.irradiance)", short(light.irradiance));
    } else if irradiance != Light::UNIT_IRRADIANCE {
        choices.took("light irradiance (light.irradiance)", short(light.irradiance));
    }
    Ok(light)
}

/// The kind of a light, which tables that have a place or a cone need not say.
fn kind_of(table: &LightTable) -> &str {
    match &table.kind {
        Some(kind) => kind,
        None if table.cone_degrees.is_some() => "spot",
        None if table.position.is_some() && table.direction.is_none() => "point",
        None => "directional",
    }
}

fn spot(
    table: &LightTable,
    position: DVec3,
    bounds: &Aabb,
    choices: &mut Choices,
) -> Result<LightKind> {
    let direction = match table.direction {
        Some(given) => finite("light.direction", given)?,
        None => {
            let direction = (bounds.center() - position).normalize_or(DVec3::NEG_Y);
            choices.took("light direction (light.direction)", short(direction));
            direction
        }
    };
    let cone_degrees = table.cone_degrees.unwrap_or(30.0);
    if !(cone_degrees > 0.0 && cone_degrees < 90.0) {
        let why = format!("{cone_degrees} is not between 0 and 90 (axis to edge)");
        return Err(Error::value("light.cone_degrees", why));
    }
    let cone_softness = table.cone_softness.unwrap_or(0.2);
    if !(0.0..=1.0).contains(&cone_softness) {
        let why = format!("{cone_softness} is not between 0 and 1");
        return Err(Error::value("light.cone_softness", why));
    }
    Ok(LightKind::Spot { position, direction, cone_degrees, cone_softness })
}
