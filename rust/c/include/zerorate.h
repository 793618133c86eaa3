/* Drift filter and attitude of zerorate, in the caller's memory.
 * Written by cbindgen from rust/c/src; rust/c/README.md says how it is used. */

#ifndef ZERORATE_H
#define ZERORATE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

// Bytes that are enough for a `zr_drift`, to put one into static memory.
#define ZR_DRIFT_MEMORY 5120

// Bytes that are enough for the checkpoint of one.
#define ZR_DRIFT_CHECKPOINT 4096

// Bytes that are enough for a `zr_attitude`, to put one into static memory.
#define ZR_ATTITUDE_MEMORY 6144

// Bytes that are enough for the checkpoint of one.
#define ZR_ATTITUDE_CHECKPOINT 5120

// Result of a function. Only `ZR_OK` is zero.
typedef enum zr_code {
    // All went well.
    ZR_OK = 0,
    // A pointer that is needed is null.
    ZR_NULL = 1,
    // The memory given is too small, or does not lie as it must.
    ZR_MEMORY = 2,
    // A parameter is out of its range: `zr_drift_explain` and `zr_attitude_explain` say which.
    ZR_PARAMETER = 3,
    // The buffer given is too small for this checkpoint.
    ZR_BUFFER = 4,
    // The bytes are no checkpoint.
    ZR_NO_CHECKPOINT = 5,
    // The checkpoint is one of another version of zerorate, or of something else.
    ZR_OTHER_CHECKPOINT = 6,
    // The checkpoint is damaged or cut.
    ZR_DAMAGED = 7,
    // An error of unknown cause.
    ZR_UNKNOWN = 8,
} zr_code;

// Status of a drift filter.
typedef enum zr_drift_status {
    // The bias is the mean to date.
    ZR_STARTING = 0,
    // The same, after the scale learned before was proved wrong by many orders.
    ZR_STARTING_ANEW = 1,
    // The bias is learned.
    ZR_AT_REST = 2,
    // The bias is held.
    ZR_IN_MOTION = 3,
    // The sensor has moved ever since the start: no bias is known.
    ZR_NO_REST_YET = 4,
    // The bias is learned from what may as well be motion: nothing louder was seen.
    ZR_PROVISIONAL = 5,
    // The sensor gives the same sample again and again: the bias is held.
    ZR_STUCK = 6,
} zr_drift_status;

// Status of an attitude.
typedef enum zr_attitude_status {
    // The first seconds are not over.
    ZR_ATTITUDE_STARTING = 0,
    // The gyro has given nothing for more than 50 ms.
    ZR_ATTITUDE_RATE_MISSING = 1,
    // Gravity at rest is wrong: the accelerometer's unit is not the stated one.
    ZR_ATTITUDE_WRONG_UNIT = 2,
    // The magnetic field is not the one known.
    ZR_ATTITUDE_DISTURBED = 3,
    // The sensor rests.
    ZR_ATTITUDE_AT_REST = 4,
    // The sensor moves.
    ZR_ATTITUDE_MOVING = 5,
    // The gyro is at its range.
    ZR_ATTITUDE_CLIPPED = 6,
    // Gravity turns in the sensor as if rates were in another unit.
    ZR_ATTITUDE_WRONG_RATE_UNIT = 7,
    // The magnetometer gives one value while the sensor turns.
    ZR_ATTITUDE_MAGNETOMETER_STUCK = 8,
    // At rest with a bias beyond `bias_limit`, or on a rate table.
    ZR_ATTITUDE_UNCLEAR = 9,
} zr_attitude_status;

// Methods of a drift filter.
typedef enum zr_method {
    // Tunes itself: the one to use.
    ZR_AUTO = 0,
    // Fu & Han: a Kalman filter of an ARMA model of order (2, 1).
    ZR_KF = 1,
    // The same; the measurement noise adapts with equal weights.
    ZR_AKF = 2,
    // The same; the measurement noise adapts with fading memory, and the process noise.
    ZR_FADING = 3,
} zr_method;

// Treatment of motion by a drift filter.
typedef enum zr_motion {
    // Holds, if it is `ZR_AUTO`; else ignores.
    ZR_MOTION_USUAL = 0,
    // Learns at rest only and holds the bias in motion.
    ZR_MOTION_HOLD = 1,
    // Takes every sample for rest.
    ZR_MOTION_IGNORE = 2,
} zr_motion;

// Axes of the earth.
typedef enum zr_frame {
    // East, north, up.
    ZR_ENU = 0,
    // North, east, down.
    ZR_NED = 1,
    // North, west, up.
    ZR_NWU = 2,
} zr_frame;

// Orientation of a body, from its gyro, accelerometer and magnetometer.
typedef struct zr_attitude zr_attitude;

