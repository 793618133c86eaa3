"""Records whose deviations are printed in the literature, and what is printed of them."""

import numpy as np

# W. J. Riley, NIST SP 1065, section 12.4: nine rates, one a second.
NBS14 = np.array([892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0])
NBS14_PHASE = [0.0, 103.11111, 123.22222, 157.33333, 166.44444, 48.55555, -96.33333, -2.22222]
NBS14_PHASE += [111.88889, 0.0]


def thousand():
    """Return the 1000-point set of SP 1065: a congruential generator's numbers over its modulus."""
    modulus, n = 2147483647, [1234567890]
    while len(n) < 1000:
        n.append(16807 * n[-1] % modulus)
    return np.array(n) / modulus


# By kind: deviations at 1 and 2 s of NBS14 and at 1, 10 and 100 s of the 1000 points.
TABLES = {
    "adev": ([91.22945, 115.8082], [2.922319e-01, 9.965736e-02, 3.897804e-02]),
    "oadev": ([91.22945, 85.95287], [2.922319e-01, 9.159953e-02, 3.241343e-02]),
    "mdev": ([91.22945, 74.78849], [2.922319e-01, 6.172376e-02, 2.170921e-02]),
    "tdev": ([52.67135, 86.35831], [1.687202e-01, 3.563623e-01, 1.253382e00]),
    "hdev": ([70.80607, 116.7980], [2.943883e-01, 1.052754e-01, 3.910860e-02]),
    "ohdev": ([70.80607, 85.61487], [2.943883e-01, 9.581083e-02, 3.237638e-02]),
    "totdev": ([91.22945, 93.90379], [2.922319e-01, 9.134743e-02, 3.406530e-02]),
    "htotdev": ([70.80607, 91.16396], [2.943883e-01, 9.614787e-02, 3.058103e-02]),
    "mtotdev": ([75.50203, 75.83606], [2.418528e-01, 6.499161e-02, 2.287774e-02]),
    "ttotdev": ([43.59112, 87.56794], [1.396338e-01, 3.752293e-01, 1.320847e00]),
}

# Without the correction for bias that the tables have (Stable32 1.60).
UNCORRECTED = {
    "mtotdev": ([64.509, 64.794], [2.0664e-01, 5.5529e-02, 1.9547e-02]),
    "ttotdev": ([37.244, 74.818], [1.1930e-01, 3.2060e-01, 1.1285e00]),
}
