/* The speed that the filter is held to: the same chain, ARMA(2, 1), hand-written with the same
 * identities on plain doubles or, with -DLANES=4, on vectors of one double a channel. It has no
 * start-up, no missing samples, no limits and, without -DGUARD, no guard of the process noise, so it
 * is a floor and not a filter to use. With -DLEARNED=12000 the model is learned from so many samples.
 *
 * Build: cc -O3 -march=native -shared -fPIC reference.c -o reference.so
 */
#include <stddef.h>
#include <string.h>

#ifdef LANES
typedef double number __attribute__((vector_size(8 * LANES), aligned(8)));
#else
#define LANES 1
typedef double number;
#endif

typedef struct {
    number b, r, weight_sum, last;         /* Allan measurement noise */
    number beta[4], f[4], c[10];           /* least squares; upper triangle of the covariance */
    number x[3], p[6], g[6];               /* Kalman; 00 01 02 11 12 22 */
    number k;                              /* Sage-Husa */
#ifdef LEARNED
    size_t seen;
#endif
} chain;

static inline number all(double x) { return (number){0} + x; }

void chain_init(chain *s, double b, double g0, double k0) {
    *s = (chain){.b = all(b), .r = all(1.0), .weight_sum = all(1.0), .k = all(k0)};
    s->f[3] = all(1.0);
    s->c[0] = s->c[4] = s->c[7] = s->c[9] = all(1.0);
    s->p[0] = s->p[3] = s->p[5] = all(g0);
    s->g[0] = s->g[3] = s->g[5] = all(g0);
}

#ifdef GUARD
/* `alpha`, or as far as G + alpha K Kt may sink before it meets a floor: -1 / (Kt (G - floor)^-1 K),
 * by elimination without a division as in the filter that is compared. */
static inline double guarded(const double *g, double k0, double k1, double k2, double alpha) {
    double d0 = g[0] - 1e-12;
    double d1 = d0 * (g[3] - 1e-12) - g[1] * g[1];
    double d2 = d0 * g[4] - g[1] * g[2];
    double d3 = d0 * (g[5] - 1e-12) - g[2] * g[2];
    double v1 = d0 * k1 - g[1] * k0, v2 = d0 * k2 - g[2] * k0;
    double last = d1 * d3 - d2 * d2;
    v2 = d1 * v2 - d2 * v1;
    double slope = ((k0 * k0) * d1 + v1 * v1) * last + v2 * v2, height = d0 * d1 * last;
    if (d0 <= 0.0 || d1 <= 0.0 || last <= 0.0) {
        height = 0.0, slope = 1.0;
    }
    return alpha < 0.0 && -alpha * slope >= height ? -height / slope : alpha;
}
#endif

