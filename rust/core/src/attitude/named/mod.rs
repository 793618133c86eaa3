//! Named textbook methods, as published, with two safeguards. No input leads to NaN, and each
//! method starts from the first force and the first field instead of the identity.
//!
//! A magnetometer corrects only the heading, except in [`Madgwick`], which uses the field as a
//! vector. No method detects rest, motion or a disturbed field.

mod body;
mod complementary;
mod extended;
mod kalman;
mod madgwick;
mod mahony;
mod options;
mod unscented;

pub use complementary::Complementary;
pub use kalman::{Ekf, Kalman, Linearised, Ukf};
pub use madgwick::Madgwick;
pub use mahony::Mahony;
pub use options::{
    BIAS_METHODS, BIAS_SIGMA_METHODS, CONSTANTS, Constant, Constants, METHODS, NamedOptions,
};

use super::auto::{Auto, AutoOptions};
use super::compass::FieldCorrection;
use super::iron::LearnedIron;
use super::stream::Tagged;

/// A method with a name and options.
pub trait Named: Tagged {
    /// Name of the method, as people write it.
    const METHOD: &'static str;

    /// Options of the method.
    fn options(&self) -> NamedOptions;

    /// True if scale and misalignment of the gyro were given, too.
    fn is_calibrated(&self) -> bool {
        false
    }

    /// Largest bias of the gyro, rad/s, if it is not the default.
    fn bias_limit(&self) -> Option<f64> {
        None
    }

    /// Correction of the magnetometer before all other steps.
    fn correction(&self) -> Option<&FieldCorrection> {
        None
    }

    /// Hard iron that the method learns, if it learns.
    fn iron(&self) -> Option<LearnedIron> {
        None
    }
}

impl Named for Auto {
    const METHOD: &'static str = METHODS[0];

    fn options(&self) -> NamedOptions {
        let AutoOptions { mag, bias, bias_sigma, .. } = *self.options();
        NamedOptions { mag, bias, bias_sigma, constants: Constants::default() }
    }

    fn is_calibrated(&self) -> bool {
        let (given, usual) = (self.options(), AutoOptions::default());
        (given.matrix, given.matrix_sigma) != (usual.matrix, usual.matrix_sigma)
    }

    fn bias_limit(&self) -> Option<f64> {
        let given = self.options().bias_limit;
        (given != AutoOptions::default().bias_limit).then_some(given)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        CONSTANTS, Complementary, Constants, Ekf, Madgwick, Mahony, Named, NamedOptions, Ukf,
    };
    use crate::attitude::sample::Inertial;
    use crate::error::Error;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// Any sample that the stream passes on.
    fn sample() -> impl Strategy<Value = Inertial> {
        let vector = |most: f64| {
            let size = prop_oneof![Just(-9.0), Just(most), -9.0..most];
            (size, prop::array::uniform3(-1.0..1.0_f64)).prop_filter_map("a length", |(size, v)| {
                let direction = Vector3::from(v).try_normalize(1e-3)?;
                Some(direction * (10.0_f64.powf(size) * (1.0 - 1e-12)))
            })
        };
        let force = prop::option::weighted(0.8, vector(3.0));
        let field = prop::option::weighted(0.8, vector(9.0));
        let dt = prop_oneof![Just(0.0), Just(1.0), Just(0.01), 1e-9..1.0_f64];
        (vector(3.0), force, field, dt, prop::bool::weighted(0.9)).prop_map(
            |(gyro, accel, mag, dt, known)| {
                let unknown = if known { 0.0 } else { dt };
                Inertial { gyro, known, unknown, age: unknown, accel, mag, dt }
            },
        )
    }

    /// Constants at the ends of their ranges, and the defaults.
    fn options() -> impl Strategy<Value = NamedOptions> {
        let ends = prop::collection::vec(0..3_usize, CONSTANTS.len());
        (any::<bool>(), ends).prop_map(|(mag, ends)| {
            let mut constants = Constants::default();
            for (row, end) in CONSTANTS.iter().zip(ends) {
                if end < 2 {
                    (row.set)(&mut constants, row.range[end]);
                }
            }
            NamedOptions { mag, constants, ..NamedOptions::default() }
        })
    }

    fn stays_valid<E: Named + core::fmt::Debug>(
        filter: Result<E, Error>,
        samples: &[Inertial],
    ) -> Result<(), TestCaseError> {
        let mut filter = filter.expect("options within their ranges");
        for (k, sample) in samples.iter().enumerate() {
            filter.step(sample);
            if k % 17 == 11 {
                filter.gap(1e3);
            }
            let known = filter.knowledge();
            prop_assert!((filter.orientation().norm() - 1.0).abs() < 1e-9, "{k}: {sample:?}");
            prop_assert!(filter.is_valid(), "{} at {k}: {filter:?}", E::METHOD);
            prop_assert!(!known.tilt_sigma.is_infinite() && !known.heading_sigma.is_infinite());
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn no_sample_makes_an_invalid_state(
            options in options(),
            samples in prop::collection::vec(sample(), 1..120),
        ) {
            stays_valid(Complementary::new(options), &samples)?;
            stays_valid(Mahony::new(options), &samples)?;
            stays_valid(Madgwick::new(options), &samples)?;
            stays_valid(Ekf::new(options), &samples)?;
            stays_valid(Ukf::new(options), &samples)?;
        }

        #[test]
        fn a_constant_beyond_its_range_is_refused(row in 0..CONSTANTS.len(), over in any::<bool>()) {
            let (row, mut options) = (&CONSTANTS[row], NamedOptions::default());
            let value = if over { row.range[1] * 1.1 } else { row.range[0] - 1e-13 };
            (row.set)(&mut options.constants, value);
            let error = Error::Parameter { name: row.name, expected: row.expected, value };
            prop_assert_eq!(Ekf::new(options).err(), Some(error));
        }
    }
}
