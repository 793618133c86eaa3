//! Wavelet denoising: of a whole record, and of a stream.
//!
//! A two-channel filter bank of Daubechies splits a signal into details of one octave each and an
//! approximation below them. White noise is equally strong in all octaves; a slow signal is only in
//! a few octaves. Details no larger than noise are removed.
//!
//! I. Daubechies, *Comm. Pure Appl. Math.* 41, 1988; D. L. Donoho, I. M. Johnstone, *Biometrika*
//! 81(3), 1994 (VisuShrink); J. Wu, C. Ran, *Instrument Technique and Sensor* 2021(2) (level by the
//! peak-to-sum ratio).

mod bank;
mod counting;
mod level;
mod median;
mod record;
mod streaming;
mod wavelet;

pub use level::LevelRule;
pub use record::{Denoised, Shrinkage, decompose};
pub use streaming::{WaveletDenoiser, WaveletParams};
pub use wavelet::{Mode, Wavelet};

/// The median distance of a normal variable from its mean.
const NORMAL_MEDIAN: f64 = 0.674_490;
