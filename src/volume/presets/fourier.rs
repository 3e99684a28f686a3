//! Fourier transforms of clouds, whose lengths are powers of two: by plans that fit the processor,
//! but in browsers by the one plan that suits all of these lengths, as the planner takes 140 KB of a
//! program.

use std::sync::Arc;

use rustfft::Fft;
use rustfft::num_complex::Complex;

pub(super) type Wave = Complex<f32>;

/// Transforms of one length, forward and back; neither divides by the length.
pub(super) struct Fourier {
    forward: Arc<dyn Fft<f32>>,
    back: Arc<dyn Fft<f32>>,
}

impl Fourier {
    /// Transforms of `length` waves, a power of two.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn of(length: usize) -> Self {
        let mut planner = rustfft::FftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
        Self { forward, back }
    }

    /// Transforms of `length` waves, a power of two.
    #[cfg(target_family = "wasm")]
    pub(super) fn of(length: usize) -> Self {
        use rustfft::FftDirection::{Forward, Inverse};
        use rustfft::algorithm::Radix4;
        let [forward, back] = [Forward, Inverse].map(|way| Arc::new(Radix4::new(length, way)));
        Self { forward, back }
    }

    /// Transforms each `length` of `waves`.
    pub(super) fn forward(&self, waves: &mut [Wave]) {
        self.forward.process(waves);
    }

    /// The way back.
    pub(super) fn back(&self, waves: &mut [Wave]) {
        self.back.process(waves);
    }
}

/// Transforms between real values and the first half of their waves, and one more.
#[cfg(not(target_family = "wasm"))]
pub(super) struct RealFourier {
    forward: Arc<dyn realfft::RealToComplex<f32>>,
    back: Arc<dyn realfft::ComplexToReal<f32>>,
}

#[cfg(not(target_family = "wasm"))]
impl RealFourier {
    /// Transforms of `length` values, a power of two.
    pub(super) fn of(length: usize) -> Self {
        let mut planner = realfft::RealFftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
        Self { forward, back }
    }

    /// The waves of `values`, which are overwritten.
    pub(super) fn forward(&self, values: &mut [f32], waves: &mut [Wave]) {
        // The only possible error is a wrong length, and the lengths are the plan's own.
        let _ = self.forward.process(values, waves);
    }

    /// The values of `waves`, which are overwritten; the first and the last of them are real.
    pub(super) fn back(&self, waves: &mut [Wave], values: &mut [f32]) {
        let _ = self.back.process(waves, values);
    }
}

/// Transforms between real values and the first half of their waves, and one more.
#[cfg(target_family = "wasm")]
pub(super) struct RealFourier(Fourier);

#[cfg(target_family = "wasm")]
impl RealFourier {
    /// Transforms of `length` values, a power of two.
    pub(super) fn of(length: usize) -> Self {
        Self(Fourier::of(length))
    }

    /// The waves of `values`.
    pub(super) fn forward(&self, values: &mut [f32], waves: &mut [Wave]) {
        let mut all: Vec<Wave> = values.iter().map(|&value| value.into()).collect();
        self.0.forward(&mut all);
        waves.copy_from_slice(&all[..waves.len()]);
    }

    /// The values of `waves`; the first and the last of them are real.
    pub(super) fn back(&self, waves: &mut [Wave], values: &mut [f32]) {
        let last = waves.len() - 1;
        let mirrored = waves[1..last].iter().rev().map(Wave::conj);
        let mut all: Vec<Wave> = waves.iter().copied().chain(mirrored).collect();
        self.0.back(&mut all);
        for (value, wave) in values.iter_mut().zip(all) {
            *value = wave.re;
        }
    }
}
