/* Drift filter and attitude of zerorate, in the caller's memory.
 * Written by cbindgen from rust/c/src; rust/c/README.md says how it is used. */

#ifndef ZERORATE_H
#define ZERORATE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

// Size of a static buffer for a `zr_drift`, in bytes.
#define ZR_DRIFT_MEMORY 5120

// Size of a buffer for the checkpoint of a `zr_drift`, in bytes.
#define ZR_DRIFT_CHECKPOINT 4096

// Size of a static buffer for a `zr_attitude`, in bytes.
#define ZR_ATTITUDE_MEMORY 6144

// Size of a buffer for the checkpoint of a `zr_attitude`, in bytes.
#define ZR_ATTITUDE_CHECKPOINT 5120

// Result code of a function. Only `ZR_OK` is zero.
typedef enum zr_code {
    // Success.
    ZR_OK = 0,
    // A required pointer is null.
    ZR_NULL = 1,
    // The memory is too small or misaligned.
    ZR_MEMORY = 2,
    // A parameter is out of range: `zr_drift_explain` and `zr_attitude_explain` name it.
    ZR_PARAMETER = 3,
    // The buffer is too small for this checkpoint.
    ZR_BUFFER = 4,
    // The bytes are not a checkpoint.
    ZR_NO_CHECKPOINT = 5,
    // The checkpoint belongs to another version of zerorate, or to another type.
    ZR_OTHER_CHECKPOINT = 6,
    // The checkpoint is damaged or incomplete.
    ZR_DAMAGED = 7,
    // An error of unknown cause.
    ZR_UNKNOWN = 8,
} zr_code;

// Status of a drift filter.
typedef enum zr_drift_status {
    // The bias is the mean to date.
    ZR_STARTING = 0,
    // The bias is the mean to date, since the learned scale was wrong by orders of magnitude.
    ZR_RESTARTING = 1,
    // The bias is learned.
    ZR_AT_REST = 2,
    // The bias is held.
    ZR_IN_MOTION = 3,
    // The sensor has moved since the start: no bias is known.
    ZR_NO_REST_YET = 4,
    // The bias is learned from apparent rest that may be motion.
    ZR_PROVISIONAL = 5,
    // The sensor repeats one sample: the bias is held.
    ZR_STUCK = 6,
} zr_drift_status;

// Status of an attitude.
typedef enum zr_attitude_status {
    // The first seconds.
    ZR_ATTITUDE_STARTING = 0,
    // The gyro has had no sample for more than 50 ms.
    ZR_ATTITUDE_RATE_MISSING = 1,
    // The force at rest is not gravity: the accelerometer's unit is wrong.
    ZR_ATTITUDE_WRONG_UNIT = 2,
    // The magnetic field is not the known field.
    ZR_ATTITUDE_DISTURBED = 3,
    // The sensor rests.
    ZR_ATTITUDE_AT_REST = 4,
    // The sensor moves.
    ZR_ATTITUDE_MOVING = 5,
    // A rate is at the gyro's range.
    ZR_ATTITUDE_CLIPPED = 6,
    // Gravity turns in the sensor as if the gyro had a different unit.
    ZR_ATTITUDE_WRONG_RATE_UNIT = 7,
    // The magnetometer repeats one value while the sensor turns.
    ZR_ATTITUDE_MAGNETOMETER_STUCK = 8,
    // The sensor rests with a bias beyond `bias_limit`, or is on a rate table.
    ZR_ATTITUDE_UNCLEAR = 9,
} zr_attitude_status;

// Methods of a drift filter.
typedef enum zr_method {
    // Tunes itself; recommended.
    ZR_AUTO = 0,
    // Fu & Han: a Kalman filter of an ARMA model of order (2, 1).
    ZR_KF = 1,
    // `ZR_KF` with a measurement noise that adapts with equal weights.
    ZR_AKF = 2,
    // `ZR_KF` with a measurement noise that adapts with fading memory, and an adaptive process
    // noise.
    ZR_FADING = 3,
} zr_method;

