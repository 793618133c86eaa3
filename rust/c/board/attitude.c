/* The sums of examples/attitude.cpp, without C++: six axes, then nine. */
#include <math.h>
#include <stdalign.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "zerorate.h"

static alignas(16) unsigned char memory[ZR_ATTITUDE_MEMORY];
static uint8_t saved[ZR_ATTITUDE_CHECKPOINT];

static double noise(uint32_t *seed)
{
    *seed = *seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return (double)(*seed >> 8) / 16777216.0 - 0.5;
}

static int run(int mag)
{
    struct zr_attitude_params params = {.rate = 100.0, .mag = mag};
    struct zr_attitude *attitude;
    if (zr_attitude_init(memory, sizeof memory, &params, &attitude) != ZR_OK) return 1;

    uint32_t seed = 7;
    uint64_t sum = UINT64_C(14695981039346656037);
    for (int k = 0; k < 3000; k++) {
        double turn = k < 1000 ? 0.0 : (k / 100 % 2 ? 0.5 : -0.5);
        double gyro[3], accel[3], field[3], q[4];
        gyro[0] = 0.01 + 0.01 * noise(&seed) + turn;
        gyro[1] = -0.02 + 0.01 * noise(&seed);
        gyro[2] = 0.005 + 0.01 * noise(&seed) - 0.5 * turn;
        accel[0] = 0.1 * noise(&seed);
        accel[1] = 0.1 * noise(&seed);
        accel[2] = 9.81 + 0.1 * noise(&seed);
        field[0] = 0.1 * noise(&seed);
        field[1] = 20.0;
        field[2] = -40.0;
        zr_attitude_update(attitude, gyro, accel, mag ? field : NULL, NAN, q);
        for (int i = 0; i < 4; i++) {
            uint64_t bits;
            memcpy(&bits, &q[i], sizeof bits);
            sum = (sum ^ bits) * UINT64_C(1099511628211);
        }
        if (k == 1500) {
            size_t used;
            if (zr_attitude_save(attitude, saved, sizeof saved, &used) != ZR_OK) return 1;
            if (zr_attitude_restore(memory, sizeof memory, saved, used, &attitude) != ZR_OK) return 1;
        }
    }
    printf("sum %08lx%08lx\n", (unsigned long)(sum >> 32), (unsigned long)(sum & 0xffffffff));
    return 0;
}

int main(void)
{
    return run(0) || run(1);
}
