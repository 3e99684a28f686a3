//! Choices for the frames of a shot, made once for all of them, so that growth is seen and nothing
//! flickers.

use glam::{DQuat, DVec3};

use super::camera::{camera, eye, fits_shadow, fov_y_degrees, up};
use super::medium::Ingredients;
use super::{
    AMBIENT, Choice, Choices, Loaded, Surroundings, angles_of, aspect, bounds_of, complete, digits,
    ground, lights, lit_ground, mediums, short, usual_irradiance, visible,
};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::scene::file::{CameraTable, SceneFile, TransferRange, TransferTable, VolumeTable};
use crate::scene::framing::{middle_of, orbit, orbit_target, shown_points};
use crate::scene::keyframes::CameraKeyframe;
use crate::scene::saved::place;
use crate::scene::{Light, Medium, Projection};

/// Most directions of the camera for which a shot is framed.
const MOST_EYES: usize = 72;

/// What is seen of a shot before anything is chosen for it.
pub struct Shot<'a> {
    file: &'a SceneFile,
    /// Rising, at least one.
    frames: &'a [i64],
    surroundings: Surroundings,
    samples: Vec<Sample>,
}

/// What one frame would choose by itself.
struct Sample {
    file: SceneFile,
    /// By volume; `None` for those that are empty.
    volumes: Vec<Option<OfVolume>>,
    visible: Vec<DVec3>,
    map_size: u32,
    has_ground: bool,
}

struct OfVolume {
    density_scale: f64,
    window: Option<[f32; 2]>,
    /// Points and range of the transfer function over densities.
    function: Option<(Vec<[f64; 5]>, [f64; 2])>,
    /// Range of densities and scale of what glows.
    emission: Option<([f64; 2], f64)>,
}

impl<'a> Shot<'a> {
    /// A shot of the rising numbers `frames` of `file`, of which nothing is known yet.
    ///
    /// # Errors
    /// If there is no frame.
    pub fn new(file: &'a SceneFile, frames: &'a [i64], surroundings: Surroundings) -> Result<Self> {
        if frames.is_empty() {
            return Err(Error::value("frames", "there is none"));
        }
        Ok(Self { file, frames, surroundings, samples: Vec::new() })
    }

    /// Takes frame `frame` into account, for which `loaded` was loaded.
    ///
    /// # Errors
    /// As [`complete`].
    pub fn look_at(&mut self, frame: i64, loaded: &Loaded) -> Result<()> {
        let file = self.file.at_frame(frame)?;
        let (scene, settings, _) = complete(&file, loaded.clone(), self.surroundings)?;
        let mediums = mediums(&file, &loaded.volumes, &mut Choices(Vec::new()))?;
        let visible = visible(loaded, &mediums);
        let volumes = loaded.volumes.iter().zip(scene.media.bodies());
        let volumes = volumes.map(|(own, body)| OfVolume::of(own, &body.medium)).collect();
        let (map_size, has_ground) = (settings.map.size, scene.ground.is_some());
        self.samples.push(Sample { file, volumes, visible, map_size, has_ground });
        Ok(())
    }

