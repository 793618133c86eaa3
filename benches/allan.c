/* The speed that the deviations are held to, hand-written, for a record without gaps. `fused` takes
 * four averaging factors in turn over blocks that stay in the cache, `plain` one pass for each.
 *
 * Build: cc -O3 -march=native -ffast-math -shared -fPIC allan.c -o allan.so
 * (-ffast-math lets the compiler add up in vectors.)
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

enum { BLOCK = 4096, TOGETHER = 4 };

/* Sums of the samples less their mean, one more than there are samples. */
static double *phase(const double *z, size_t n) {
    double *x = malloc((n + 1) * sizeof *x), sum = 0.0, mean = 0.0;
    for (size_t i = 0; i < n; i++) mean += z[i];
    mean /= n;
    x[0] = 0.0;
    for (size_t i = 0; i < n; i++) x[i + 1] = sum += z[i] - mean;
    return x;
}

static double second(const double *x, size_t from, size_t to, size_t m) {
    double sum = 0.0;
    for (size_t i = from; i < to; i++) {
        double d = x[i + 2 * m] - 2.0 * x[i + m] + x[i];
        sum += d * d;
    }
    return sum;
}

static size_t at_most(size_t a, size_t b) { return a < b ? a : b; }

void oadev_plain(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n);
    for (size_t k = 0; k < count; k++) {
        size_t terms = n + 1 - 2 * m[k];
        out[k] = sqrt(second(x, 0, terms, m[k]) / (2.0 * terms)) / m[k];
    }
    free(x);
}

void oadev_fused(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n);
    for (size_t first = 0; first < count; first += TOGETHER) {
        size_t last = at_most(first + TOGETHER, count);
        double sums[TOGETHER] = {0};
        for (size_t start = 0; start <= n; start += BLOCK)
            for (size_t k = first; k < last; k++) {
                size_t end = at_most(start + BLOCK, n + 1 - 2 * m[k]);
                if (start < end) sums[k - first] += second(x, start, end, m[k]);
            }
        for (size_t k = first; k < last; k++)
            out[k] = sqrt(sums[k - first] / (2.0 * (n + 1 - 2 * m[k]))) / m[k];
    }
    free(x);
}

void ohdev_plain(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n);
    for (size_t k = 0; k < count; k++) {
        size_t terms = n + 1 - 3 * m[k];
        const double *a = x, *b = x + m[k], *c = b + m[k], *d = c + m[k];
        double sum = 0.0;
        for (size_t i = 0; i < terms; i++) {
            double t = d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i];
            sum += t * t;
        }
        out[k] = sqrt(sum / (6.0 * terms)) / m[k];
    }
    free(x);
}

void mdev_plain(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n);
    for (size_t k = 0; k < count; k++) {
        size_t terms = n + 2 - 3 * m[k];
        const double *a = x, *b = x + m[k], *c = b + m[k], *d = c + m[k];
        double window = 0.0, sum;
        for (size_t i = 0; i < m[k]; i++) window += c[i] - 2.0 * b[i] + a[i];
        sum = window * window;
        for (size_t j = 0; j + 1 < terms; j++) {
            window += d[j] - 3.0 * c[j] + 3.0 * b[j] - a[j];
            sum += window * window;
        }
        out[k] = sqrt(sum / (2.0 * terms)) / m[k] / m[k];
    }
    free(x);
}

void totdev_plain(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n), *y = malloc((3 * n + 1) * sizeof *y);
    for (size_t i = 0; i <= n; i++) y[n + i] = x[i];
    for (size_t i = 1; i <= n; i++) {
        y[n - i] = 2.0 * x[0] - x[i];
        y[2 * n + i] = 2.0 * x[n] - x[n - i];
    }
    for (size_t k = 0; k < count; k++)
        out[k] = sqrt(second(y + n - m[k], 1, n, m[k]) / (2.0 * (n - 1))) / m[k];
    free(y);
    free(x);
}

void theo1_plain(const double *z, size_t n, const size_t *m, size_t count, double *out) {
    double *x = phase(z, n);
    for (size_t k = 0; k < count; k++) {
        double total = 0.0;
        for (size_t delta = 1; delta <= m[k] / 2; delta++) {
            const double *a = x, *b = x + delta, *c = x + m[k] - delta, *d = x + m[k];
            double sum = 0.0;
            for (size_t i = 0; i + m[k] <= n; i++) {
                double t = (a[i] - b[i]) + (d[i] - c[i]);
                sum += t * t;
            }
            total += sum / delta;
        }
        out[k] = sqrt(total / (0.75 * (n + 1 - m[k]))) / m[k];
    }
    free(x);
}
