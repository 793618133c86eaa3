"""Peers for the timing of the filter: the same chain in C and numba, and filterpy's Kalman filter.

Each function returns a callable that takes an array of samples. If the peer cannot be built here,
the function prints the reason and returns ``None``.
"""

import ctypes
import importlib.util
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

import numpy as np

SOURCE = Path(__file__).with_name("reference.c")
DEVIATIONS = SOURCE.with_name("allan.c")
AUTOREGRESSION = SOURCE.with_name("autoregression.c")
ARMA = SOURCE.with_name("arma.c")
FILTERPY_2 = Path(__file__).parents[1] / "target" / "filterpy2"
BUILT = Path(tempfile.mkdtemp(prefix="zerorate-benches-"))


def compile_library(name, *flags, source=SOURCE):
    """Return the path of a library that is compiled from ``source``."""
    library = BUILT / name
    built = [str(source), "-o", str(library), "-lm"]
    subprocess.run(["cc", *flags, "-shared", "-fPIC", *built], check=True)
    return library


def c_deviations():
    """Return a function from a name to its deviation in C, which takes samples and factors."""
    flags = ["-O3", "-march=native", "-ffast-math"]
    library = ctypes.CDLL(str(compile_library("allan.so", *flags, source=DEVIATIONS)))
    floats = np.ctypeslib.ndpointer(np.float64, flags="C")
    sizes = np.ctypeslib.ndpointer(np.uintp, flags="C")

    def named(name):
        function = getattr(library, name)
        function.argtypes = [floats, ctypes.c_size_t, sizes, ctypes.c_size_t, floats]
        function.restype = None

        def run(z, factors):
            out = np.empty(len(factors))
            function(z, z.size, np.array(factors, np.uintp), len(factors), out)
            return out

        return run

    return named


def c_order(name, order=10):
    """Return the function ``name`` in C: a table of autoregressions with a row per order."""
    flags = ["-O3", "-march=native", "-ffast-math"]
    library = ctypes.CDLL(str(compile_library("order.so", *flags, source=AUTOREGRESSION)))
    function = getattr(library, name)
    floats = np.ctypeslib.ndpointer(np.float64, flags="C")
    function.argtypes = [floats, ctypes.c_size_t, ctypes.c_int, floats]
    function.restype = None

    def run(z):
        out = np.empty((order + 1, 4))
        function(z, z.size, order, out)
        return out

    return run


def c_arma_grid():
    """Return a function from samples to ARMA variances up to (3, 3), and to the passes."""
    flags = ["-O3", "-march=native", "-ffast-math"]
    function = ctypes.CDLL(str(compile_library("arma.so", *flags, source=ARMA))).arma_grid
    floats = np.ctypeslib.ndpointer(np.float64, flags="C")
    function.argtypes = [floats, ctypes.c_size_t, floats, floats]
    function.restype = ctypes.c_int

    def run(z):
        sigma2 = np.empty((4, 4))
        passes = function(z, z.size, np.empty_like(z), sigma2)
        return sigma2, passes

    return run


def c_batch(*flags):
    """Return the chain in C for (n,), or for (n, k) with ``-DLANES=k``, compiled with ``flags``."""
    name = "batch" + "".join(flags).replace("=", "-") + ".so"
    library = ctypes.CDLL(str(compile_library(name, *flags)))
    pointer = np.ctypeslib.ndpointer(np.float64, flags="C")
    library.chain_size.restype = ctypes.c_size_t
    library.chain_init.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * 3]
    library.chain_process.argtypes = [ctypes.c_void_p, pointer, pointer, ctypes.c_size_t]

    def run(z):
        state = ctypes.create_string_buffer(library.chain_size())
        library.chain_init(state, 0.97, 0.1, 100.0)
        out = np.empty_like(z)
        library.chain_process(state, z, out, len(z))
        return out

    return run


def c_extension():
    """Return ``update(float) -> float`` of the chain, as a C extension."""
    include = sysconfig.get_path("include")
    flags = ["-O3", "-march=native", "-DPYTHON_MODULE", f"-I{include}"]
    path = compile_library("reference" + sysconfig.get_config_var("EXT_SUFFIX"), *flags)
    spec = importlib.util.spec_from_file_location("reference", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.update


def numba_batch():
    """Return the chain that numba compiles from plain loops over small arrays, without checks."""
    import numba

    from numba_chain import process

    return numba.njit(process)


def filterpy_filter(version):
    """Return the class KalmanFilter of filterpy 1 or 2; version 2 has its own folder."""
    if version == 1:
        return importlib.import_module("filterpy.kalman").KalmanFilter
    if not FILTERPY_2.is_dir():
        raise ImportError("filterpy 2 is not in target/filterpy2: make bench installs it")
    others = {name: sys.modules.pop(name) for name in [*sys.modules] if _is_filterpy(name)}
    sys.path.insert(0, str(FILTERPY_2))
    try:
        return importlib.import_module("filterpy.kalman").KalmanFilter
    finally:
        sys.path.remove(str(FILTERPY_2))
        for name in filter(_is_filterpy, [*sys.modules]):
            del sys.modules[name]
        sys.modules.update(others)


def _is_filterpy(module):
    return module.partition(".")[0] == "filterpy"


def filterpy_batch(version):
    """Return the Kalman filter of filterpy 1 or 2, with a fixed model, sample by sample."""
    KalmanFilter = filterpy_filter(version)

    def run(z):
        kalman = KalmanFilter(dim_x=3, dim_z=1)
        kalman.F = np.array([[0.5, 0.1, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        kalman.H = np.array([[1.0, 0.0, 0.0]])
        kalman.Q *= 0.1
        out = np.empty_like(z)
        for k, value in enumerate(z):
            kalman.predict()
            kalman.update(value)
            out[k] = kalman.x[0, 0]
        return out

    return run