    /// The scene file with everything chosen that its frames must have in common, and the choices.
    /// With `turns`, a camera that stands still goes once around what it looks at in so many
    /// frames, by keyframes.
    ///
    /// # Errors
    /// As [`complete`], if there is no sample, or if the camera both turns and has keyframes.
    pub fn chosen(&self, turns: Option<u32>) -> Result<(SceneFile, Vec<Choice>)> {
        let Some(first) = self.samples.first() else {
            return Err(Error::value("frames", "there is none to choose from"));
        };
        let mut file = self.file.clone();
        let fits_shadow = fits_shadow(&file.camera)?;
        let mut choices = Choices(Vec::new());
        let is_full = |sample: &&Sample| {
            sample.volumes.is_empty() || sample.volumes.iter().any(Option::is_some)
        };
        let full: Vec<&Sample> = self.samples.iter().filter(is_full).collect();
        let full = if full.is_empty() { self.samples.iter().collect() } else { full };
        let visible: Vec<DVec3> = full.iter().flat_map(|one| one.visible.iter().copied()).collect();
        let bounds = bounds_of(&visible);
        let irradiance = usual_irradiance(&first.file, self.surroundings);
        let usual = lights(&first.file, &bounds, irradiance, &mut choices)?;
        fix_lights(&mut file, &usual);
        let ground = if first.has_ground {
            ground(&file, &bounds, self.surroundings, &mut choices)?
        } else {
            if file.ground.enabled.is_none() {
                choices.took("ground (`ground.height`)", "none, seen from below".to_owned());
            }
            None
        };
        match ground {
            Some(ground) => {
                file.ground.height = Some(ground.height);
                file.ground.albedo = Some(ground.albedo);
            }
            None => file.ground.enabled = Some(false),
        }
        for index in 0..file.volume.len() {
            let of_volume =
                |sample: &&Sample| sample.volumes.get(index).is_some_and(Option::is_some);
            let of_volume = full.iter().filter(|sample| of_volume(sample));
            let seen: Vec<&OfVolume> =
                of_volume.filter_map(|sample| sample.volumes[index].as_ref()).collect();
            fix_volume(&mut file.volume[index], &seen, &mut choices);
        }
        let casts = ground.filter(|_| fits_shadow);
        let mut shown = Vec::new();
        for sample in &full {
            let own = lights(&sample.file, &bounds, irradiance, &mut Choices(Vec::new()))?;
            shown.extend(shown_points(&sample.visible, own.first(), casts));
        }
        self.fix_camera(&mut file, turns, (&visible, &shown), &mut choices)?;
        self.fix_surroundings(&mut file, &usual, ground, &bounds, &mut choices);
        if file.shadow.size.is_none() {
            file.shadow.size = self.samples.iter().map(|sample| sample.map_size).max();
        }
        Ok((file, choices.0))
    }

    fn fix_surroundings(
        &self,
        file: &mut SceneFile,
        usual: &[Light],
        ground: Option<crate::scene::Ground>,
        bounds: &Aabb,
        choices: &mut Choices,
    ) {
        if self.surroundings == Surroundings::Void {
            return;
        }
        if file.ambient.radiance.is_none() {
            choices.took("ambient radiance (ambient.radiance)", short(AMBIENT));
        }
        let ambient = file.ambient.radiance.map_or(AMBIENT, DVec3::from);
        file.ambient.radiance = Some(ambient.to_array());
        // It follows lights that move.
        let moves = file.light.iter().any(|table| table.keyframes.is_some());
        if file.background.radiance.is_none() && !moves {
            let lit = lit_ground(usual, ground, ambient, bounds.center());
            choices.took("background radiance (`background.radiance`)", short(lit));
            file.background.radiance = Some(lit.to_array());
        }
    }

    fn fix_camera(
        &self,
        file: &mut SceneFile,
        turns: Option<u32>,
        (visible, shown): (&[DVec3], &[DVec3]),
        choices: &mut Choices,
    ) -> Result<()> {
        let aspect = aspect(&super::computed::settings(file)?);
        let keyframes = file.camera.keyframes.clone().unwrap_or_default();
        if let Some(turns) = turns {
            if !keyframes.is_empty() {
                let why = "a camera with keyframes cannot also turn";
                return Err(Error::value("camera.keyframes or turntable", why));
            }
            self.turn(&mut file.camera, turns, visible);
        }
        let orbits = |one: &CameraKeyframe| {
            [one.azimuth_degrees, one.elevation_degrees, one.distance].iter().any(Option::is_some)
        };
        if file.camera.keyframes.iter().flatten().any(orbits) {
            return self.fix_orbit(file, (visible, shown), aspect, choices);
        }
        let table = file.at_frame(self.frames[0])?.camera;
        let chosen = camera(&table, (visible, shown), aspect, choices)?;
        let camera = &mut file.camera;
        (camera.azimuth_degrees, camera.elevation_degrees, camera.distance) = (None, None, None);
        camera.position = Some(chosen.position.to_array());
        camera.target = Some(chosen.target.to_array());
        camera.up = Some(chosen.up.to_array());
        if let Projection::Orthographic { height } = chosen.projection {
            camera.height = Some(height * table.zoom.unwrap_or(1.0));
        }
        Ok(())
    }

