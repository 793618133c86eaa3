/* The speed that the grid of ARMA models is held to, hand-written: conditional least squares of all
 * orders up to (3, 3) on one record without gaps, every order from the optima of the two below it,
 * by Gauss and Newton with Levenberg's damping. All derivatives are carried along sample by sample.
 *
 * Build: cc -O3 -march=native -ffast-math -shared -fPIC arma.c -o arma.so
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

enum { TOP = 3, SIZE = 2 * TOP + 1, PASSES = 50 };

typedef struct {
    double gram[SIZE][SIZE], descent[SIZE], rss;
} Normal;

/* One residual and its derivatives; before the record samples are at their mean, zero. */
static inline void step(const double *y, size_t t, int p, int q, const double *b,
                        double e[TOP], double d[TOP][SIZE], double x[SIZE], double *residual) {
    int m = p + q + 1;
    double r = y[t] - b[p + q];
    for (int i = 0; i < p; i++) x[i] = t > (size_t)i ? y[t - 1 - i] : 0.0, r -= b[i] * x[i];
    for (int j = 0; j < q; j++) r -= b[p + j] * e[j], x[p + j] = e[j];
    x[p + q] = 1.0;
    for (int j = 0; j < q; j++)
        for (int k = 0; k < m; k++) x[k] -= b[p + j] * d[j][k];
    for (int j = q - 1; j > 0; j--) {
        e[j] = e[j - 1];
        memcpy(d[j], d[j - 1], sizeof d[j]);
    }
    if (q) e[0] = r, memcpy(d[0], x, SIZE * sizeof *x);
    *residual = r;
}

static void accumulate(const double *y, size_t n, int p, int q, const double *b, Normal *out) {
    int m = p + q + 1;
    double e[TOP] = {0}, d[TOP][SIZE] = {{0}}, x[SIZE], r;
    memset(out, 0, sizeof *out);
    for (size_t t = 0; t < TOP; t++) step(y, t, p, q, b, e, d, x, &r);
    for (size_t t = TOP; t < n; t++) {
        step(y, t, p, q, b, e, d, x, &r);
        out->rss += r * r;
        for (int i = 0; i < m; i++) {
            out->descent[i] += x[i] * r;
            for (int k = 0; k <= i; k++) out->gram[i][k] += x[i] * x[k];
        }
    }
}

/* Solves with the diagonal raised by a factor; 0 if that is not positive definite. */
static int solve(const Normal *a, int m, double damping, double *x) {
    double l[SIZE][SIZE];
    for (int i = 0; i < m; i++)
        for (int j = 0; j <= i; j++) {
            double s = a->gram[i][j] * (i == j ? 1.0 + damping : 1.0);
            for (int k = 0; k < j; k++) s -= l[i][k] * l[j][k];
            if (i == j && !(s > 0.0)) return 0;
            l[i][j] = i == j ? sqrt(s) : s / l[j][j];
        }
    for (int i = 0; i < m; i++) {
        x[i] = a->descent[i];
        for (int k = 0; k < i; k++) x[i] -= l[i][k] * x[k];
        x[i] /= l[i][i];
    }
    for (int i = m - 1; i >= 0; i--) {
        for (int k = i + 1; k < m; k++) x[i] -= l[k][i] * x[k];
        x[i] /= l[i][i];
    }
    return 1;
}

static int invertible(const double *theta, int q) {
    double a[TOP], c[TOP];
    memcpy(a, theta, q * sizeof *a);
    for (int k = q; k > 0; k--) {
        double r = a[k - 1];
        if (!(fabs(r) < 1.0)) return 0;
        for (int j = 0; j < k - 1; j++) c[j] = (a[j] - r * a[k - 2 - j]) / (1.0 - r * r);
        memcpy(a, c, sizeof c);
    }
    return 1;
}

/* Ends where a step is a hundredth of a standard error; returns the passes over the record. */
static int minimise(const double *y, size_t n, int p, int q, double *b, double *rss) {
    int m = p + q + 1, passes = 1;
    double damping = 1e-3, x[SIZE], trial[SIZE];
    Normal at, next;
    accumulate(y, n, p, q, b, &at);
    while (passes < PASSES && damping < 1e8) {
        double length = 0.0;
        if (solve(&at, m, 0.0, x)) {
            for (int i = 0; i < m; i++) length += x[i] * at.descent[i];
            if (length <= 1e-4 * at.rss / n) break;
        }
        if (!solve(&at, m, damping, x)) {
            damping *= 10.0;
            continue;
        }
        for (int i = 0; i < m; i++) trial[i] = b[i] + x[i];
        if (!invertible(trial + p, q)) {
            damping *= 10.0;
            continue;
        }
        accumulate(y, n, p, q, trial, &next);
        passes++;
        if (next.rss <= at.rss) {
            memcpy(b, trial, sizeof trial), at = next, damping /= 10.0;
        } else {
            damping *= 10.0;
        }
    }
    *rss = at.rss;
    return passes;
}

/* Variances of the innovations, row after row of one p; returns all passes over the record. */
int arma_grid(const double *z, size_t n, double *y, double *sigma2) {
    double best[TOP + 1][TOP + 1][SIZE] = {{{0}}}, mean = 0.0;
    int passes = 0;
    for (size_t t = 0; t < n; t++) mean += z[t] / n;
    for (size_t t = 0; t < n; t++) y[t] = z[t] - mean;
    for (int p = 0; p <= TOP; p++)
        for (int q = 0; q <= TOP; q++) {
            double least = INFINITY;
            for (int from = 0; from < 3; from++) {
                double b[SIZE] = {0}, rss;
                int i = p - (from == 0), j = q - (from == 1);
                if (i < 0 || j < 0 || (from == 2 && (p != 1 || q != 1) && p + q)) continue;
                if (from < 2) {
                    memcpy(b, best[i][j], i * sizeof *b);
                    memcpy(b + p, best[i][j] + i, j * sizeof *b);
                    b[p + q] = best[i][j][i + j];
                } else if (p) {
                    b[0] = 1.0 - 10.0 / n, b[1] = 100.0 / n - 1.0;
                }
                passes += minimise(y, n, p, q, b, &rss);
                if (rss < least) least = rss, memcpy(best[p][q], b, sizeof b);
            }
            sigma2[p * (TOP + 1) + q] = least / (n - TOP);
        }
    return passes;
}
