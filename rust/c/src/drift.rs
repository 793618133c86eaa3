//! Drift filter.

use core::ffi::{c_char, c_void};

use zerorate_core::drift::options::Options;
use zerorate_core::{
    AutoFilter, DriftFilter, DriftStream, Error, Method, MotionAware, RestGated, Status, Stream,
    checkpoint,
};

use crate::code::{Text, answer, zr_code};
use crate::memory;

/// Size of a static buffer for a `zr_drift`, in bytes.
pub const ZR_DRIFT_MEMORY: usize = 5120;
/// Size of a buffer for the checkpoint of a `zr_drift`, in bytes.
pub const ZR_DRIFT_CHECKPOINT: usize = 4096;

const _: () = assert!(size_of::<zr_drift>() <= ZR_DRIFT_MEMORY);

/// Methods of a drift filter.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_method {
    /// Tunes itself; recommended.
    ZR_AUTO = 0,
    /// Fu & Han: a Kalman filter of an ARMA model of order (2, 1).
    ZR_KF = 1,
    /// `ZR_KF` with a measurement noise that adapts with equal weights.
    ZR_AKF = 2,
    /// `ZR_KF` with a measurement noise that adapts with fading memory, and an adaptive process
    /// noise.
    ZR_FADING = 3,
}

/// Treatment of motion by a drift filter.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_motion {
    /// `ZR_MOTION_HOLD` for `ZR_AUTO`, `ZR_MOTION_IGNORE` for other methods.
    ZR_MOTION_USUAL = 0,
    /// Learns at rest only and holds the bias in motion.
    ZR_MOTION_HOLD = 1,
    /// Treats every sample as rest.
    ZR_MOTION_IGNORE = 2,
}

/// Parameters of a drift filter. Zero means the default for every parameter except the rate.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct zr_drift_params {
    /// Samples per second.
    pub rate: f64,
    /// A `zr_method`.
    pub method: i32,
    /// A `zr_motion`.
    pub motion: i32,
    /// Output of `zr_drift_update`; zero: the sample minus the bias, otherwise the bias.
    pub estimate: i32,
    /// End of the sensor's range in the samples' unit; zero: no limit.
    pub limit: f64,
    /// Largest standard deviation of the samples at rest; zero: unknown.
    pub rest_limit: f64,
    /// Largest level that can be a bias; zero: unknown.
    pub bias_limit: f64,
    /// Duration of the start-up, s; zero: 1 s.
    pub startup: f64,
    /// Standard deviation of the noise; zero: it is learned.
    pub scale: f64,
    /// Initial process noise of the drift, for all methods but `ZR_AUTO`; zero: 0.1.
    pub process_noise: f64,
}

/// Status of a drift filter.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_drift_status {
    /// The bias is the mean to date.
    ZR_STARTING = 0,
    /// The bias is the mean to date, since the learned scale was wrong by orders of magnitude.
    ZR_RESTARTING = 1,
    /// The bias is learned.
    ZR_AT_REST = 2,
    /// The bias is held.
    ZR_IN_MOTION = 3,
    /// The sensor has moved since the start: no bias is known.
    ZR_NO_REST_YET = 4,
    /// The bias is learned from apparent rest that may be motion.
    ZR_PROVISIONAL = 5,
    /// The sensor repeats one sample: the bias is held.
    ZR_STUCK = 6,
}

impl From<Status> for zr_drift_status {
    fn from(status: Status) -> Self {
        match status {
            Status::Starting => Self::ZR_STARTING,
            Status::Restarting => Self::ZR_RESTARTING,
            Status::AtRest => Self::ZR_AT_REST,
            Status::InMotion => Self::ZR_IN_MOTION,
            Status::NoRestYet => Self::ZR_NO_REST_YET,
            Status::Provisional => Self::ZR_PROVISIONAL,
            Status::Stuck => Self::ZR_STUCK,
        }
    }
}

/// State after a sample, in the samples' unit.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct zr_drift_state {
    /// The sensor's output without rotation.
    pub bias: f64,
    /// Standard deviation of the bias. For `ZR_AUTO` it is for the mean bias over the next 10 s.
    /// For other methods it follows from their model.
    pub bias_sigma: f64,
    /// Samples to date, missing ones included.
    pub samples: u64,
    /// Status of the filter.
    pub status: zr_drift_status,
    /// True if the bias is learned.
    pub at_rest: bool,
}

