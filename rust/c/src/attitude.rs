//! Attitude.

use core::ffi::{c_char, c_void};

use zerorate_core::attitude::{Attitude, AttitudeParams, Auto, AutoOptions, Frame, Sample};
use zerorate_core::{Error, Stream, checkpoint};

use crate::code::{Text, answer, zr_code};
use crate::memory;

/// Size of a static buffer for a `zr_attitude`, in bytes.
pub const ZR_ATTITUDE_MEMORY: usize = 6144;
/// Size of a buffer for the checkpoint of a `zr_attitude`, in bytes.
pub const ZR_ATTITUDE_CHECKPOINT: usize = 5120;

const _: () = assert!(size_of::<zr_attitude>() <= ZR_ATTITUDE_MEMORY);

/// Axes of the earth.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_frame {
    /// East, north, up.
    ZR_ENU = 0,
    /// North, east, down.
    ZR_NED = 1,
    /// North, west, up.
    ZR_NWU = 2,
}

/// Parameters of an attitude. Zero means the default for every parameter except the rate.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct zr_attitude_params {
    /// Samples per second, at least one.
    pub rate: f64,
    /// A `zr_frame`.
    pub frame: i32,
    /// Not zero: there is a magnetometer. Zero: there is none, and the initial heading is zero.
    pub mag: i32,
    /// Size of the gyro's unit, rad/s; zero: 1.
    pub gyro_unit: f64,
    /// Size of the accelerometer's unit, m/s²; zero: 1.
    pub accel_unit: f64,
    /// Known output of the gyro without rotation, rad/s.
    pub bias: [f64; 3],
    /// Standard deviation of `bias`, rad/s; zero: 1 deg/s.
    pub bias_sigma: [f64; 3],
    /// Largest possible bias of the gyro, rad/s; zero: 10 deg/s.
    pub bias_limit: f64,
    /// Range of the gyro, in its unit; zero: unknown. A rate beyond the range is missing.
    pub gyro_range: f64,
}

/// Status of an attitude.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_attitude_status {
    /// The first seconds.
    ZR_ATTITUDE_STARTING = 0,
    /// The gyro has had no sample for more than 50 ms.
    ZR_ATTITUDE_RATE_MISSING = 1,
    /// The force at rest is not gravity: the accelerometer's unit is wrong.
    ZR_ATTITUDE_WRONG_UNIT = 2,
    /// The magnetic field is not the known field.
    ZR_ATTITUDE_DISTURBED = 3,
    /// The sensor rests.
    ZR_ATTITUDE_AT_REST = 4,
    /// The sensor moves.
    ZR_ATTITUDE_MOVING = 5,
    /// A rate is at the gyro's range.
    ZR_ATTITUDE_CLIPPED = 6,
    /// Gravity turns in the sensor as if the gyro had a different unit.
    ZR_ATTITUDE_WRONG_RATE_UNIT = 7,
    /// The magnetometer repeats one value while the sensor turns.
    ZR_ATTITUDE_MAGNETOMETER_STUCK = 8,
    /// The sensor rests with a bias beyond `bias_limit`, or is on a rate table.
    ZR_ATTITUDE_UNCLEAR = 9,
}

impl zr_attitude_status {
    fn of(words: &str) -> Self {
        match words {
            "starting" => Self::ZR_ATTITUDE_STARTING,
            "rate missing" => Self::ZR_ATTITUDE_RATE_MISSING,
            "wrong unit" => Self::ZR_ATTITUDE_WRONG_UNIT,
            "disturbed" => Self::ZR_ATTITUDE_DISTURBED,
            "at rest" => Self::ZR_ATTITUDE_AT_REST,
            "clipped" => Self::ZR_ATTITUDE_CLIPPED,
            "wrong unit?" => Self::ZR_ATTITUDE_WRONG_RATE_UNIT,
            "magnetometer stuck" => Self::ZR_ATTITUDE_MAGNETOMETER_STUCK,
            "at rest, or on a rate table: bias_limit" => Self::ZR_ATTITUDE_UNCLEAR,
            _ => Self::ZR_ATTITUDE_MOVING,
        }
    }
}

