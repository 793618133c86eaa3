/* The speed that the choice of an autoregression's order is held to, hand-written, for a record
 * without gaps: mean, lagged products, all orders from one Cholesky factor, three criteria.
 * `plain` takes the products lag by lag, `fused` together over blocks that stay in the cache.
 *
 * Build: cc -O3 -march=native -ffast-math -shared -fPIC autoregression.c -o autoregression.so
 * (-ffast-math lets the compiler add up in vectors.)
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 2048, LARGEST = 16, FUSED = 10 };

static double mean(const double *z, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += z[i];
    return sum / n;
}

/* Residual sums of orders 0..p from G, the products of [y_(t-1) .. y_(t-p), y_t]. */
static void nested(double G[LARGEST][LARGEST], int p, double *rss) {
    double L[LARGEST][LARGEST];
    for (int i = 0; i <= p; i++)
        for (int j = 0; j <= i; j++) {
            double sum = G[i][j];
            for (int k = 0; k < j; k++) sum -= L[i][k] * L[j][k];
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    rss[p] = L[p][p] * L[p][p];
    for (int k = p; k > 0; k--) rss[k - 1] = rss[k] + L[p][k - 1] * L[p][k - 1];
}

/* From the products of lags 0..p over t >= p, the samples at both ends of y, and the mean of each
 * column: sigma2, FPE, AIC and BIC of orders 0..p. */
static void finish(const double *products, const double *first, const double *last, double sum,
                   size_t n, int p, double *out) {
    double S[LARGEST][LARGEST], sums[LARGEST], G[LARGEST][LARGEST], rss[LARGEST];
    sums[0] = sum;
    for (int i = 0; i <= p; i++) S[0][i] = S[i][0] = products[i];
    for (int i = 0; i < p; i++) {
        sums[i + 1] = sums[i] + first[p - 1 - i] - last[p - 1 - i];
        for (int j = 0; j < p; j++)
            S[i + 1][j + 1] = S[i][j] + first[p - 1 - i] * first[p - 1 - j]
                            - last[p - 1 - i] * last[p - 1 - j];
    }
    for (int i = 0; i <= p; i++)
        for (int j = 0; j <= p; j++) {
            int a = (i + 1) % (p + 1), b = (j + 1) % (p + 1);
            G[i][j] = S[a][b] - sums[a] * sums[b] / n;
        }
    nested(G, p, rss);
    for (int k = 0; k <= p; k++) {
        double sigma2 = rss[k] / n;
        out[4 * k] = sigma2;
        out[4 * k + 1] = sigma2 * (n + k + 1) / (n - k - 1);
        out[4 * k + 2] = n * log(sigma2) + 2 * (k + 1);
        out[4 * k + 3] = n * log(sigma2) + (k + 1) * log((double)n);
    }
}

void order_plain(const double *z, size_t n, int p, double *out) {
    double *y = malloc(n * sizeof *y), m = mean(z, n), products[LARGEST] = {0}, sum = 0.0;
    for (size_t i = 0; i < n; i++) y[i] = z[i] - m;
    for (int j = 0; j <= p; j++)
        for (size_t t = p; t < n; t++) products[j] += y[t] * y[t - j];
    for (size_t t = p; t < n; t++) sum += y[t];
    finish(products, y, y + n - p, sum, n - p, p, out);
    free(y);
}

/* Eleven products at once for p = 10: constant bounds let the compiler keep them in registers. */
void order_fused(const double *z, size_t n, int p, double *out) {
    double y[FUSED + BLOCK], m = mean(z, n), products[LARGEST] = {0}, sum = 0.0;
    double first[FUSED], last[FUSED];
    (void)p;
    for (int i = 0; i < FUSED; i++) first[i] = z[i] - m, last[i] = z[n - FUSED + i] - m;
    for (size_t start = FUSED; start < n; start += BLOCK) {
        size_t count = n - start < BLOCK ? n - start : BLOCK;
        for (size_t i = 0; i < count + FUSED; i++) y[i] = z[start - FUSED + i] - m;
        double s[FUSED + 1] = {0};
        for (size_t i = 0; i < count; i++) {
            double target = y[i + FUSED];
            sum += target;
#define LAG(j) s[j] += target * y[i + FUSED - j];
            LAG(0) LAG(1) LAG(2) LAG(3) LAG(4) LAG(5) LAG(6) LAG(7) LAG(8) LAG(9) LAG(10)
        }
        for (int j = 0; j <= FUSED; j++) products[j] += s[j];
    }
    finish(products, first, last, sum, n - FUSED, FUSED, out);
}
