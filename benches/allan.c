/* The speed that the deviations are held to, hand-written for a record without gaps.
 *
 * Build: cc -O3 -march=native -shared -fPIC allan.c -o allan.so
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

/* Sums of the samples less their mean, one more than there are samples. */
static double *phase(const double *z, size_t n) {
    double *x = malloc((n + 1) * sizeof *x), sum = 0.0, mean = 0.0;
    for (size_t i = 0; i < n; i++) mean += z[i];
    mean /= n;
    x[0] = 0.0;
    for (size_t i = 0; i < n; i++) x[i + 1] = sum += z[i] - mean;
    return x;
}

static double allan(const double *x, size_t points, size_t m) {
    size_t terms = points - 2 * m;
    double sum[4] = {0};
    for (size_t i = 0; i < terms; i++) {
        double d = x[i + 2 * m] - 2.0 * x[i + m] + x[i];
        sum[i & 3] += d * d;
    }
    return sqrt((sum[0] + sum[1] + sum[2] + sum[3]) / (2.0 * terms)) / m;
}
