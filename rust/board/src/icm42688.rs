//! Driver of a TDK InvenSense ICM-42688-P on SPI, after its data sheet DS-000347.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};

/// Bit in the address of a register that is read.
const READ: u8 = 0x80;

const DEVICE_CONFIG: u8 = 0x11;
const TEMP_DATA1: u8 = 0x1D;
const PWR_MGMT0: u8 = 0x4E;
const GYRO_CONFIG0: u8 = 0x4F;
const ACCEL_CONFIG0: u8 = 0x50;
const WHO_AM_I: u8 = 0x75;

const IDENTITY: u8 = 0x47;
const RESET: u8 = 0x01;
/// Low-noise mode of gyro and accelerometer.
const LOW_NOISE: u8 = 0x0F;
/// Setting for 200 samples per second; combined with 2000 deg/s and 16 g.
const RATE_200: u8 = 0x07;

/// deg/s and g per count.
const DEGREES: f32 = 2000.0 / 32768.0;
const GRAVITIES: f32 = 16.0 / 32768.0;
/// Value of a register without a sample.
const INVALID: i16 = i16::MIN;

/// Fault of a board and its sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault<E> {
    /// Error of the SPI.
    Spi(E),
    /// Another device answers, with this identity.
    Identity(u8),
    /// The drift filter refuses the rate.
    Rate,
}

impl<E> From<E> for Fault<E> {
    fn from(error: E) -> Self {
        Self::Spi(error)
    }
}

/// Sample of the sensor; NaN for missing values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Angular rate about x, y, z, deg/s.
    pub gyro: [f32; 3],
    /// Specific force along x, y, z, g.
    pub accel: [f32; 3],
    /// Temperature, degC.
    pub temperature: f32,
}

/// The sensor, at 200 samples per second, 2000 deg/s and 16 g.
#[derive(Debug)]
pub struct Icm42688<S> {
    spi: S,
}

impl<S: SpiDevice> Icm42688<S> {
    /// Resets the sensor, checks its identity, and starts it.
    ///
    /// # Errors
    /// [`Fault::Identity`] if it is another device, [`Fault::Spi`] if the bus fails.
    pub fn new(spi: S, delay: &mut impl DelayNs) -> Result<Self, Fault<S::Error>> {
        let mut sensor = Self { spi };
        sensor.write(DEVICE_CONFIG, RESET)?;
        delay.delay_ms(2);
        let identity = sensor.read::<1>(WHO_AM_I)?[0];
        if identity != IDENTITY {
            return Err(Fault::Identity(identity));
        }
        sensor.write(GYRO_CONFIG0, RATE_200)?;
        sensor.write(ACCEL_CONFIG0, RATE_200)?;
        sensor.write(PWR_MGMT0, LOW_NOISE)?;
        // Nothing may be written for 200 us; the gyro takes 30 ms to start.
        delay.delay_ms(45);
        Ok(sensor)
    }

    /// Reads the last sample.
    ///
    /// # Errors
    /// The error of the bus.
    pub fn sample(&mut self) -> Result<Sample, S::Error> {
        let raw = self.read::<14>(TEMP_DATA1)?;
        let count = |i: usize| i16::from_be_bytes([raw[2 * i], raw[2 * i + 1]]);
        let scaled = |i: usize, unit: f32| match count(i) {
            INVALID => f32::NAN,
            counts => f32::from(counts) * unit,
        };
        let axes = |first: usize, unit: f32| [0, 1, 2].map(|axis| scaled(first + axis, unit));
        let (accel, gyro) = (axes(1, GRAVITIES), axes(4, DEGREES));
        Ok(Sample { gyro, accel, temperature: scaled(0, 1.0 / 132.48) + 25.0 })
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), S::Error> {
        self.spi.write(&[register, value])
    }

    fn read<const N: usize>(&mut self, register: u8) -> Result<[u8; N], S::Error> {
        let mut values = [0; N];
        let address = [register | READ];
        self.spi.transaction(&mut [Operation::Write(&address), Operation::Read(&mut values)])?;
        Ok(values)
    }
}
