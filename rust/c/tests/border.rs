//! Mistakes of C are answered by a code.

use std::ffi::CStr;
use std::ptr::{null, null_mut};

use zerorate::*;

/// Bytes that are enough for either filter.
const MEMORY: usize =
    if ZR_ATTITUDE_MEMORY > ZR_DRIFT_MEMORY { ZR_ATTITUDE_MEMORY } else { ZR_DRIFT_MEMORY };

#[repr(align(16))]
struct Memory([u8; MEMORY]);

fn memory() -> Box<Memory> {
    Box::new(Memory([0; MEMORY]))
}

fn params() -> zr_drift_params {
    zr_drift_params { rate: 100.0, ..zr_drift_params::default() }
}

fn init(memory: &mut Memory, params: &zr_drift_params) -> Result<*mut zr_drift, zr_code> {
    let mut filter = null_mut();
    // SAFETY: the memory is as large as is said.
    let code =
        unsafe { zr_drift_init(memory.0.as_mut_ptr().cast(), memory.0.len(), params, &mut filter) };
    if code == zr_code::ZR_OK { Ok(filter) } else { Err(code) }
}

fn state(filter: *const zr_drift) -> zr_drift_state {
    let mut state = std::mem::MaybeUninit::uninit();
    // SAFETY: a filter and a place for its state.
    unsafe {
        assert_eq!(zr_drift_read(filter, state.as_mut_ptr()), zr_code::ZR_OK);
        state.assume_init()
    }
}

#[test]
fn what_is_null_is_told() {
    let (mut rate, mut used) = (0.0, 0);
    // SAFETY: null is allowed.
    unsafe {
        assert_eq!(zr_drift_init(null_mut(), 0, &params(), null_mut()), zr_code::ZR_NULL);
        assert_eq!(zr_drift_update(null_mut(), 1.0, &mut rate), zr_code::ZR_NULL);
        assert_eq!(zr_drift_save(null(), null_mut(), 0, &mut used), zr_code::ZR_NULL);
        assert_eq!(zr_drift_reset(null_mut()), zr_code::ZR_NULL);
        assert_eq!(zr_drift_explain(null(), null_mut(), 0), 0);
        let mut quaternion = [0.0; 4];
        let update = zr_attitude_update(
            null_mut(),
            null(),
            null(),
            null(),
            f64::NAN,
            quaternion.as_mut_ptr(),
        );
        assert_eq!(update, zr_code::ZR_NULL);
    }
    let mut memory = memory();
    let filter = init(&mut memory, &params()).expect("the parameters are in their ranges");
    // SAFETY: a filter, and null.
    unsafe {
        assert_eq!(zr_drift_update(filter, 1.0, null_mut()), zr_code::ZR_NULL);
        assert_eq!(zr_drift_process(filter, null(), null_mut(), 1), zr_code::ZR_NULL);
        assert_eq!(zr_drift_process(filter, null(), null_mut(), 0), zr_code::ZR_OK);
    }
    assert_eq!(state(filter).samples, 0);
}

#[test]
fn memory_that_does_not_do_is_told() {
    let (mut memory, params, mut filter) = (memory(), params(), null_mut());
    let start = memory.0.as_mut_ptr();
    // SAFETY: within the memory.
    unsafe {
        let few = zr_drift_size() - 1;
        let code = zr_drift_init(start.cast(), few, &params, &mut filter);
        assert_eq!(code, zr_code::ZR_MEMORY);
        let beside = zr_drift_init(start.add(1).cast(), zr_drift_size(), &params, &mut filter);
        assert_eq!(beside, zr_code::ZR_MEMORY);
        let enough = zr_drift_init(start.cast(), zr_drift_size(), &params, &mut filter);
        assert_eq!(enough, zr_code::ZR_OK);
    }
    assert!(zr_drift_align() <= 16 && zr_attitude_align() <= 16);
    assert!(zr_attitude_size() <= ZR_ATTITUDE_MEMORY);
}

#[test]
fn parameters_out_of_range_are_told_in_words_and_cut_where_the_room_ends() {
    let wrong = [
        (zr_drift_params { rate: f64::NAN, ..params() }, "rate"),
        (zr_drift_params { method: 9, ..params() }, "method"),
        (zr_drift_params { motion: -1, ..params() }, "motion"),
        (zr_drift_params { limit: -1.0, ..params() }, "limit"),
        (zr_drift_params { startup: f64::INFINITY, ..params() }, "startup"),
    ];
    for (params, name) in wrong {
        assert_eq!(init(&mut memory(), &params), Err(zr_code::ZR_PARAMETER));
        let mut text = [1_u8; 200];
        // SAFETY: so much room is there.
        let length = unsafe { zr_drift_explain(&params, text.as_mut_ptr().cast(), text.len()) };
        let words = CStr::from_bytes_until_nul(&text).expect("a zero").to_str().expect("text");
        assert!(words.starts_with(name) && words.len() == length, "{words}");
        let mut few = [1_u8; 4];
        // SAFETY: so much room is there.
        let same = unsafe { zr_drift_explain(&params, few.as_mut_ptr().cast(), few.len()) };
        assert_eq!((same, &few[..3], few[3]), (length, &words.as_bytes()[..3], 0));
        // SAFETY: nothing is written.
        assert_eq!(unsafe { zr_drift_explain(&params, null_mut(), 0) }, length);
    }
    // SAFETY: nothing is written.
    assert_eq!(unsafe { zr_drift_explain(&params(), null_mut(), 0) }, 0);
}