// Treatment of motion by a drift filter.
typedef enum zr_motion {
    // `ZR_MOTION_HOLD` for `ZR_AUTO`, `ZR_MOTION_IGNORE` for other methods.
    ZR_MOTION_USUAL = 0,
    // Learns at rest only and holds the bias in motion.
    ZR_MOTION_HOLD = 1,
    // Treats every sample as rest.
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

// Parameters of a drift filter. Zero means the default for every parameter except the rate.
typedef struct zr_drift_params {
    // Samples per second.
    double rate;
    // A `zr_method`.
    int32_t method;
    // A `zr_motion`.
    int32_t motion;
    // Output of `zr_drift_update`; zero: the sample minus the bias, otherwise the bias.
    int32_t estimate;
    // End of the sensor's range in the samples' unit; zero: no limit.
    double limit;
    // Largest standard deviation of the samples at rest; zero: unknown.
    double rest_limit;
    // Largest level that can be a bias; zero: unknown.
    double bias_limit;
    // Duration of the start-up, s; zero: 1 s.
    double startup;
    // Standard deviation of the noise; zero: it is learned.
    double scale;
    // Initial process noise of the drift, for all methods but `ZR_AUTO`; zero: 0.1.
    double process_noise;
} zr_drift_params;

// State after a sample, in the samples' unit.
typedef struct zr_drift_state {
    // The sensor's output without rotation.
    double bias;
    // Standard deviation of the bias. For `ZR_AUTO` it is for the mean bias over the next 10 s.
    // For other methods it follows from their model.
    double bias_sigma;
    // Samples to date, missing ones included.
    uint64_t samples;
    // Status of the filter.
    enum zr_drift_status status;
    // True if the bias is learned.
    bool at_rest;
} zr_drift_state;

// Parameters of an attitude. Zero means the default for every parameter except the rate.
typedef struct zr_attitude_params {
    // Samples per second, at least one.
    double rate;
    // A `zr_frame`.
    int32_t frame;
    // Not zero: there is a magnetometer. Zero: there is none, and the initial heading is zero.
    int32_t mag;
    // Size of the gyro's unit, rad/s; zero: 1.
    double gyro_unit;
    // Size of the accelerometer's unit, m/s²; zero: 1.
    double accel_unit;
    // Known output of the gyro without rotation, rad/s.
    double bias[3];
    // Standard deviation of `bias`, rad/s; zero: 1 deg/s.
    double bias_sigma[3];
    // Largest possible bias of the gyro, rad/s; zero: 10 deg/s.
    double bias_limit;
    // Range of the gyro, in its unit; zero: unknown. A rate beyond the range is missing.
    double gyro_range;
} zr_attitude_params;

// State after a sample.
typedef struct zr_attitude_state {
    // Quaternion from the sensor's axes to the earth's axes: w, x, y, z.
    double quaternion[4];
    // Roll, pitch and yaw, rad.
    double euler[3];
    // Direction of the sensor's x axis over ground, clockwise from north, rad.
    double heading;
    // Standard deviation of the angle between true and estimated vertical, rad.
    double tilt_sigma;
    // Standard deviation of the heading, rad.
    double heading_sigma;
    // Output of the gyro without rotation, in its unit.
    double bias[3];
    // Standard deviation of `bias`.
    double bias_sigma[3];
    // Specific force without gravity, in the accelerometer's axes and unit.
    double linear_acceleration[3];
    // Samples to date, missing ones included.
    uint64_t samples;
    // Status of the filter.
    enum zr_attitude_status status;
    // True if the sensor rests.
    bool at_rest;
    // True if the magnetic field is not the known field.
    bool disturbed;
} zr_attitude_state;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the text of a `zr_code`; it stays valid.
const char *zr_message(int32_t code);

// Returns the version of the library, such as "0.2.0"; it stays valid.
const char *zr_version(void);

// Returns the size of a `zr_drift` in bytes, at most `ZR_DRIFT_MEMORY`.
size_t zr_drift_size(void);

// Returns the alignment of a `zr_drift` in bytes.
size_t zr_drift_align(void);

// Writes the error in the parameters as text. Returns its length without the final zero, as
// `snprintf` does, or 0 if there is no error. `text` may be null if `size` is zero.
//
// # Safety
// `params` is null or valid; `text` has room for `size` bytes.
size_t zr_drift_explain(const struct zr_drift_params *params, char *text, size_t size);

// Creates a filter before its first sample in `memory`, which has `size` bytes. `filter` gets the
// filter's address, which is `memory`. The filter is valid until the memory is used for something
// else. Nothing has to be freed, and `memcpy` may copy the filter.
//
// # Safety
// `memory` has `size` bytes; `params` and `filter` are null or valid.
enum zr_code zr_drift_init(void *memory,
                           size_t size,
                           const struct zr_drift_params *params,
                           struct zr_drift **filter);

// Processes one sample; NaN is a missing sample. `rate` gets the sample minus the bias, or NaN for
// a missing sample. The call takes constant time.
//
// # Safety
// `filter` is null or was made by this library; `rate` is null or valid.
enum zr_code zr_drift_update(struct zr_drift *filter, double z, double *rate);

// Processes one sample; `moving` is true if the body is known to move. A constant output of the
// gyro is then no bias.
//
// # Safety
// As in `zr_drift_update`.
enum zr_code zr_drift_update_while(struct zr_drift *filter, double z, bool moving, double *rate);

// Processes `n` samples; results are bit-identical to single updates. `rate` may be `z`.
//
// # Safety
// `filter` is null or was made by this library; `z` and `rate` have `n` numbers.
enum zr_code zr_drift_process(struct zr_drift *filter, const double *z, double *rate, size_t n);

// Reads the state after the last sample.
//
// # Safety
// `filter` is null or was made by this library; `state` is null or valid.
enum zr_code zr_drift_read(const struct zr_drift *filter, struct zr_drift_state *state);

// Resets to the state before the first sample.
//
// # Safety
// `filter` is null or was made by this library.
enum zr_code zr_drift_reset(struct zr_drift *filter);

// Continues after the sensor was switched off and on. `ZR_AUTO` forgets the bias and keeps the
// noise. Other methods start again.
//
// # Safety
// `filter` is null or was made by this library.
enum zr_code zr_drift_power_on(struct zr_drift *filter);

// Writes a checkpoint into `buffer`, which has `size` bytes. `used` gets the number of bytes, at
// most `ZR_DRIFT_CHECKPOINT`.
//
// # Safety
// `filter` is null or was made by this library; `buffer` has `size` bytes; `used` is null
// or valid.
enum zr_code zr_drift_save(const struct zr_drift *filter,
                           uint8_t *buffer,
                           size_t size,
                           size_t *used);

// Restores the filter of the checkpoint `bytes` in `memory`. `filter` gets its address, as in
// `zr_drift_init`. The filter continues with bit-identical results. Bytes that are not a
// checkpoint are refused.
//
// # Safety
// `memory` has `size` bytes; `bytes` has `n` bytes; `filter` is null or valid.
enum zr_code zr_drift_restore(void *memory,
                              size_t size,
                              const uint8_t *bytes,
                              size_t n,
                              struct zr_drift **filter);

// Returns the size of a `zr_attitude` in bytes, at most `ZR_ATTITUDE_MEMORY`.
size_t zr_attitude_size(void);

// Returns the alignment of a `zr_attitude` in bytes.
size_t zr_attitude_align(void);

// Writes the error in the parameters as text, as `zr_drift_explain` does.
//
// # Safety
// `params` is null or valid; `text` has room for `size` bytes.
size_t zr_attitude_explain(const struct zr_attitude_params *params, char *text, size_t size);

// Creates an attitude before its first sample in `memory`, as `zr_drift_init` does.
//
// # Safety
// `memory` has `size` bytes; `params` and `attitude` are null or valid.
enum zr_code zr_attitude_init(void *memory,
                              size_t size,
                              const struct zr_attitude_params *params,
                              struct zr_attitude **attitude);

// Processes one sample of each sensor, three numbers each; NaN is missing. `mag` may be null. `dt`
// is the time since the previous sample, s; NaN means one period of the rate. `quaternion` gets w,
// x, y, z, from the sensor's axes to the earth's axes. The call takes constant time.
//
// # Safety
// `attitude` is null or was made by this library. `gyro`, `accel` and `mag` are null or have three
// numbers. `quaternion` is null or has four numbers.
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

// Resets to the state before the first sample.
//
// # Safety
// `attitude` is null or was made by this library.
enum zr_code zr_attitude_reset(struct zr_attitude *attitude);

// Continues after the sensor was switched off and on: resets the state, but keeps the gyro's
// matrix.
//
// # Safety
// `attitude` is null or was made by this library.
enum zr_code zr_attitude_power_on(struct zr_attitude *attitude);

// Writes a checkpoint of at most `ZR_ATTITUDE_CHECKPOINT` bytes, as `zr_drift_save` does.
//
// # Safety
// `attitude` is null or was made by this library; `buffer` has `size` bytes; `used` is null
// or valid.
enum zr_code zr_attitude_save(const struct zr_attitude *attitude,
                              uint8_t *buffer,
                              size_t size,
                              size_t *used);

// Restores the attitude of the checkpoint `bytes` in `memory`, as `zr_drift_restore` does.
//
// # Safety
// `memory` has `size` bytes; `bytes` has `n` bytes; `attitude` is null or valid.
enum zr_code zr_attitude_restore(void *memory,
                                 size_t size,
                                 const uint8_t *bytes,
                                 size_t n,
                                 struct zr_attitude **attitude);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ZERORATE_H */