#[derive(Debug, Clone, Copy)]
// The two types lie in memory of C, which has room for each of them.
#[allow(clippy::large_enum_variant)]
enum Filter {
    Auto(AutoFilter<f64>),
    Published(RestGated<f64, 3, 4>),
}

/// Bias of one axis of a gyro, learned and removed sample by sample.
#[derive(Debug, Clone, Copy)]
pub struct zr_drift(Filter);

impl zr_drift_params {
    fn options(&self) -> Result<Options, Error> {
        let unknown = |name, expected, value: i32| Error::Parameter {
            name,
            expected,
            value: f64::from(value),
        };
        let method = match self.method {
            0 => None,
            1 => Some(Method::Kf),
            2 => Some(Method::Akf),
            3 => Some(Method::Fading),
            other => return Err(unknown("method", "one of zr_method", other)),
        };
        let mut options = Options::of(method, self.rate);
        match self.motion {
            0 => {}
            1 => options.behaviour.hold_in_motion = true,
            2 => options.behaviour.hold_in_motion = false,
            other => return Err(unknown("motion", "one of zr_motion", other)),
        }
        options.behaviour.compensated = self.estimate == 0;
        options.behaviour.limit = given(self.limit);
        options.limits.rest = given(self.rest_limit);
        options.limits.bias = given(self.bias_limit);
        options.params.scale = given(self.scale);
        let place = |place: &mut f64, value| *place = given(value).unwrap_or(*place);
        place(&mut options.params.startup, self.startup);
        place(&mut options.params.process_noise, self.process_noise);
        options.validate()
    }

    fn filter(&self) -> Result<zr_drift, Error> {
        let options = self.options()?;
        if options.method.is_none() {
            return Ok(zr_drift(Filter::Auto(AutoFilter::new(options.auto())?)));
        }
        let published = DriftFilter::new(options.params)?;
        Ok(zr_drift(Filter::Published(RestGated::new(published, options.behaviour)?)))
    }
}

/// The number, or None if it is zero.
fn given(value: f64) -> Option<f64> {
    (value != 0.0).then_some(value)
}

impl zr_drift {
    fn update(&mut self, z: f64, moving: bool) -> f64 {
        match &mut self.0 {
            Filter::Auto(filter) => filter.update_while(z, moving),
            Filter::Published(filter) => filter.update_while(z, moving),
        }
    }

    fn state(&self) -> zr_drift_state {
        match &self.0 {
            Filter::Auto(filter) => state(filter),
            Filter::Published(filter) => state(filter),
        }
    }

    fn read(bytes: &[u8]) -> Result<Self, Error> {
        match checkpoint::read(bytes) {
            Ok(filter) => Ok(Self(Filter::Auto(filter))),
            Err(Error::Type { .. }) => Ok(Self(Filter::Published(checkpoint::read(bytes)?))),
            Err(error) => Err(error),
        }
    }
}

fn state(filter: &impl DriftStream<f64>) -> zr_drift_state {
    let drift = filter.drift();
    zr_drift_state {
        bias: drift.bias,
        bias_sigma: drift.sigma,
        samples: filter.samples_seen(),
        status: DriftStream::status(filter).into(),
        at_rest: drift.at_rest,
    }
}

/// Returns the size of a `zr_drift` in bytes, at most `ZR_DRIFT_MEMORY`.
#[unsafe(no_mangle)]
pub extern "C" fn zr_drift_size() -> usize {
    size_of::<zr_drift>()
}

/// Returns the alignment of a `zr_drift` in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn zr_drift_align() -> usize {
    align_of::<zr_drift>()
}

/// Writes the error in the parameters as text. Returns its length without the final zero, as
/// `snprintf` does, or 0 if there is no error. `text` may be null if `size` is zero.
///
/// # Safety
/// `params` is null or valid; `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_explain(
    params: *const zr_drift_params,
    text: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: guaranteed by the caller.
    let (Ok(params), Ok(text)) =
        (unsafe { memory::shared(params) }, unsafe { memory::bytes_mut(text.cast(), size) })
    else {
        return 0;
    };
    params.filter().err().map_or(0, |error| Text::explain(&error, text))
}

/// Creates a filter before its first sample in `memory`, which has `size` bytes. `filter` gets the
/// filter's address, which is `memory`. The filter is valid until the memory is used for something
/// else. Nothing has to be freed, and `memcpy` may copy the filter.
///
/// # Safety
/// `memory` has `size` bytes; `params` and `filter` are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_init(
    memory: *mut c_void,
    size: usize,
    params: *const zr_drift_params,
    filter: *mut *mut zr_drift,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    let new = || Ok(unsafe { memory::shared(params) }?.filter()?);
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::put(new, memory, size, filter) })
}

