"""The chain of ``reference.c`` in plain Python, compiled by numba."""

import numpy as np


def process(z):
    b, count = 0.97, 100.0
    r, weights, last = 1.0, 1.0, 0.0
    beta, f, c = np.zeros(4), np.array([0.0, 0.0, 0.0, 1.0]), np.eye(4)
    x, p, g = np.zeros(3), 0.1 * np.eye(3), 0.1 * np.eye(3)
    u, k, v = np.zeros(3), np.zeros(3), np.zeros(4)
    q = np.zeros((3, 3))
    out = np.empty_like(z)
    for n in range(z.size):
        y = z[n]
        weights = b * weights + 1.0
        r += (0.5 * (y - last) ** 2 - r) / weights
        last = y
        for i in range(3):
            u[i] = p[i, 0] * beta[0] + p[i, 1] * beta[1] + p[i, 2]
        q[0, 0] = beta[0] * u[0] + beta[1] * u[1] + u[2] + g[0, 0]
        q[0, 1] = u[0] + g[0, 1]
        q[0, 2] = u[2] + g[0, 2]
        q[1, 1] = p[0, 0] + g[1, 1]
        q[1, 2] = p[0, 2] + g[1, 2]
        q[2, 2] = p[2, 2] + g[2, 2]
        predicted = beta[0] * x[0] + beta[1] * x[1] + x[2]
        s = q[0, 0] + r
        e = y - predicted
        for i in range(3):
            k[i] = q[0, i] / s
        x[1] = x[0] + k[1] * e
        x[0] = predicted + k[0] * e
        x[2] += k[2] * e
        count += 1.0
        alpha = (e * e - s) / count
        for i in range(3):
            for j in range(i, 3):
                p[i, j] = q[i, j] - k[i] * q[0, j]
                p[j, i] = p[i, j]
                g[i, j] += alpha * k[i] * k[j]
        w, error = 1.0, y
        for i in range(4):
            v[i] = 0.0
            for j in range(4):
                v[i] += c[i, j] * f[j]
        for i in range(4):
            w += f[i] * v[i]
            error -= beta[i] * f[i]
        residual = y
        for i in range(4):
            beta[i] += v[i] * error / w
            residual -= beta[i] * f[i]
            for j in range(4):
                c[i, j] -= v[i] * v[j] / w
        f[1], f[0], f[2] = f[0], y, residual
        out[n] = x[0]
    return out
