"""A slow, literal NumPy twin of the core: the printed formulas, sample by sample."""

from oracle.allan_noise import AllanNoise
from oracle.array import GyroArray
from oracle.attitude import Attitude
from oracle.auto import AutoFilter
from oracle.drift import DriftFilter
from oracle.gated import GatedFilter
from oracle.hard_iron import LearningAttitude
from oracle.least_squares import LeastSquares, RecursiveLeastSquares
from oracle.motion import MotionDetector
from oracle.rest import RestDetector
from oracle.robust import RobustFilter
from oracle.startup import Startup
from oracle.streaming_allan import StreamingAllan
from oracle.wavelet import WaveletDenoiser

__all__ = [
    "AllanNoise",
    "Attitude",
    "AutoFilter",
    "DriftFilter",
    "GatedFilter",
    "GyroArray",
    "LearningAttitude",
    "LeastSquares",
    "MotionDetector",
    "RecursiveLeastSquares",
    "RestDetector",
    "RobustFilter",
    "Startup",
    "StreamingAllan",
    "WaveletDenoiser",
]