#[test]
fn every_method_runs_goes_on_from_its_checkpoint_and_processes_in_place() {
    for method in 0..4 {
        let params = zr_drift_params { method, ..params() };
        let (mut one, mut other) = (memory(), memory());
        let filter = init(&mut one, &params).expect("the parameters are in their ranges");
        let mut z: Vec<f64> = (0..500).map(|k| 0.3 + 0.01 * f64::from(k * 7919 % 101)).collect();
        let mut rates = vec![0.0; 500];
        let mut saved = vec![0; ZR_DRIFT_CHECKPOINT];
        let (mut used, mut twin) = (0, null_mut());
        // SAFETY: filters, numbers and bytes are as many as is said.
        unsafe {
            for k in 0..200 {
                assert_eq!(zr_drift_update(filter, z[k], &mut rates[k]), zr_code::ZR_OK);
            }
            assert_eq!(
                zr_drift_save(filter, saved.as_mut_ptr(), 40, &mut used),
                zr_code::ZR_BUFFER
            );
            zr_drift_save(filter, saved.as_mut_ptr(), saved.len(), &mut used);
            let place = other.0.as_mut_ptr().cast();
            let size = other.0.len();
            let code = zr_drift_restore(place, size, saved.as_ptr(), used, &mut twin);
            assert_eq!(code, zr_code::ZR_OK);
            for k in 200..500 {
                zr_drift_update(filter, z[k], &mut rates[k]);
            }
            let rest = z[200..].as_mut_ptr();
            assert_eq!(zr_drift_process(twin, rest, rest, 300), zr_code::ZR_OK);

            let cut = zr_drift_restore(place, size, saved.as_ptr(), used - 1, &mut twin);
            assert_eq!(cut, zr_code::ZR_DAMAGED);
            let none = zr_drift_restore(place, size, saved.as_ptr().add(1), used - 1, &mut twin);
            assert_eq!(none, zr_code::ZR_NO_CHECKPOINT);
        }
        assert_eq!(z[200..], rates[200..]);
        assert_eq!(state(filter), state(twin));
        assert!(state(filter).bias > 0.3 && state(filter).bias < 1.3, "{:?}", state(filter));

        // SAFETY: a filter.
        unsafe { zr_drift_reset(filter) };
        assert_eq!(state(filter).samples, 0);
    }
}

#[test]
fn an_attitude_is_not_a_drift_filter() {
    let (mut one, mut bytes, mut used) = (memory(), vec![0; ZR_ATTITUDE_CHECKPOINT], 0);
    let params = zr_attitude_params { rate: 50.0, ..zr_attitude_params::default() };
    let (mut attitude, mut drift) = (null_mut(), null_mut());
    // SAFETY: all is as large as is said.
    unsafe {
        let (place, size) = (one.0.as_mut_ptr().cast(), one.0.len());
        assert_eq!(zr_attitude_init(place, size, &params, &mut attitude), zr_code::ZR_OK);
        zr_attitude_save(attitude, bytes.as_mut_ptr(), bytes.len(), &mut used);
        let code = zr_drift_restore(place, size, bytes.as_ptr(), used, &mut drift);
        assert_eq!(code, zr_code::ZR_OTHER_CHECKPOINT);
        let frame = zr_attitude_params { frame: 7, ..params };
        let code = zr_attitude_init(place, size, &frame, &mut attitude);
        assert_eq!(code, zr_code::ZR_PARAMETER);
    }
}

#[test]
fn a_rate_beyond_the_range_is_missing() {
    let turned = |gyro_range: f64| {
        let (mut one, mut attitude, mut quaternion) = (memory(), null_mut(), [0.0; 4]);
        let usual = zr_attitude_params::default();
        let params = zr_attitude_params { rate: 50.0, gyro_unit: 0.5, gyro_range, ..usual };
        // SAFETY: all is as large as is said.
        unsafe {
            let (place, size) = (one.0.as_mut_ptr().cast(), one.0.len());
            let code = zr_attitude_init(place, size, &params, &mut attitude);
            if code != zr_code::ZR_OK {
                return Err(code);
            }
            let (gyro, accel) = ([0.0, 0.0, 6.0], [0.0, 0.0, 9.81]);
            for _ in 0..20 {
                let out = quaternion.as_mut_ptr();
                zr_attitude_update(
                    attitude,
                    gyro.as_ptr(),
                    accel.as_ptr(),
                    null_mut(),
                    f64::NAN,
                    out,
                );
            }
        }
        Ok(quaternion[3].abs())
    };
    assert_eq!(turned(5.0), Ok(0.0));
    assert!(turned(7.0).is_ok_and(|z| z > 0.1) && turned(0.0) == turned(7.0));
    assert_eq!(turned(-1.0), Err(zr_code::ZR_PARAMETER));
}

#[test]
fn codes_have_words() {
    let words = |code: i32| {
        // SAFETY: a text that is there for ever.
        unsafe { CStr::from_ptr(zr_message(code)) }.to_str().expect("text")
    };
    let different: std::collections::HashSet<_> = (0..=8).map(words).collect();
    assert_eq!(different.len(), 9);
    assert_eq!(words(-7), words(8));
    // SAFETY: the same.
    let version = unsafe { CStr::from_ptr(zr_version()) };
    assert_eq!(version.to_str(), Ok(env!("CARGO_PKG_VERSION")));
}