/// State after a sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct zr_attitude_state {
    /// Quaternion from the sensor's axes to the earth's axes: w, x, y, z.
    pub quaternion: [f64; 4],
    /// Roll, pitch and yaw, rad.
    pub euler: [f64; 3],
    /// Direction of the sensor's x axis over ground, clockwise from north, rad.
    pub heading: f64,
    /// Standard deviation of the angle between true and estimated vertical, rad.
    pub tilt_sigma: f64,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f64,
    /// Output of the gyro without rotation, in its unit.
    pub bias: [f64; 3],
    /// Standard deviation of `bias`.
    pub bias_sigma: [f64; 3],
    /// Specific force without gravity, in the accelerometer's axes and unit.
    pub linear_acceleration: [f64; 3],
    /// Samples to date, missing ones included.
    pub samples: u64,
    /// Status of the filter.
    pub status: zr_attitude_status,
    /// True if the sensor rests.
    pub at_rest: bool,
    /// True if the magnetic field is not the known field.
    pub disturbed: bool,
}

/// Orientation of a body, from its gyro, accelerometer and magnetometer.
#[derive(Debug, Clone, Copy)]
pub struct zr_attitude(Attitude<Auto>);

impl zr_attitude_params {
    fn attitude(&self) -> Result<zr_attitude, Error> {
        let frame = match self.frame {
            0 => Frame::Enu,
            1 => Frame::Ned,
            2 => Frame::Nwu,
            other => {
                let (name, expected) = ("frame", "one of zr_frame");
                return Err(Error::Parameter { name, expected, value: f64::from(other) });
            }
        };
        let (mag, gyro_unit) = (self.mag != 0, or(self.gyro_unit, 1.0));
        let params = AttitudeParams {
            rate: self.rate,
            frame,
            mag,
            gyro_unit,
            accel_unit: or(self.accel_unit, 1.0),
            gyro_range: (self.gyro_range != 0.0).then_some(self.gyro_range * gyro_unit),
        };
        let usual = AutoOptions { mag, bias: self.bias, ..AutoOptions::default() };
        let bias_sigma = [0, 1, 2].map(|i| or(self.bias_sigma[i], usual.bias_sigma[i]));
        let bias_limit = or(self.bias_limit, usual.bias_limit);
        let auto = Auto::new(AutoOptions { bias_sigma, bias_limit, ..usual })?;
        Ok(zr_attitude(Attitude::new(params, auto)?))
    }
}

/// The number, or the default if it is zero.
fn or(value: f64, usual: f64) -> f64 {
    if value == 0.0 { usual } else { value }
}

impl zr_attitude {
    fn state(&self) -> zr_attitude_state {
        let reading = self.0.reading();
        let (snapshot, known) = (reading.snapshot, reading.snapshot.knowledge);
        zr_attitude_state {
            quaternion: snapshot.quaternion,
            euler: reading.euler,
            heading: reading.heading,
            tilt_sigma: known.tilt_sigma,
            heading_sigma: known.heading_sigma,
            bias: known.bias.into(),
            bias_sigma: known.bias_sigma.into(),
            linear_acceleration: snapshot.linear_acceleration,
            samples: self.0.samples_seen(),
            status: zr_attitude_status::of(reading.status),
            at_rest: known.at_rest,
            disturbed: known.disturbed,
        }
    }
}

/// Returns the size of a `zr_attitude` in bytes, at most `ZR_ATTITUDE_MEMORY`.
#[unsafe(no_mangle)]
pub extern "C" fn zr_attitude_size() -> usize {
    size_of::<zr_attitude>()
}

/// Returns the alignment of a `zr_attitude` in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn zr_attitude_align() -> usize {
    align_of::<zr_attitude>()
}

/// Writes the error in the parameters as text, as `zr_drift_explain` does.
///
/// # Safety
/// `params` is null or valid; `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_explain(
    params: *const zr_attitude_params,
    text: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: guaranteed by the caller.
    let (Ok(params), Ok(text)) =
        (unsafe { memory::shared(params) }, unsafe { memory::bytes_mut(text.cast(), size) })
    else {
        return 0;
    };
    params.attitude().err().map_or(0, |error| Text::explain(&error, text))
}

