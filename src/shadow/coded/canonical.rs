//! Bounds on a distribution of which only moments are known: the canonical representation with a
//! prescribed point (the Hamburger and the trigonometric moment problem; Peters and Klein 2015,
//! Muenstermann et al. 2018). Of all distributions with the same moments it has the most mass at
//! that point; the mass in front of the point gives the sharpest possible bounds.
//!
//! Theory. Let v(z) = (1, z, ..., z^m), and let M be the mean of v(z) v(z)^H over the distribution,
//! which the moments give. With K(w, z) = v(w)^H M^-1 v(z), the representation's points are z0 and
//! the m roots of K(., z0), and the mass at a point z is 1 / K(z, z). Practice. The order is at
//! most 5. Arithmetic is in f64 and complex, also for power moments, where all numbers are real:
//! they take a small share of the time.

use rustfft::num_complex::Complex64;

/// Largest number of points.
const MOST: usize = 5;

/// v(z), as many elements as needed; the rest is 0.
type Vector = [Complex64; MOST];

/// The points of a representation with their masses, the prescribed point first. A point at
/// infinity has no mass, and neither has any point if no distribution has these moments.
pub(super) type Points = [(Complex64, f64); MOST];

/// The representation with the prescribed point `z0`, on the real line or on the unit circle, and
/// `order` (at most 4) other points, for a distribution whose matrix M has `element(row, column)`.
pub(super) fn representation(
    order: usize,
    element: impl Fn(usize, usize) -> Complex64,
    z0: Complex64,
) -> Points {
    let factor = Factor::of(order + 1, element);
    let polynomial = factor.solved(powers(order, z0));
    let mut points = [(z0, 0.0); MOST];
    let roots = roots(order, &polynomial.map(|c| c.conj()));
    for (point, root) in points.iter_mut().skip(1).zip(roots).take(order) {
        point.0 = root;
    }
    for (z, mass) in points.iter_mut().take(order + 1) {
        let v = powers(order, *z);
        let weight = 1.0 / factor.lower(v).iter().map(Complex64::norm_sqr).sum::<f64>();
        *mass = if weight.is_finite() { weight } else { 0.0 };
    }
    points
}

fn powers(order: usize, z: Complex64) -> Vector {
    let mut power = Complex64::ONE;
    std::array::from_fn(|i| {
        let this = if i <= order { power } else { Complex64::ZERO };
        power *= z;
        this
    })
}

/// The lower triangular factor L of M = L L^H (Cholesky).
struct Factor {
    size: usize,
    rows: [Vector; MOST],
}

impl Factor {
    fn of(size: usize, element: impl Fn(usize, usize) -> Complex64) -> Self {
        let mut rows = [[Complex64::ZERO; MOST]; MOST];
        for i in 0..size {
            for j in 0..=i {
                let known: Complex64 = (0..j).map(|k| rows[i][k] * rows[j][k].conj()).sum();
                let rest = element(i, j) - known;
                rows[i][j] = if i == j { rest.re.sqrt().into() } else { rest / rows[j][j] };
            }
        }
        Self { size, rows }
    }

    /// L^-1 v.
    fn lower(&self, mut v: Vector) -> Vector {
        for i in 0..self.size {
            let known: Complex64 = (0..i).map(|k| self.rows[i][k] * v[k]).sum();
            v[i] = (v[i] - known) / self.rows[i][i];
        }
        v
    }

    /// M^-1 v.
    fn solved(&self, v: Vector) -> Vector {
        let mut v = self.lower(v);
        for i in (0..self.size).rev() {
            let known: Complex64 = (i + 1..self.size).map(|k| self.rows[k][i].conj() * v[k]).sum();
            v[i] = (v[i] - known) / self.rows[i][i];
        }
        v
    }
}

/// The roots of a polynomial of degree `order`, lowest coefficient first, all at once (Aberth
/// 1973).
fn roots(order: usize, polynomial: &Vector) -> Vector {
    const MOST_ROUNDS: usize = 60;
    // Start anywhere but in symmetric positions.
    let mut roots: Vector = std::array::from_fn(|i| {
        Complex64::cis(std::f64::consts::TAU * i as f64 / order as f64 + 0.4)
    });
    for _ in 0..MOST_ROUNDS {
        let mut moved = 0.0_f64;
        for i in 0..order {
            let z = roots[i];
            let (mut value, mut slope) = (Complex64::ZERO, Complex64::ZERO);
            for &c in polynomial[..=order].iter().rev() {
                slope = slope * z + value;
                value = value * z + c;
            }
            let others = (0..order).filter(|&j| j != i);
            let push: Complex64 = others.map(|j| (z - roots[j]).inv()).sum();
            let step = value / (slope - value * push);
            if step.is_finite() {
                roots[i] -= step;
                moved = moved.max(step.norm_sqr() / roots[i].norm_sqr().max(1e-30));
            }
        }
        if moved < 1e-24 {
            break;
        }
    }
    roots
}
