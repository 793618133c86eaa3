//! The filter as a stream of events: samples of the sensors, fixes, and readings of aids.

use super::aids::{Aid, Reading};
use super::covariance::STATES;
use super::filter::{Inertial, NavigationFilter, Snapshot};
use super::fix::Fix;
use crate::stream::{Field, Input, Output, Shape, Stream};

/// A sample of the sensors, a fix of the receiver, or a reading of an aid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A sample of gyro and accelerometer.
    Sample(Inertial),
    /// A fix of the receiver.
    Fix(Fix),
    /// A reading of an aid.
    Aid(Aid),
}

impl Input for Event {
    /// Numbers of an event: kind and time, then its values. A sample (0) has rate, force and flag
    /// of rest. A fix (1) has position, velocity and their standard deviations. A height (2),
    /// pressure (3), heading (4) or baseline (5) has the reading, its standard deviations and the
    /// baseline in body axes, NaN for the default.
    const NUMBERS: usize = 14;

    #[inline(always)]
    fn read(numbers: &[f64]) -> Self {
        let part = |i: usize| [numbers[i], numbers[i + 1], numbers[i + 2]];
        let (time, first, second) = (numbers[1], part(2), part(5));
        if numbers[0] > 1.0 {
            let known = baseline_of(part(8));
            let reading = match numbers[0] as u8 {
                2 => Reading::Height(first[0]),
                3 => Reading::Pressure(first[0]),
                4 => Reading::Heading(first[0]),
                _ => Reading::Baseline(first, known),
            };
            return Self::Aid(Aid { time, reading, sigma: second });
        }
        if numbers[0] > 0.0 {
            let (position_sigma, velocity_sigma) = (part(8), part(11));
            let (position, velocity) = (first, second);
            return Self::Fix(Fix { time, position, velocity, position_sigma, velocity_sigma });
        }
        let rest = numbers[8] > 0.0;
        Self::Sample(Inertial { time, gyro: first, accel: second, rest })
    }
}

/// The baseline, `None` if it is missing.
fn baseline_of(baseline: [f64; 3]) -> Option<[f64; 3]> {
    Some(baseline).filter(|baseline| baseline.iter().all(|x| !x.is_nan()))
}

const fn field(name: &'static str, numbers: usize) -> Field {
    Field { name, shape: Shape::Vector(numbers) }
}

impl Output for Snapshot {
    const FIELDS: &'static [Field] = &[
        field("position", 3),
        field("velocity", 3),
        field("quaternion", 4),
        field("gyro_bias", 3),
        field("accel_bias", 3),
        field("sigma", STATES),
        Field { name: "status", shape: Shape::Number },
        Field { name: "usable", shape: Shape::Number },
    ];

    #[inline(always)]
    fn write(self, numbers: &mut [f64], _: &mut [bool]) {
        let parts: [&[f64]; 8] = [
            &self.position,
            &self.velocity,
            &self.quaternion,
            &self.gyro_bias,
            &self.accel_bias,
            &self.sigma,
            &[f64::from(self.status as u8)],
            &[f64::from(self.usable)],
        ];
        for (slot, number) in numbers.iter_mut().zip(parts.into_iter().flatten()) {
            *slot = *number;
        }
    }
}

impl Stream for NavigationFilter {
    type Input = Event;
    type Output = Snapshot;

    /// An invalid event changes nothing, for example a sample that is not later than the last
    /// sample.
    #[inline]
    fn update(&mut self, event: Event) -> Snapshot {
        // An invalid event is refused before anything has changed.
        let _refused = match event {
            Event::Sample(sample) => Self::update(self, &sample).is_err(),
            Event::Fix(fix) => self.update_gnss(&fix).is_err(),
            Event::Aid(aid) => self.update_aid(&aid).is_err(),
        };
        self.snapshot()
    }

    fn reset(&mut self) {
        Self::reset(self);
    }
}
