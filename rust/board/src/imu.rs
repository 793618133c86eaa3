//! The sensor with a drift filter for each axis of its gyro.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use zerorate_core::{AutoFilter, AutoParams, RestLimits, Stream};

use crate::icm42688::{Fault, Icm42688};

/// Largest standard deviation of samples at rest, and largest bias, deg/s.
const REST: f64 = 10.0;
const BIAS: f64 = 20.0;

/// A gyro whose bias is learned at rest and subtracted.
#[derive(Debug)]
pub struct Imu<S> {
    sensor: Icm42688<S>,
    drift: [AutoFilter<f32>; 3],
}

impl<S: SpiDevice> Imu<S> {
    /// Starts the sensor. `rate` is the number of calls of [`Imu::rate`] per second.
    ///
    /// # Errors
    /// See [`Fault`].
    pub fn new(spi: S, delay: &mut impl DelayNs, rate: f64) -> Result<Self, Fault<S::Error>> {
        let sensor = Icm42688::new(spi, delay)?;
        let limits = RestLimits { rest: Some(REST), bias: Some(BIAS) };
        let filter = AutoFilter::new(AutoParams { rate, limits, ..AutoParams::default() });
        let drift = [filter.map_err(|_| Fault::Rate)?; 3];
        Ok(Self { sensor, drift })
    }

    /// Reads the next sample of the gyro and returns it without its bias, deg/s.
    ///
    /// # Errors
    /// The error of the bus; the filters then count a missing sample.
    pub fn rate(&mut self) -> Result<[f32; 3], S::Error> {
        let sample = self.sensor.sample();
        let gyro = sample.as_ref().map_or([f32::NAN; 3], |sample| sample.gyro);
        let mut rate = gyro;
        for (rate, filter) in rate.iter_mut().zip(&mut self.drift) {
            *rate = filter.update(*rate);
        }
        sample.map(|_| rate)
    }

    /// Bias of each axis and its standard deviation, deg/s.
    pub fn bias(&self) -> [[f32; 2]; 3] {
        self.drift.map(|filter| [filter.bias(), filter.bias_sigma()])
    }
}

#[cfg(test)]
mod tests {
    use core::convert::Infallible;
    use std::vec::Vec;

    use embedded_hal::spi::{ErrorType, Operation};

    use super::*;

    /// A resting sensor, with a bias of 20, -30 and 5 counts and noise of some counts.
    struct Resting {
        written: Vec<[u8; 2]>,
        seed: u32,
        identity: u8,
        invalid: bool,
    }

    impl Resting {
        fn new() -> Self {
            Self { written: Vec::new(), seed: 7, identity: 0x47, invalid: false }
        }

        fn noise(&mut self) -> i16 {
            self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            i16::try_from(self.seed >> 29).unwrap() - 4
        }

        fn registers(&mut self) -> [i16; 7] {
            let gyro = [20, -30, 5].map(|bias: i16| bias + self.noise());
            let x = if self.invalid { i16::MIN } else { gyro[0] };
            [0, 0, 0, 2048, x, gyro[1], gyro[2]]
        }
    }

    impl ErrorType for Resting {
        type Error = Infallible;
    }

    impl SpiDevice for &mut Resting {
        fn transaction(&mut self, steps: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
            match steps {
                [Operation::Write([register, value])] => self.written.push([*register, *value]),
                [Operation::Write([0xF5]), Operation::Read([identity])] => {
                    *identity = self.identity
                }
                [Operation::Write([0x9D]), Operation::Read(values)] => {
                    let bytes = self.registers().map(i16::to_be_bytes);
                    values.copy_from_slice(bytes.as_flattened());
                }
                other => panic!("not in the data sheet: {other:?}"),
            }
            Ok(())
        }
    }

    struct Patient(u64);

    impl DelayNs for Patient {
        fn delay_ns(&mut self, ns: u32) {
            self.0 += u64::from(ns);
        }
    }

    #[test]
    fn it_starts_as_the_data_sheet_says() {
        let (mut device, mut delay) = (Resting::new(), Patient(0));
        Imu::new(&mut device, &mut delay, 200.0).unwrap();
        assert_eq!(device.written, [[0x11, 1], [0x4F, 7], [0x50, 7], [0x4E, 0x0F]]);
        assert!(delay.0 >= 46_000_000);
    }

    #[test]
    fn another_device_is_refused() {
        let mut device = Resting { identity: 0x98, ..Resting::new() };
        let fault = Imu::new(&mut device, &mut Patient(0), 200.0).err();
        assert_eq!(fault, Some(Fault::Identity(0x98)));
    }

    #[test]
    fn a_bias_is_learned_and_taken_off() {
        let mut device = Resting::new();
        let mut imu = Imu::new(&mut device, &mut Patient(0), 200.0).unwrap();
        for _ in 0..12_000 {
            imu.rate().unwrap();
        }
        // The noise of whole counts from -4 to 3 has a mean of half a count.
        for ([bias, sigma], counts) in imu.bias().into_iter().zip([19.5, -30.5, 4.5]) {
            assert!((bias - counts * 2000.0 / 32768.0).abs() < 0.02, "{bias} of {counts} counts");
            assert!(sigma < 0.05);
        }
        assert!(imu.rate().unwrap().iter().all(|rate| rate.abs() < 0.3));
    }

    #[test]
    fn what_the_sensor_calls_invalid_is_a_missing_sample() {
        let mut device = Resting { invalid: true, ..Resting::new() };
        let mut sensor = Icm42688::new(&mut device, &mut Patient(0)).unwrap();
        let sample = sensor.sample().unwrap();
        assert!(sample.gyro[0].is_nan() && sample.gyro[1].is_finite());
        assert_eq!((sample.accel, sample.temperature), ([0.0, 0.0, 1.0], 25.0));
    }
}
