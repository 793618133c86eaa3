/* The mechanisation of the navigation filter, by hand: position, velocity and orientation, north,
   east, down, with coning and sculling of two samples. No covariance, no fixes, no checks. */
#include <math.h>
#include <stddef.h>

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void turn_by(const double *phi, double m[9])
{
    double x = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
    double s = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0));
    double c = 0.5 - x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0));
    double a[3] = {s * phi[0], s * phi[1], s * phi[2]};
    double b[3] = {c * phi[0], c * phi[1], c * phi[2]};
    m[0] = 1.0 - b[1] * phi[1] - b[2] * phi[2];
    m[4] = 1.0 - b[0] * phi[0] - b[2] * phi[2];
    m[8] = 1.0 - b[0] * phi[0] - b[1] * phi[1];
    m[1] = b[0] * phi[1] - a[2];
    m[3] = b[0] * phi[1] + a[2];
    m[2] = b[0] * phi[2] + a[1];
    m[6] = b[0] * phi[2] - a[1];
    m[5] = b[1] * phi[2] - a[0];
    m[7] = b[1] * phi[2] + a[0];
}

/* state: C (9), velocity (3), latitude, longitude, height; out: the last six after each sample. */
void strapdown(double *state, const double *gyro, const double *accel, size_t n, double dt,
               double *out)
{
    const double rate = 7.292115e-5, a = 6378137.0, e2 = 6.6943799901413e-3;
    double *C = state, *v = state + 9, *place = state + 12;
    double earth[3] = {0}, north = 0, across = 0, tangent = 0, east = 0, gravity = 0;
    for (size_t k = 1; k < n; k++) {
        const double *w0 = gyro + 3 * (k - 1), *w1 = gyro + 3 * k;
        const double *f0 = accel + 3 * (k - 1), *f1 = accel + 3 * k;
        if (k % 10 == 1) {
            double sine = sin(place[0]), cosine = cos(place[0]);
            double w = 1.0 - e2 * sine * sine, root = sqrt(w);
            earth[0] = rate * cosine;
            earth[2] = -rate * sine;
            north = 1.0 / (a * (1.0 - e2) / (w * root) + place[2]);
            across = 1.0 / (a / root + place[2]);
            east = across / cosine;
            tangent = sine / cosine;
            gravity = 9.7803253359 * (1.0 + 1.931852653e-3 * sine * sine) / root
                      * (1.0 - 2.0 * place[2] / a);
        }
        double turn[3], gain[3], mean[3], c1[3], c2[3], c3[3], c4[3];
        cross(w0, w1, c1);
        cross(w0, f1, c2);
        cross(f0, w1, c3);
        for (int i = 0; i < 3; i++) {
            turn[i] = 0.5 * (w0[i] + w1[i]) * dt;
            mean[i] = 0.5 * (f0[i] + f1[i]) * dt;
        }
        cross(turn, mean, c4);
        for (int i = 0; i < 3; i++) {
            gain[i] = mean[i] + (c2[i] + c3[i]) * dt * dt / 12.0 + 0.5 * c4[i];
            turn[i] += c1[i] * dt * dt / 12.0;
        }
        double transport[3] = {v[1] * across, -v[0] * north, -v[1] * across * tangent};
        double both[3], two[3], f[3], x1[3], x2[3];
        for (int i = 0; i < 3; i++) {
            both[i] = earth[i] + transport[i];
            two[i] = both[i] + earth[i];
            f[i] = C[3 * i] * gain[0] + C[3 * i + 1] * gain[1] + C[3 * i + 2] * gain[2];
        }
        cross(two, v, x1);
        cross(both, f, x2);
        double before[3] = {v[0], v[1], v[2]};
        for (int i = 0; i < 3; i++)
            v[i] += f[i] - (x1[i] + 0.5 * x2[i]) * dt + (i == 2 ? gravity * dt : 0.0);
        place[0] += 0.5 * (before[0] + v[0]) * dt * north;
        place[1] += 0.5 * (before[1] + v[1]) * dt * east;
        place[2] -= 0.5 * (before[2] + v[2]) * dt;
        double M[9], T[9], D[9];
        turn_by(turn, M);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                T[3 * i + j] = C[3 * i] * M[j] + C[3 * i + 1] * M[3 + j] + C[3 * i + 2] * M[6 + j];
        for (int j = 0; j < 3; j++) {
            D[j] = both[1] * T[6 + j] - both[2] * T[3 + j];
            D[3 + j] = both[2] * T[j] - both[0] * T[6 + j];
            D[6 + j] = both[0] * T[3 + j] - both[1] * T[j];
        }
        for (int i = 0; i < 9; i++)
            C[i] = T[i] - D[i] * dt;
        for (int i = 0; i < 3; i++) {
            out[6 * k + i] = v[i];
            out[6 * k + 3 + i] = place[i];
        }
    }
}
