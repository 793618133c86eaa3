/* The speed that the count of reversals is held to, hand-written: insertion sort of small blocks,
 * then merges of doubles with one scratch buffer.
 *
 * Build: cc -O3 -march=native -shared -fPIC reversals.c -o reversals.so
 */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 16 };

static uint64_t insert(double *y, size_t n) {
    uint64_t count = 0;
    for (size_t k = 1; k < n; k++) {
        double value = y[k];
        size_t place = k;
        for (; place > 0 && y[place - 1] > value; place--) y[place] = y[place - 1];
        y[place] = value;
        count += k - place;
    }
    return count;
}

static uint64_t merge(double *y, size_t middle, size_t n, double *left) {
    uint64_t count = 0;
    size_t i = 0, j = middle, k = 0;
    if (y[middle - 1] <= y[middle]) return 0;
    memcpy(left, y, middle * sizeof *y);
    while (i < middle && j < n) {
        if (left[i] <= y[j]) {
            y[k++] = left[i++];
        } else {
            y[k++] = y[j++];
            count += middle - i;
        }
    }
    memcpy(y + k, left + i, (middle - i) * sizeof *y);
    return count;
}

static uint64_t sort(double *y, size_t n, double *scratch) {
    if (n <= BLOCK) return insert(y, n);
    size_t middle = n / 2;
    uint64_t within = sort(y, middle, scratch) + sort(y + middle, n - middle, scratch);
    return within + merge(y, middle, n, scratch);
}

uint64_t reversals(const double *z, size_t n) {
    double *y = malloc(n * sizeof *y), *scratch = malloc((n / 2 + 1) * sizeof *y);
    memcpy(y, z, n * sizeof *y);
    uint64_t count = sort(y, n, scratch);
    free(scratch);
    free(y);
    return count;
}
