//! Shadow maps once they are built, behind one small interface: transmittance at (texel, depth).
//! Knows neither how maps are built nor where they are kept.

mod threshold;

pub use threshold::ThresholdMap;

/// A map of transmittance over depth, seen from a light: N x N texels, (u, v) in 0..1, row 0 at
/// v = 0.
pub trait ShadowMap: Sync {
    /// Texels along each edge.
    fn size(&self) -> u32;

    /// Transmittance along the central ray of texel (`x`, `y`) from the light to `depth`, in 0..1.
    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32;

    /// Transmittance at (u, v, depth) from the texel that holds the point; 1 outside of the map.
    fn nearest(&self, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let n = self.size();
        let texel = |c: f32| ((c * n as f32) as u32).min(n - 1);
        self.texel_transmittance(texel(u), texel(v), depth)
    }

    /// Transmittance at (u, v, depth), bilinear between the four nearest texels' transmittances (a
    /// depth of one texel means nothing in another, so depths are never mixed); 1 outside of the
    /// map, clamped within half a texel of its edge.
    fn bilinear(&self, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let last = self.size() - 1;
        let place = |c: f32| {
            let c = (c * self.size() as f32 - 0.5).clamp(0.0, last as f32);
            (c as u32, (c as u32 + 1).min(last), c.fract())
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (place(u), place(v));
        let row = |y: u32| {
            let left = self.texel_transmittance(x0, y, depth);
            let right = self.texel_transmittance(x1, y, depth);
            left + (right - left) * fx
        };
        let (upper, lower) = (row(y0), row(y1));
        upper + (lower - upper) * fy
    }
}

fn inside(u: f32, v: f32) -> bool {
    (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)
}
