//! The camera as a view like a light's, so that surfaces are drawn into pictures as into maps.

use glam::{DMat3, DVec3, Vec3, Vec4, Vec4Swizzles};

use super::{Frame, FrameLight, FrameView};

impl Frame {
    /// The same frame with the camera in the light's place, and in the map's place a square whose
    /// upper left part is the picture: its texels are pixels, as many along each edge as the picture
    /// has along its longer one. Depths are distances along the camera's rays.
    #[must_use]
    pub fn from_camera(mut self) -> Self {
        let FrameView { width, height, .. } = self.view;
        let size = width.max(height);
        self.map.size = size;
        self.map.covers = 1;
        self.light = camera(
            &self.view,
            [width, height].map(|n| f64::from(size) / f64::from(n)),
            &self.light,
        );
        self
    }
}

/// The camera in the place of `light`; the square is `across` and `down` times as large as the
/// picture.
fn camera(view: &FrameView, [across, down]: [f64; 2], light: &FrameLight) -> FrameLight {
    let wide = |v: Vec4| v.xyz().as_dvec3();
    let is_parallel = view.direction_x.xyz() == Vec3::ZERO && view.direction_y.xyz() == Vec3::ZERO;
    let origin = wide(view.origin);
    // A point is the origin plus x times the first axis plus y times the second plus s times the
    // third; with perspective, x and y are multiplied by s as well.
    let axes = if is_parallel {
        [view.origin_x, view.origin_y, view.direction].map(wide)
    } else {
        [view.direction_x, view.direction_y, view.direction].map(wide)
    };
    let inverse = DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array())).inverse();
    let row = |i: usize, scale: f64| {
        let row = inverse.row(i) * scale;
        row.extend(-row.dot(origin)).as_vec4()
    };
    let [u, v, along] = [row(0, across.recip()), row(1, down.recip()), row(2, 1.0)];
    let scaled = |v: Vec4, by: f64| (wide(v) * by).as_vec3().extend(0.0);
    FrameLight {
        origin: view.origin,
        origin_u: scaled(view.origin_x, across),
        origin_v: scaled(view.origin_y, down),
        direction: if is_parallel {
            wide(view.direction).normalize_or(DVec3::NEG_Z).as_vec3().extend(0.0)
        } else {
            view.direction
        },
        direction_u: scaled(view.direction_x, across),
        direction_v: scaled(view.direction_y, down),
        from_frame: if is_parallel { [u, v, along, Vec4::W] } else { [u, v, along, along] },
        position: view.origin.xyz(),
        spread: u32::from(!is_parallel),
        ..*light
    }
}
