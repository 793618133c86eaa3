/* A gyro whose bias is learned at rest and held in motion, in static memory; a restart halfway.
 * gcc drift.c -I../include -L../../../target/release -l:libzerorate.a -lm -o drift && ./drift */
#include <math.h>
#include <stdalign.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "zerorate.h"

static alignas(16) unsigned char memory[ZR_DRIFT_MEMORY];
static uint8_t saved[ZR_DRIFT_CHECKPOINT];

/* The sum of all outputs' bits, FNV-1a: to be compared with that of another program. */
static uint64_t sum_of(uint64_t sum, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return isnan(x) ? sum : (sum ^ bits) * UINT64_C(1099511628211);
}

/* deg/s: 20 s of rest, then a turn to and fro every two seconds; every 97th sample is lost. */
static double sample(int k, uint32_t *seed)
{
    *seed = *seed * UINT32_C(1664525) + UINT32_C(1013904223);
    double noise = (double)(*seed >> 8) / 16777216.0 - 0.5;
    double turn = k < 2000 ? 0.0 : (k / 200 % 2 ? 30.0 : -30.0);
    return k % 97 == 96 ? NAN : 0.5 + 0.25 * noise + turn;
}

static int failed(zr_code code)
{
    if (code != ZR_OK) fprintf(stderr, "%s\n", zr_message(code));
    return code != ZR_OK;
}

int main(void)
{
    /* What is zero has its default. */
    struct zr_drift_params params = {.rate = 100.0, .rest_limit = 10.0, .bias_limit = 20.0};
    struct zr_drift *gyro;
    if (failed(zr_drift_init(memory, sizeof memory, &params, &gyro))) return 1;

    uint32_t seed = 1;
    uint64_t sum = UINT64_C(14695981039346656037);
    for (int k = 0; k < 6000; k++) {
        double rate;
        if (failed(zr_drift_update(gyro, sample(k, &seed), &rate))) return 1;
        sum = sum_of(sum, rate);
        if (k == 3000) { /* Switched off and on: goes on as if nothing had been. */
            size_t used;
            if (failed(zr_drift_save(gyro, saved, sizeof saved, &used))) return 1;
            memset(memory, 0xff, sizeof memory);
            if (failed(zr_drift_restore(memory, sizeof memory, saved, used, &gyro))) return 1;
        }
    }

    struct zr_drift_state known;
    if (failed(zr_drift_read(gyro, &known))) return 1;
    printf("bias %.4f +- %.4f deg/s, in truth 0.5\n", known.bias, known.bias_sigma);
    printf("%s\n", known.status == ZR_IN_MOTION ? "in motion" : "at rest");

    /* What is wrong is said in words. */
    char why[100];
    params.rate = -1.0;
    if (zr_drift_init(memory, sizeof memory, &params, &gyro) == ZR_PARAMETER) {
        zr_drift_explain(&params, why, sizeof why);
        printf("refused: %s\n", why);
    }
    printf("sum %08lx%08lx\n", (unsigned long)(sum >> 32), (unsigned long)(sum & 0xffffffff));
    return 0;
}
