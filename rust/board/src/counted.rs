//! Filters for measurements on a board, from C: time per sample, and distance of `f32` from `f64`.
#![allow(unsafe_code)] // A name that C finds is called unsafe; nothing else here is.

use zerorate_core::attitude::{Attitude, AttitudeParams, Auto, AutoOptions, Frame, Sample};
use zerorate_core::{AutoFilter, AutoParams, Stream};

/// Runs a filter over `samples` samples of its own noise and returns a number that depends on all
/// of them. Filter 0 is the noise alone, 1 the drift filter of `f64`, 2 of `f32`, 3 an attitude of
/// six axes, 4 of nine; NaN for other numbers.
#[unsafe(no_mangle)]
pub extern "C" fn board_run(which: u32, samples: u32) -> f64 {
    let mut noise = Noise(7);
    match which {
        0 => (0..samples).map(|_| noise.next()).sum(),
        1 => drift_f64(samples, &mut noise),
        2 => f64::from(drift_f32(samples, &mut noise)),
        3 | 4 => attitude(samples, which == 4, &mut noise),
        _ => f64::NAN,
    }
}

struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / 16_777_216.0 - 0.5
    }
}

fn drift_f64(samples: u32, noise: &mut Noise) -> f64 {
    let params = AutoParams { rate: 100.0, ..AutoParams::default() };
    let Ok(mut filter) = AutoFilter::<f64>::new(params) else { return f64::NAN };
    for _ in 0..samples {
        filter.update(0.5 + noise.next());
    }
    filter.bias()
}

fn drift_f32(samples: u32, noise: &mut Noise) -> f32 {
    let params = AutoParams { rate: 100.0, ..AutoParams::default() };
    let Ok(mut filter) = AutoFilter::<f32>::new(params) else { return f32::NAN };
    for _ in 0..samples {
        filter.update((0.5 + noise.next()) as f32);
    }
    filter.bias()
}

fn attitude(samples: u32, mag: bool, noise: &mut Noise) -> f64 {
    let Ok(auto) = Auto::new(AutoOptions { mag, ..AutoOptions::default() }) else {
        return f64::NAN;
    };
    let frame = Frame::Enu;
    let params = AttitudeParams {
        rate: 100.0,
        frame,
        mag,
        gyro_unit: 1.0,
        accel_unit: 1.0,
        gyro_range: None,
    };
    let Ok(mut attitude) = Attitude::new(params, auto) else { return f64::NAN };
    let mut last = [f64::NAN; 4];
    for _ in 0..samples {
        let mut about = |mean: f64, size: f64| mean + size * noise.next();
        let gyro = [about(0.01, 0.01), about(-0.02, 0.01), about(0.005, 0.01)];
        let accel = [about(0.0, 0.1), about(0.0, 0.1), about(9.81, 0.1)];
        let mag = if mag { [about(0.0, 0.1), 20.0, -40.0] } else { [f64::NAN; 3] };
        last = attitude.update(Sample { gyro, accel, mag, dt: f64::NAN });
    }
    last[0]
}

#[cfg(test)]
mod tests {
    use super::board_run;

    /// A thousandth of the deviation that an hour leaves of white noise alone, 0.29 / sqrt(360000).
    const CLOSE: f64 = 5e-7;

    #[test]
    fn the_drift_of_f32_is_that_of_f64() {
        for samples in [3_000, 60_000, 360_000] {
            let (double, single) = (board_run(1, samples), board_run(2, samples));
            assert!((double - single).abs() < CLOSE, "{samples}: {double} {single}");
        }
    }
}