// Bias of one axis of a gyro, learned and removed sample by sample.
typedef struct zr_drift zr_drift;

// Parameters of a drift filter. Zero is the default of all but the rate.
typedef struct zr_drift_params {
    // Samples per second.
    double rate;
    // A `zr_method`.
    int32_t method;
    // A `zr_motion`.
    int32_t motion;
    // Not zero: `zr_drift_update` gives the bias, not the sample minus the bias.
    int32_t estimate;
    // End of the sensor's range in the unit of the samples; zero: there is none.
    double limit;
    // Deviation of the samples above which the sensor cannot be at rest; zero: it is not known.
    double rest_limit;
    // Largest level that can be a bias; zero: it is not known.
    double bias_limit;
    // Seconds of the start-up; zero: one.
    double startup;
    // Deviation of the noise; zero: it is learned.
    double scale;
    // Initial process noise of the drift, for all but `ZR_AUTO`; zero: 0.1.
    double process_noise;
} zr_drift_params;

// State after a sample, in the unit of the samples.
typedef struct zr_drift_state {
    // The sensor's output without rotation.
    double bias;
    // Standard deviation of the mean bias over the next 10 s about it, for `ZR_AUTO`; of
    // the others that of the bias as their model has it.
    double bias_sigma;
    // Samples to date, missing ones included.
    uint64_t samples;
    // Status of the filter.
    enum zr_drift_status status;
    // True if the bias is learned.
    bool at_rest;
} zr_drift_state;

// Parameters of an attitude. Zero is the default of all but the rate.
typedef struct zr_attitude_params {
    // Samples per second, at least one.
    double rate;
    // A `zr_frame`.
    int32_t frame;
    // Not zero: there is a magnetometer. Without one the heading at the start is zero.
    int32_t mag;
    // rad/s in a unit of the gyro; zero: one.
    double gyro_unit;
    // m/s² in a unit of the accelerometer; zero: one.
    double accel_unit;
    // The gyro's output without rotation, rad/s, where it is known.
    double bias[3];
    // Its standard deviation, rad/s; zero: 1 deg/s.
    double bias_sigma[3];
    // Largest bias that such a gyro has, rad/s; zero: 10 deg/s.
    double bias_limit;
    // Largest rate about an axis that the gyro measures, in its unit: beyond, it is missing; zero: unknown.
    double gyro_range;
} zr_attitude_params;

// State after a sample.
typedef struct zr_attitude_state {
    // From the axes of the sensor to those of the earth, w, x, y, z.
    double quaternion[4];
    // Roll, pitch, yaw, rad.
    double euler[3];
    // Direction of the sensor's x axis over ground, clockwise from north, rad.
    double heading;
    // Standard deviation of the angle between true and estimated up, rad.
    double tilt_sigma;
    // That of the heading, rad.
    double heading_sigma;
    // The gyro's output without rotation, in its unit.
    double bias[3];
    // Its standard deviation.
    double bias_sigma[3];
    // Specific force without gravity, in the axes and the unit of the accelerometer.
    double linear_acceleration[3];
    // Samples to date, missing ones included.
    uint64_t samples;
    // Status of the filter.
    enum zr_attitude_status status;
    // True if the sensor rests.
    bool at_rest;
    // True if the magnetic field is not the one known.
    bool disturbed;
} zr_attitude_state;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns a `zr_code` in words; valid for ever.
const char *zr_message(int32_t code);

// Returns the version of the library, such as "0.2.0"; valid for ever.
const char *zr_version(void);

// Returns the size of a `zr_drift` in bytes, at most `ZR_DRIFT_MEMORY`.
size_t zr_drift_size(void);

// Returns at multiples of how many bytes a `zr_drift` may lie.
size_t zr_drift_align(void);

// Writes the fault of parameters, with a zero at its end; returns the length without the zero, 0
// if there is no fault, as `snprintf` does. `text` may be null if `size` is zero.
//
// # Safety
// `params` is null or valid; `text` has room for `size` bytes.
size_t zr_drift_explain(const struct zr_drift_params *params, char *text, size_t size);

// Makes a filter before its first sample in `memory`, which has `size` bytes, and tells in
// `filter` where it is: at `memory`. It lives there until the memory is used for something else;
// there is nothing to be freed, and it may be copied by `memcpy`.
//
// # Safety
// `memory` has `size` bytes; `params` and `filter` are null or valid.
enum zr_code zr_drift_init(void *memory,
                           size_t size,
                           const struct zr_drift_params *params,
                           struct zr_drift **filter);

// Takes one sample; NaN is a missing one. `rate` gets the sample minus the bias, NaN where it is
// missing. Constant work.
//
// # Safety
// `filter` is null or was made by this library; `rate` is null or valid.
enum zr_code zr_drift_update(struct zr_drift *filter, double z, double *rate);