    /// Gives a camera keyframes with which it goes around once in `turns` frames: around its target,
    /// or around the middle of the volume if its position is given, so that the volume turns on the
    /// spot.
    fn turn(&self, camera: &mut CameraTable, turns: u32, visible: &[DVec3]) {
        let (first, last) = (self.frames[0], self.frames[self.frames.len() - 1]);
        let middle = middle_of(visible);
        if let Some(position) = camera.position {
            let target = camera.target.unwrap_or(middle.to_array());
            let keyframe = |frame: i64| {
                let share = frame.saturating_sub(first) as f64 / f64::from(turns);
                let turn = DQuat::from_rotation_y(std::f64::consts::TAU * share);
                let turned = |at: [f64; 3]| (middle + turn * (DVec3::from(at) - middle)).to_array();
                CameraKeyframe {
                    frame: Some(frame),
                    position: Some(turned(position)),
                    target: Some(turned(target)),
                    up: camera.up.map(|up| (turn * DVec3::from(up)).to_array()),
                    ..CameraKeyframe::default()
                }
            };
            camera.keyframes = Some(self.frames.iter().copied().map(keyframe).collect());
            return;
        }
        let azimuth = camera.azimuth_degrees.unwrap_or(angles_of(super::camera::EYE_DIRECTION)[0]);
        let turns = i64::from(turns);
        let rounds = last.saturating_sub(first) / turns + 1;
        let at = |round: i64| CameraKeyframe {
            frame: Some(first.saturating_add(round.saturating_mul(turns))),
            azimuth_degrees: Some(azimuth + 360.0 * round as f64),
            ..CameraKeyframe::default()
        };
        camera.keyframes = Some(vec![at(0), at(rounds)]);
    }

    /// Chooses target and distance of a camera that goes around, for all directions together.
    fn fix_orbit(
        &self,
        file: &mut SceneFile,
        (visible, shown): (&[DVec3], &[DVec3]),
        aspect: f64,
        choices: &mut Choices,
    ) -> Result<()> {
        let mut eyes = Vec::new();
        for &frame in self.frames.iter().step_by(self.frames.len().div_ceil(MOST_EYES)) {
            let table = file.at_frame(frame)?.camera;
            let eye = eye(&table)?.normalize_or(DVec3::Z);
            eyes.push((eye, up(&table, eye)?));
        }
        let table = file.at_frame(self.frames[0])?.camera;
        let fov = fov_y_degrees(&table)?;
        let target = match table.target {
            Some(target) => target.into(),
            None => {
                let target = orbit_target(shown, middle_of(visible), &eyes, fov, aspect);
                choices.took("camera target (`camera.target`)", short(target));
                target
            }
        };
        let (distance, height) = orbit(shown, target, &eyes, fov, aspect);
        let [_, elevation] = angles_of(eye(&table)?);
        let camera = &mut file.camera;
        camera.target = Some(target.to_array());
        camera.elevation_degrees = camera.elevation_degrees.or(Some(elevation));
        if table.distance.is_none() {
            choices.took("camera distance (camera.distance)", digits(distance));
            camera.distance = Some(distance);
        }
        if table.kind.as_deref() == Some("orthographic") && table.height.is_none() {
            choices.took("camera height (camera.height)", digits(height));
            camera.height = Some(height);
        }
        Ok(())
    }
}

impl OfVolume {
    fn of(own: &Ingredients, medium: &Medium) -> Option<Self> {
        let glows = own.emission_field.as_ref().is_some_and(|field| field.largest() > 0.0);
        if own.volume.typical_largest() == 0.0 && !glows {
            return None;
        }
        let function = own.function.as_ref().map(|function| {
            let point = |point: &crate::scene::transfer::TransferPoint| {
                let [r, g, b] = point.color.to_array();
                [point.value, r, g, b, point.opacity]
            };
            (function.points().iter().map(point).collect(), function.range())
        });
        let emission = medium.emission.as_ref().map(|emission| {
            let range = emission.ramp.range();
            let is_own = own.emission_field.is_none();
            (
                if is_own { range.map(|held| own.densities.density(held)) } else { range },
                emission.scale,
            )
        });
        let (density_scale, window) = (medium.density_scale, own.window);
        Some(Self { density_scale, window, function, emission })
    }
}