/// Creates an attitude before its first sample in `memory`, as `zr_drift_init` does.
///
/// # Safety
/// `memory` has `size` bytes; `params` and `attitude` are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_init(
    memory: *mut c_void,
    size: usize,
    params: *const zr_attitude_params,
    attitude: *mut *mut zr_attitude,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    let new = || Ok(unsafe { memory::shared(params) }?.attitude()?);
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::put(new, memory, size, attitude) })
}

/// Processes one sample of each sensor, three numbers each; NaN is missing. `mag` may be null. `dt`
/// is the time since the previous sample, s; NaN means one period of the rate. `quaternion` gets w,
/// x, y, z, from the sensor's axes to the earth's axes. The call takes constant time.
///
/// # Safety
/// `attitude` is null or was made by this library. `gyro`, `accel` and `mag` are null or have three
/// numbers. `quaternion` is null or has four numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_update(
    attitude: *mut zr_attitude,
    gyro: *const f64,
    accel: *const f64,
    mag: *const f64,
    dt: f64,
    quaternion: *mut f64,
) -> zr_code {
    let step = || {
        // SAFETY: guaranteed by the caller.
        let attitude = unsafe { memory::exclusive(attitude) }?;
        // SAFETY: guaranteed by the caller.
        let quaternion = unsafe { memory::exclusive(quaternion.cast::<[f64; 4]>()) }?;
        // SAFETY: guaranteed by the caller.
        let (gyro, accel) = unsafe { (memory::three(gyro)?, memory::three(accel)?) };
        // SAFETY: guaranteed by the caller.
        let mag = unsafe { memory::three(mag) }.unwrap_or([f64::NAN; 3]);
        *quaternion = attitude.0.update(Sample { gyro, accel, mag, dt });
        Ok(())
    };
    answer(step())
}

/// Reads the state after the last sample.
///
/// # Safety
/// `attitude` is null or was made by this library; `state` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_read(
    attitude: *const zr_attitude,
    state: *mut zr_attitude_state,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::shared(attitude) }.and_then(|attitude| {
        // SAFETY: guaranteed by the caller.
        *unsafe { memory::exclusive(state) }? = attitude.state();
        Ok(())
    }))
}

/// Resets to the state before the first sample.
///
/// # Safety
/// `attitude` is null or was made by this library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_reset(attitude: *mut zr_attitude) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(attitude) }.map(|attitude| attitude.0.reset()))
}

/// Continues after the sensor was switched off and on: resets the state, but keeps the gyro's
/// matrix.
///
/// # Safety
/// `attitude` is null or was made by this library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_power_on(attitude: *mut zr_attitude) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(attitude) }.map(|attitude| attitude.0.power_on()))
}

/// Writes a checkpoint of at most `ZR_ATTITUDE_CHECKPOINT` bytes, as `zr_drift_save` does.
///
/// # Safety
/// `attitude` is null or was made by this library; `buffer` has `size` bytes; `used` is null
/// or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_save(
    attitude: *const zr_attitude,
    buffer: *mut u8,
    size: usize,
    used: *mut usize,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::shared(attitude) }.and_then(|attitude| {
        // SAFETY: guaranteed by the caller.
        let (buffer, used) =
            unsafe { (memory::bytes_mut(buffer, size)?, memory::exclusive(used)?) };
        *used = checkpoint::write(&attitude.0, buffer)?.len();
        Ok(())
    }))
}

/// Restores the attitude of the checkpoint `bytes` in `memory`, as `zr_drift_restore` does.
///
/// # Safety
/// `memory` has `size` bytes; `bytes` has `n` bytes; `attitude` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_attitude_restore(
    memory: *mut c_void,
    size: usize,
    bytes: *const u8,
    n: usize,
    attitude: *mut *mut zr_attitude,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    let saved = || Ok(zr_attitude(checkpoint::read(unsafe { memory::bytes(bytes, n) }?)?));
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::put(saved, memory, size, attitude) })
}