/// Processes one sample; NaN is a missing sample. `rate` gets the sample minus the bias, or NaN for
/// a missing sample. The call takes constant time.
///
/// # Safety
/// `filter` is null or was made by this library; `rate` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_update(filter: *mut zr_drift, z: f64, rate: *mut f64) -> zr_code {
    // SAFETY: guaranteed by the caller.
    unsafe { zr_drift_update_while(filter, z, false, rate) }
}

/// Processes one sample; `moving` is true if the body is known to move. A constant output of the
/// gyro is then no bias.
///
/// # Safety
/// As in `zr_drift_update`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_update_while(
    filter: *mut zr_drift,
    z: f64,
    moving: bool,
    rate: *mut f64,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(filter) }.and_then(|filter| {
        // SAFETY: guaranteed by the caller.
        let place = unsafe { memory::exclusive(rate) }?;
        *place = filter.update(z, moving);
        Ok(())
    }))
}

/// Processes `n` samples; results are bit-identical to single updates. `rate` may be `z`.
///
/// # Safety
/// `filter` is null or was made by this library; `z` and `rate` have `n` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_process(
    filter: *mut zr_drift,
    z: *const f64,
    rate: *mut f64,
    n: usize,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(filter) }.and_then(|filter| {
        // SAFETY: guaranteed by the caller.
        unsafe { memory::each(z, rate, n, |z| filter.update(z, false)) }
    }))
}

/// Reads the state after the last sample.
///
/// # Safety
/// `filter` is null or was made by this library; `state` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_read(
    filter: *const zr_drift,
    state: *mut zr_drift_state,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::shared(filter) }.and_then(|filter| {
        // SAFETY: guaranteed by the caller.
        *unsafe { memory::exclusive(state) }? = filter.state();
        Ok(())
    }))
}

/// Resets to the state before the first sample.
///
/// # Safety
/// `filter` is null or was made by this library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_reset(filter: *mut zr_drift) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(filter) }.map(|filter| match &mut filter.0 {
        Filter::Auto(filter) => filter.reset(),
        Filter::Published(filter) => filter.reset(),
    }))
}

/// Continues after the sensor was switched off and on. `ZR_AUTO` forgets the bias and keeps the
/// noise. Other methods start again.
///
/// # Safety
/// `filter` is null or was made by this library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_power_on(filter: *mut zr_drift) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::exclusive(filter) }.map(|filter| match &mut filter.0 {
        Filter::Auto(filter) => filter.switch_on(),
        Filter::Published(filter) => filter.reset(),
    }))
}

/// Writes a checkpoint into `buffer`, which has `size` bytes. `used` gets the number of bytes, at
/// most `ZR_DRIFT_CHECKPOINT`.
///
/// # Safety
/// `filter` is null or was made by this library; `buffer` has `size` bytes; `used` is null
/// or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_save(
    filter: *const zr_drift,
    buffer: *mut u8,
    size: usize,
    used: *mut usize,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::shared(filter) }.and_then(|filter| {
        // SAFETY: guaranteed by the caller.
        let (buffer, used) =
            unsafe { (memory::bytes_mut(buffer, size)?, memory::exclusive(used)?) };
        *used = match &filter.0 {
            Filter::Auto(filter) => checkpoint::write(filter, buffer),
            Filter::Published(filter) => checkpoint::write(filter, buffer),
        }?
        .len();
        Ok(())
    }))
}

/// Restores the filter of the checkpoint `bytes` in `memory`. `filter` gets its address, as in
/// `zr_drift_init`. The filter continues with bit-identical results. Bytes that are not a
/// checkpoint are refused.
///
/// # Safety
/// `memory` has `size` bytes; `bytes` has `n` bytes; `filter` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn zr_drift_restore(
    memory: *mut c_void,
    size: usize,
    bytes: *const u8,
    n: usize,
    filter: *mut *mut zr_drift,
) -> zr_code {
    // SAFETY: guaranteed by the caller.
    let saved = || Ok(zr_drift::read(unsafe { memory::bytes(bytes, n) }?)?);
    // SAFETY: guaranteed by the caller.
    answer(unsafe { memory::put(saved, memory, size, filter) })
}