// The same of a body that something else knows to be `moving`: what the gyro gives is then no
// bias, however still it stands.
//
// # Safety
// As in `zr_drift_update`.
enum zr_code zr_drift_update_while(struct zr_drift *filter, double z, bool moving, double *rate);

// Takes `n` samples, with the same bits as one by one. `rate` may be `z`.
//
// # Safety
// `filter` is null or was made by this library; `z` and `rate` have `n` numbers.
enum zr_code zr_drift_process(struct zr_drift *filter, const double *z, double *rate, size_t n);

// Reads the state after the last sample.
//
// # Safety
// `filter` is null or was made by this library; `state` is null or valid.
enum zr_code zr_drift_read(const struct zr_drift *filter, struct zr_drift_state *state);

// Back to before the first sample.
//
// # Safety
// `filter` is null or was made by this library.
enum zr_code zr_drift_reset(struct zr_drift *filter);

// The sensor was switched off and on: `ZR_AUTO` forgets the bias but not the noise, the others
// start again.
//
// # Safety
// `filter` is null or was made by this library.
enum zr_code zr_drift_power_on(struct zr_drift *filter);

// Writes a checkpoint into `buffer`, which has `size` bytes; `used` gets how many were needed, at
// most `ZR_DRIFT_CHECKPOINT`.
//
// # Safety
// `filter` is null or was made by this library; `buffer` has `size` bytes; `used` is null
// or valid.
enum zr_code zr_drift_save(const struct zr_drift *filter,
                           uint8_t *buffer,
                           size_t size,
                           size_t *used);

// Makes in `memory`, as `zr_drift_init` does, the filter of which `bytes` are the checkpoint. It
// goes on with the same bits. Bytes that are none are refused.
//
// # Safety
// `memory` has `size` bytes, `bytes` has `n`; `filter` is null or valid.
enum zr_code zr_drift_restore(void *memory,
                              size_t size,
                              const uint8_t *bytes,
                              size_t n,
                              struct zr_drift **filter);

// Returns the size of a `zr_attitude` in bytes, at most `ZR_ATTITUDE_MEMORY`.
size_t zr_attitude_size(void);

// Returns at multiples of how many bytes a `zr_attitude` may lie.
size_t zr_attitude_align(void);

// Writes the fault of parameters, as `zr_drift_explain` does.
//
// # Safety
// `params` is null or valid; `text` has room for `size` bytes.
size_t zr_attitude_explain(const struct zr_attitude_params *params, char *text, size_t size);

// Makes an attitude before its first sample in `memory`, as `zr_drift_init` does.
//
// # Safety
// `memory` has `size` bytes; `params` and `attitude` are null or valid.
enum zr_code zr_attitude_init(void *memory,
                              size_t size,
                              const struct zr_attitude_params *params,
                              struct zr_attitude **attitude);

// Takes one sample of each sensor, three numbers each, NaN where they are missing; `mag` may be
// null, `dt` is the seconds since the sample before, NaN for one period of the rate. `quaternion`
// gets w, x, y, z, from the axes of the sensor to those of the earth. Constant work.
//
// # Safety
// `attitude` is null or was made by this library; `gyro`, `accel` and `mag` are null or have three
// numbers, `quaternion` four.
enum zr_code zr_attitude_update(struct zr_attitude *attitude,
                                const double *gyro,
                                const double *accel,
                                const double *mag,
                                double dt,
                                double *quaternion);

// Reads the state after the last sample.
//
// # Safety
// `attitude` is null or was made by this library; `state` is null or valid.
enum zr_code zr_attitude_read(const struct zr_attitude *attitude, struct zr_attitude_state *state);

// Back to before the first sample.
//
// # Safety
// `attitude` is null or was made by this library.
enum zr_code zr_attitude_reset(struct zr_attitude *attitude);

// The sensor was switched off and on: the same, but for what it keeps meanwhile.
//
// # Safety
// `attitude` is null or was made by this library.
enum zr_code zr_attitude_power_on(struct zr_attitude *attitude);

// Writes a checkpoint, as `zr_drift_save` does, of at most `ZR_ATTITUDE_CHECKPOINT` bytes.
//
// # Safety
// `attitude` is null or was made by this library; `buffer` has `size` bytes; `used` is null
// or valid.
enum zr_code zr_attitude_save(const struct zr_attitude *attitude,
                              uint8_t *buffer,
                              size_t size,
                              size_t *used);

// Makes in `memory` the attitude of which `bytes` are the checkpoint, as `zr_drift_restore` does.
//
// # Safety
// `memory` has `size` bytes, `bytes` has `n`; `attitude` is null or valid.
enum zr_code zr_attitude_restore(void *memory,
                                 size_t size,
                                 const uint8_t *bytes,
                                 size_t n,
                                 struct zr_attitude **attitude);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ZERORATE_H */
