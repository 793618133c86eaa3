/* The speed that ImuCorrector is held to: the same matrices by hand, without missing samples,
 * without bounds, into memory that is there: a floor and not a corrector to use.
 *
 * Build: cc -O3 -march=native -shared -fPIC corrector.c -o corrector.so
 */
#include <stddef.h>

typedef struct {
    double gyro[9], gyro_bias[3], accel[9], accel_bias[3], felt[9];
    double reference, low, high, coefficients[12];
} correction;

static void times(const double *m, const double *v, double *out) {
    for (int i = 0; i < 3; i++)
        out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

void correct_3(const correction *c, const double *z, size_t n, double *rate) {
    for (size_t k = 0; k < n; k++, z += 3, rate += 3) {
        double v[3];
        for (int i = 0; i < 3; i++) v[i] = z[i] - c->gyro_bias[i];
        times(c->gyro, v, rate);
    }
}

static void both(const correction *c, const double *z, const double *bias, double *rate,
                 double *force) {
    double v[3], felt[3];
    for (int i = 0; i < 3; i++) v[i] = z[3 + i] - c->accel_bias[i];
    times(c->accel, v, force);
    times(c->felt, force, felt);
    for (int i = 0; i < 3; i++) v[i] = z[i] - bias[i] - felt[i];
    times(c->gyro, v, rate);
}

void correct_6(const correction *c, const double *z, size_t n, double *rate, double *force) {
    for (size_t k = 0; k < n; k++, z += 6, rate += 3, force += 3)
        both(c, z, c->gyro_bias, rate, force);
}

void correct_7(const correction *c, const double *z, size_t n, double *rate, double *force) {
    double span = c->high - c->low;
    for (size_t k = 0; k < n; k++, z += 7, rate += 3, force += 3) {
        double t = z[6], bias[3];
        double inside = t < c->low ? c->low : t > c->high ? c->high : t;
        double beyond = t < c->low - span ? c->low - span : t > c->high + span ? c->high + span : t;
        double x = (inside - c->reference) * 0.1, dx = (beyond - inside) * 0.1;
        for (int i = 0; i < 3; i++) {
            const double *p = c->coefficients + 4 * i;
            double slope = (3.0 * p[3] * x + 2.0 * p[2]) * x + p[1];
            bias[i] = ((p[3] * x + p[2]) * x + p[1]) * x + p[0] + slope * dx;
        }
        both(c, z, bias, rate, force);
    }
}
