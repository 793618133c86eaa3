/* The speed that StreamingAllan is held to: the fully overlapping Allan variance alone at all
 * octaves, hand-written on a ring of phases. It has no Hadamard variance, no missing samples and no
 * origin, so it loses precision on an offset: a floor and not an estimator to use.
 *
 * Build: cc -O3 -march=native -shared -fPIC streaming.c -o streaming.so
 */
#include <stddef.h>
#include <stdlib.h>

typedef struct {
    size_t octaves, mask, count;
    double phase, *ring, sums[32];
} allan;

allan *allan_new(size_t octaves) {
    allan *s = calloc(1, sizeof(allan));
    size_t room = (size_t)4 << (octaves - 1);
    s->octaves = octaves;
    s->mask = room - 1;
    s->ring = calloc(room, sizeof(double));
    return s;
}

void allan_free(allan *s) {
    free(s->ring);
    free(s);
}

void allan_process(allan *s, const double *z, size_t n) {
    const double *ring = s->ring;
    for (size_t i = 0; i < n; i++) {
        size_t k = ++s->count;
        double x = s->phase += z[i], middle;
        s->ring[k & s->mask] = x;
        for (size_t j = 0, m = 1; j < s->octaves && 2 * m <= k; j++, m *= 2) {
            middle = ring[(k - m) & s->mask];
            double d = (x - middle) - (middle - ring[(k - 2 * m) & s->mask]);
            s->sums[j] += d * d;
        }
    }
}

void allan_variances(const allan *s, double *out) {
    for (size_t j = 0, m = 1; j < s->octaves; j++, m *= 2) {
        out[j] = s->sums[j] / (2.0 * (double)(s->count + 1 - 2 * m) * (double)m * (double)m);
    }
}
