//! Whatever an init of the library takes and samples make, a checkpoint restores, and both continue
//! to the last bit.

use std::ptr::{null, null_mut};

use zerorate::*;

#[path = "../../core/tests/core/draw.rs"]
mod draw;

use draw::{Clock, Draw, count};

const HISTORIES: u64 = 200;
const MEMORY: usize =
    if ZR_ATTITUDE_MEMORY > ZR_DRIFT_MEMORY { ZR_ATTITUDE_MEMORY } else { ZR_DRIFT_MEMORY };
const BYTES: usize = if ZR_ATTITUDE_CHECKPOINT > ZR_DRIFT_CHECKPOINT {
    ZR_ATTITUDE_CHECKPOINT
} else {
    ZR_DRIFT_CHECKPOINT
};

#[repr(align(16))]
struct Memory([u8; MEMORY]);

/// What the library has for one kind of filters.
struct Kind<F> {
    width: usize,
    clock: Clock,
    /// A filter of drawn parameters in some memory, if they are in their ranges.
    init: fn(&mut Draw, *mut u8) -> Option<*mut F>,
    update: fn(*mut F, &[f64]) -> Vec<u64>,
    save: unsafe extern "C" fn(*const F, *mut u8, usize, *mut usize) -> zr_code,
    restore: unsafe extern "C" fn(
        *mut std::ffi::c_void,
        usize,
        *const u8,
        usize,
        *mut *mut F,
    ) -> zr_code,
}

impl<F> Kind<F> {
    fn saved(&self, filter: *const F) -> Vec<u8> {
        let (mut bytes, mut used) = (vec![0; BYTES], 0);
        // SAFETY: a filter, and as many bytes as is said.
        let code = unsafe { (self.save)(filter, bytes.as_mut_ptr(), bytes.len(), &mut used) };
        assert_eq!(code, zr_code::ZR_OK);
        bytes.truncate(used);
        bytes
    }

    fn holds(&self) {
        for seed in 0..count(HISTORIES) {
            let mut draw = Draw::new(seed);
            let mut rooms = [(); 2].map(|()| Box::new(Memory([0; MEMORY])));
            let place = rooms[0].0.as_mut_ptr();
            let filter = (0..1000).find_map(|_| (self.init)(&mut draw, place));
            let filter = filter.expect("half of all parameters are the usual ones");
            for block in draw.history(self.width, self.clock) {
                let (bytes, mut other) = (self.saved(filter), null_mut());
                let room = rooms[1].0.as_mut_ptr().cast();
                // SAFETY: the memory is as large as is said.
                let code = unsafe {
                    (self.restore)(room, MEMORY, bytes.as_ptr(), bytes.len(), &mut other)
                };
                assert_eq!(code, zr_code::ZR_OK, "history {seed}");
                for row in &block {
                    let outputs = [filter, other].map(|one| (self.update)(one, row));
                    assert_eq!(outputs[0], outputs[1], "history {seed}");
                }
                assert!(self.saved(filter) == self.saved(other), "history {seed}");
            }
        }
    }
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn drift_filters_continue_to_the_bit() {
    let init = |draw: &mut Draw, place: *mut u8| {
        let usual = zr_drift_params::default();
        let params = zr_drift_params {
            rate: draw.number(100.0),
            method: draw.below(4) as i32,
            motion: draw.below(2) as i32,
            estimate: draw.below(2) as i32,
            limit: draw.maybe(20.0).unwrap_or(usual.limit),
            rest_limit: draw.maybe(1.0).unwrap_or(usual.rest_limit),
            bias_limit: draw.maybe(1.0).unwrap_or(usual.bias_limit),
            startup: draw.maybe(0.5).unwrap_or(usual.startup),
            scale: draw.maybe(1.0).unwrap_or(usual.scale),
            process_noise: draw.maybe(0.1).unwrap_or(usual.process_noise),
        };
        let mut filter = null_mut();
        // SAFETY: the memory is as large as is said.
        let code = unsafe { zr_drift_init(place.cast(), MEMORY, &params, &mut filter) };
        (code == zr_code::ZR_OK).then_some(filter)
    };
    let update = |filter: *mut zr_drift, row: &[f64]| {
        let mut rate = 0.0;
        // SAFETY: a filter, and room for a number.
        assert_eq!(unsafe { zr_drift_update(filter, row[0], &mut rate) }, zr_code::ZR_OK);
        bits(&[rate])
    };
    let (save, restore) = (zr_drift_save, zr_drift_restore);
    Kind { width: 1, clock: Clock::None, init, update, save, restore }.holds();
}

#[test]
fn attitudes_continue_to_the_bit() {
    let init = |draw: &mut Draw, place: *mut u8| {
        let usual = zr_attitude_params::default();
        let params = zr_attitude_params {
            rate: draw.number(100.0),
            frame: draw.below(2) as i32,
            mag: draw.below(2) as i32,
            gyro_unit: draw.number(1.0),
            accel_unit: draw.number(1.0),
            bias: draw.three(1e-3),
            bias_sigma: draw.three(1e-2),
            bias_limit: draw.maybe(0.1).unwrap_or(usual.bias_limit),
            gyro_range: draw.maybe(35.0).unwrap_or(usual.gyro_range),
        };
        let mut filter = null_mut();
        // SAFETY: the memory is as large as is said.
        let code = unsafe { zr_attitude_init(place.cast(), MEMORY, &params, &mut filter) };
        (code == zr_code::ZR_OK).then_some(filter)
    };
    let update = |filter: *mut zr_attitude, row: &[f64]| {
        let mut quaternion = [0.0; 4];
        let mag = if row[6] == 1.0 { null() } else { row[6..].as_ptr() };
        let (gyro, accel) = (row.as_ptr(), row[3..].as_ptr());
        // SAFETY: a filter, and as many numbers as it reads and writes.
        unsafe { zr_attitude_update(filter, gyro, accel, mag, row[9], quaternion.as_mut_ptr()) };
        bits(&quaternion)
    };
    let (save, restore) = (zr_attitude_save, zr_attitude_restore);
    Kind { width: 10, clock: Clock::Step(9), init, update, save, restore }.holds();
}