/// Fixes lights, as far as keyframes do not move them.
fn fix_lights(file: &mut SceneFile, usual: &[Light]) {
    file.light.one_mut();
    for (table, light) in file.light.iter_mut().zip(usual) {
        let given = table.clone();
        place(table, light.kind);
        let has = |key: fn(&crate::scene::keyframes::LightKeyframe) -> bool| {
            given.keyframes.iter().flatten().any(key)
        };
        // A spot light without direction follows the volume if it moves.
        if has(|one| one.direction.is_some() || one.position.is_some()) {
            (table.direction, table.position) = (given.direction, given.position);
        }
        table.irradiance = table.irradiance.or(Some(light.irradiance.to_array()));
    }
}

/// Fixes what is left out of a volume's table, by what its frames would choose.
fn fix_volume(table: &mut VolumeTable, seen: &[&OfVolume], choices: &mut Choices) {
    let windows: Vec<[f32; 2]> = seen.iter().filter_map(|one| one.window).collect();
    if table.window.is_none() && 2 * windows.len() > seen.len() {
        let end = |end: usize| median(windows.iter().map(|window| window[end].into())) as f32;
        let [low, high] = [end(0), end(1)];
        choices.took("window (`volume.window`)", format!("{low},{high}"));
        table.window = Some([low, high]);
    }
    let scale = |one: &&OfVolume| one.density_scale;
    let keyed = table.keyframes.iter().flatten().any(|one| one.density_scale.is_some());
    if table.density_scale.is_none() && !keyed {
        // Without it a frame would choose its own.
        let scale = if seen.is_empty() { 1.0 } else { median(seen.iter().map(scale)) };
        choices.took("density scale (`volume.density_scale`)", digits(scale));
        table.density_scale = Some(scale);
    }
    if let Some(transfer) = &mut table.transfer {
        fix_transfer(transfer, seen);
    }
    let emissions: Vec<([f64; 2], f64)> = seen.iter().filter_map(|one| one.emission).collect();
    if let Some(emission) = table.emission.as_mut().filter(|_| !emissions.is_empty()) {
        emission.range.get_or_insert_with(|| {
            let ends = emissions.iter().map(|([low, high], _)| (*low, *high));
            let (low, high) =
                ends.fold((f64::MAX, f64::MIN), |(low, high), (l, h)| (low.min(l), high.max(h)));
            [low, high]
        });
        emission.radiance = None;
        emission.scale.get_or_insert_with(|| {
            let scale = median(emissions.iter().map(|(_, scale)| *scale));
            choices.took("emission scale (volume.emission.scale)", digits(scale));
            scale
        });
    }
}

/// Fixes the range of a transfer function over which frames would spread it, and the function if
/// frames would choose it.
fn fix_transfer(table: &mut TransferTable, seen: &[&OfVolume]) {
    let functions: Vec<_> = seen.iter().filter_map(|one| one.function.as_ref()).collect();
    let Some((points, range)) = functions.get(functions.len() / 2) else { return };
    if table.name.as_deref() == Some("auto") {
        (table.name, table.points) = (None, Some(points.clone()));
        table.range = Some(TransferRange::Values(*range));
    } else if !matches!(table.range, Some(TransferRange::Values(_))) {
        let end = |end: usize| median(functions.iter().map(|(_, range)| range[end]));
        let [low, high] = [end(0), end(1)];
        table.range = (low < high).then_some(TransferRange::Values([low, high]));
    }
}

/// The middle one of some numbers, or the lower one of two; 0 for none.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len().saturating_sub(1) / 2).copied().unwrap_or_default()
}