static inline number step(chain *s, number y) {
    /* R, FH 31 */
    number d = y - s->last;
    s->weight_sum = s->b * s->weight_sum + 1.0;
    s->r += (0.5 * d * d - s->r) / s->weight_sum;
    s->last = y;

    /* prediction, FH 19 and 20 */
    number a0 = s->beta[0], a1 = s->beta[1], *p = s->p, *g = s->g, *x = s->x;
    number u0 = p[0] * a0 + p[1] * a1 + p[2];
    number u1 = p[1] * a0 + p[3] * a1 + p[4];
    number u2 = p[2] * a0 + p[4] * a1 + p[5];
    number q00 = a0 * u0 + a1 * u1 + u2 + g[0];
    number q01 = u0 + g[1], q02 = u2 + g[2];
    number q11 = p[0] + g[3], q12 = p[2] + g[4], q22 = p[5] + g[5];
    number x0 = a0 * x[0] + a1 * x[1] + x[2], x1 = x[0], x2 = x[2];

    /* correction, FH 21 to 24 */
    number variance = q00 + s->r, inverse = 1.0 / variance;
    number k0 = q00 * inverse, k1 = q01 * inverse, k2 = q02 * inverse;
    number e = y - x0;
    x[0] = x0 + k0 * e;
    x[1] = x1 + k1 * e;
    x[2] = x2 + k2 * e;
    p[0] = q00 - k0 * q00;
    p[1] = q01 - k0 * q01;
    p[2] = q02 - k0 * q02;
    p[3] = q11 - k1 * q01;
    p[4] = q12 - k1 * q02;
    p[5] = q22 - k2 * q02;

    /* G, FH 25 as a rank-one update */
    s->k += 1.0;
    number alpha = (e * e - variance) / s->k;
#ifdef GUARD
    alpha = guarded(g, k0, k1, k2, alpha);
#endif
    number s0 = alpha * k0, s1 = alpha * k1, s2 = alpha * k2;
    g[0] += s0 * k0;
    g[1] += s0 * k1;
    g[2] += s0 * k2;
    g[3] += s1 * k1;
    g[4] += s1 * k2;
    g[5] += s2 * k2;

    /* model, FH 10 to 13 */
#ifdef LEARNED
    if (s->seen++ >= LEARNED) {
        return x[0];
    }
#endif
    number *c = s->c, *f = s->f, *beta = s->beta;
    number v0 = c[0] * f[0] + c[1] * f[1] + c[2] * f[2] + c[3];
    number v1 = c[1] * f[0] + c[4] * f[1] + c[5] * f[2] + c[6];
    number v2 = c[2] * f[0] + c[5] * f[1] + c[7] * f[2] + c[8];
    number v3 = c[3] * f[0] + c[6] * f[1] + c[8] * f[2] + c[9];
    number w = 1.0 / (1.0 + f[0] * v0 + f[1] * v1 + f[2] * v2 + v3);
    number error = y - (beta[0] * f[0] + beta[1] * f[1] + beta[2] * f[2] + beta[3]);
    number h0 = v0 * w, h1 = v1 * w, h2 = v2 * w, h3 = v3 * w;
    beta[0] += h0 * error;
    beta[1] += h1 * error;
    beta[2] += h2 * error;
    beta[3] += h3 * error;
    c[0] -= h0 * v0;
    c[1] -= h0 * v1;
    c[2] -= h0 * v2;
    c[3] -= h0 * v3;
    c[4] -= h1 * v1;
    c[5] -= h1 * v2;
    c[6] -= h1 * v3;
    c[7] -= h2 * v2;
    c[8] -= h2 * v3;
    c[9] -= h3 * v3;
    number residual = y - (beta[0] * f[0] + beta[1] * f[1] + beta[2] * f[2] + beta[3]);
    f[1] = f[0];
    f[0] = y;
    f[2] = residual;
    return x[0];
}

/* Rows of LANES samples. */
void chain_process(chain *state, const double *z, double *out, size_t n) {
    chain s = *state;
    for (size_t i = 0; i < n; i++) {
        number y;
        memcpy(&y, z + i * LANES, sizeof y);
        y = step(&s, y);
        memcpy(out + i * LANES, &y, sizeof y);
    }
    *state = s;
}

size_t chain_size(void) { return sizeof(chain); }

#ifdef PYTHON_MODULE
/* The same chain as a hand-written extension type-free module: `update(float) -> float` on one
 * global filter, the least that a call from Python can cost. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

static chain only;

static PyObject *update(PyObject *module, PyObject *z) {
    (void)module;
    double y = PyFloat_AsDouble(z);
    if (y == -1.0 && PyErr_Occurred()) {
        return NULL;
    }
    return PyFloat_FromDouble(step(&only, y));
}

static PyMethodDef methods[] = {{"update", update, METH_O, "one sample"}, {NULL, NULL, 0, NULL}};
static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "reference", NULL, -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit_reference(void) {
    chain_init(&only, 0.97, 0.1, 100.0);
    return PyModule_Create(&module);
}
#endif
