"""Denoising of records: small details are removed."""

from zerorate.denoising.wavelet import Denoised, denoise

__all__ = ["Denoised", "denoise"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
