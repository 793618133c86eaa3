//! Wavelet denoising for Python: of records and of streams.

use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::Bank;
use zerorate_core::denoise::{
    self as core, Denoised, LevelRule, Mode, Shrinkage, Wavelet, WaveletParams, decompose,
};

use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, positive, reading, streaming, text};
use crate::common::work::interruptible;

/// Largest detail as a share of the sum of details, at most: limit of rule "psr".
const PEAK_TO_SUM: f64 = 0.05;

/// The same share relative to the share that pure noise has: limit of rule "psr-normalised".
const PEAK_TO_SUM_OVER_NOISE: f64 = 1.5;

type Vector<'py, T> = Bound<'py, PyArray1<T>>;
type Columns<'py> = (Bound<'py, PyAny>, Vector<'py, i64>, Vector<'py, f64>, Vector<'py, f64>);

/// Denoise records: remove details that are no larger than noise.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,) or (n, k)
///     Samples; missing samples are refused.
/// wavelet : str
///     Name of the wavelet: "haar", "db2", "db4" or "db8".
/// level : int or str
///     Last level, or the rule that finds it: "psr", "psr-normalised" or "auto".
/// rho : float or None
///     Limit of the rules "psr" and "psr-normalised"; None is the rule's default.
/// mode : str
///     Treatment of details above the threshold: "soft" or "hard".
/// approximation : bool
///     True if the approximation below the last level is also thresholded.
///
/// Returns
/// -------
/// tuple
///     First the denoised signal, with the shape of ``z``. Then level, sigma and threshold of each
///     record, each of shape (k,).
///
/// Raises
/// ------
/// ValueError
///     An argument is out of range, or a sample is missing.
#[pyfunction]
pub fn denoise<'py>(
    z: &Bound<'py, PyAny>,
    wavelet: &str,
    level: &Bound<'py, PyAny>,
    rho: Option<f64>,
    mode: &str,
    approximation: bool,
) -> PyResult<Columns<'py>> {
    let py = z.py();
    let (wavelet, mode) = (known_wavelet(wavelet)?, known_mode(mode)?);
    let level = rule(level, rho)?;
    let records = Records::of(z)?;
    let columns = records.whole()?;
    let (n, k) = (columns[0].len(), columns.len());
    check_depth(wavelet, n, if let LevelRule::Fixed(last) = level { last } else { 1 })?;
    let how = Shrinkage { wavelet, level, mode, approximation };
    // NumPy allocates huge pages. With small pages the allocation would take longer than the work.
    let signals = arrays::zeros::<f64>(py, &[k, n])?;
    let room = arrays::zeros::<f64>(py, &[how.room(n)])?;
    let found = {
        let (mut signals, mut room) = (signals.try_readwrite()?, room.try_readwrite()?);
        let (signals, room) = (signals.as_slice_mut()?, room.as_slice_mut()?);
        interruptible(py, n.saturating_mul(k), || -> Vec<Denoised> {
            let pairs = columns.iter().zip(signals.chunks_exact_mut(n));
            pairs.map(|(z, signal)| how.denoise(z, signal, room)).collect()
        })?
    };
    let each = |number: fn(&Denoised) -> f64| -> Vec<f64> { found.iter().map(number).collect() };
    let (sigma, threshold) = (each(|one| one.sigma), each(|one| one.threshold));
    let levels: Vec<i64> = found.iter().map(|one| one.level as i64).collect();
    let signal = match records {
        Records::Copied(arrays::Columns { axes: Some(_), .. }) => {
            let rows = signals.call_method0("transpose")?;
            py.import("numpy")?.call_method1("ascontiguousarray", (rows,))?
        }
        _ => signals.reshape([n])?.into_any(),
    };
    Ok((signal, levels.into_pyarray(py), sigma.into_pyarray(py), threshold.into_pyarray(py)))
}

/// Decompose a record into an approximation and details, from the last level to the first.
///
/// The approximation is the signal below ``level`` octaves.
///
/// Raises
/// ------
/// ValueError
///     An argument is out of range, or a sample is missing.
#[pyfunction]
pub fn wavelet_decomposition<'py>(
    z: &Bound<'py, PyAny>,
    wavelet: &str,
    level: i128,
) -> PyResult<Vec<Vector<'py, f64>>> {
    let (py, wavelet) = (z.py(), known_wavelet(wavelet)?);
    let levels = positive("level", level)?;
    let records = Records::of(z)?;
    let [record] = records.whole()?[..] else {
        return Err(PyValueError::new_err("z must have shape (n,)"));
    };
    check_depth(wavelet, record.len(), levels)?;
    let parts = interruptible(py, record.len(), || decompose(record, wavelet, levels))?;
    Ok(parts.into_iter().map(|part| part.into_pyarray(py)).collect())
}

fn known_wavelet(name: &str) -> PyResult<Wavelet> {
    Wavelet::of_name(name).ok_or_else(|| {
        let names = Wavelet::NAMES.map(|(_, name)| format!("'{name}'")).join(", ");
        PyValueError::new_err(format!("wavelet must be one of {names}, got '{name}'"))
    })
}

fn known_mode(name: &str) -> PyResult<Mode> {
    Mode::of_name(name).ok_or_else(|| {
        PyValueError::new_err(format!("mode must be 'soft' or 'hard', got '{name}'"))
    })
}

fn rule(level: &Bound<'_, PyAny>, rho: Option<f64>) -> PyResult<LevelRule> {
    let cut = |usual: f64| match rho.unwrap_or(usual) {
        cut if cut > 0.0 && cut.is_finite() => Ok(cut),
        cut => Err(PyValueError::new_err(format!("rho must be a positive number, got {cut}"))),
    };
    let found = match level.extract::<String>().as_deref() {
        Ok("psr") => return Ok(LevelRule::PeakToSum(cut(PEAK_TO_SUM)?)),
        Ok("psr-normalised") => {
            return Ok(LevelRule::PeakToSumOverNoise(cut(PEAK_TO_SUM_OVER_NOISE)?));
        }
        Ok("auto") => LevelRule::Noise,
        Ok(other) => {
            return Err(PyValueError::new_err(format!(
                "level must be 'auto', 'psr', 'psr-normalised' or a number, got '{other}'"
            )));
        }
        Err(_) => LevelRule::Fixed(positive("level", whole(level)?)?),
    };
    match rho {
        None => Ok(found),
        Some(_) => Err(PyValueError::new_err(
            "rho is the cut of level='psr' and level='psr-normalised' alone",
        )),
    }
}

fn whole(level: &Bound<'_, PyAny>) -> PyResult<i128> {
    level.extract().map_err(|_| {
        PyTypeError::new_err(format!("level must be a whole number or a rule's name, got {level}"))
    })
}

fn check_depth(wavelet: Wavelet, n: usize, level: usize) -> PyResult<()> {
    let (deepest, name) = (wavelet.deepest(n), wavelet.name());
    if deepest == 0 {
        let least = 2 * (wavelet.taps() - 1);
        return Err(PyValueError::new_err(format!(
            "z is too short for '{name}': a level needs {least} samples, got {n}"
        )));
    }
    if level > deepest {
        return Err(PyValueError::new_err(format!(
            "level must be at most {deepest} for {n} samples and '{name}', got {level}"
        )));
    }
    Ok(())
}

/// Parallel records; an array with one axis is read in place.
enum Records<'py> {
    InPlace(PyReadonlyArray1<'py, f64>),
    Copied(arrays::Columns),
}

impl<'py> Records<'py> {
    fn of(z: &Bound<'py, PyAny>) -> PyResult<Self> {
        let axes = z.getattr("ndim").and_then(|axes| axes.extract::<usize>());
        match axes {
            Ok(1) => Ok(Self::InPlace(arrays::axis(z)?)),
            _ => Ok(Self::Copied(arrays::columns(z)?)),
        }
    }

    /// All records, if no record has a gap.
    fn whole(&self) -> PyResult<Vec<&[f64]>> {
        let (records, axes) = match self {
            Self::InPlace(array) => (vec![array.as_slice()?], None),
            Self::Copied(columns) => {
                (columns.values.iter().map(Vec::as_slice).collect(), columns.axes)
            }
        };
        if records.is_empty() {
            return Err(PyValueError::new_err("z must have shape (n,) or (n, k), got no column"));
        }
        for (k, record) in records.iter().enumerate() {
            if let Some(row) = missing(record) {
                let place = axes.map_or(String::new(), |_| format!(" of column {k}"));
                return Err(PyValueError::new_err(format!(
                    "z misses sample {row}{place}: denoise needs a record without gaps, \
                     DriftFilter and WaveletDenoiser do not"
                )));
            }
        }
        Ok(records)
    }
}

/// Index of the first sample that is not finite.
fn missing(record: &[f64]) -> Option<usize> {
    // Piece by piece, without a branch per sample.
    let whole = |piece: &[f64]| piece.iter().fold(true, |all, z| all & z.is_finite());
    if record.chunks(1 << 10).all(whole) {
        return None;
    }
    record.iter().position(|z| !z.is_finite())
}

/// Live wavelet denoising with a known delay.
///
/// A decimated bank of Daubechies' filters splits the signal into octaves. Details smaller than
/// ``threshold`` standard deviations of the noise are removed (VisuShrink), and the signal is
/// reconstructed. ``update`` returns the denoised value of the sample ``delay`` samples ago;
/// ``delay`` is ``(2**level - 1) * (taps - 1) + 1``. With ``threshold=0`` it returns this sample
/// unchanged, to rounding. **A linear-phase low-pass of the same delay is nearly always better**:
/// docs/explanation/wavelets.md.
///
/// The standard deviation of the noise is learned from the finest octave: the denoiser counts the
/// details within this standard deviation. An outlier therefore changes it no more than any other
/// sample does. Nothing is removed before the first sixteen details. Motion in the finest octave
/// counts as noise after some time. With a longer wavelet, less of the motion is in this octave.
///
/// A sample that is not finite (or ``update(None)``) is missing. The last sample replaces it.
/// Details from missing samples do not change the noise. The output is NaN before the first sample.
/// One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second. The rate determines ``delay_seconds``, and the time constant of the
///     learned noise, about 10 s.
/// wavelet : {"haar", "db2", "db4", "db8"}, default "db2"
///     Name of the wavelet, with 2, 4, 8 or 16 taps. A short wavelet has less delay. A long wavelet
///     distinguishes motion from noise better.
/// level : int, default 3
///     Number of denoised octaves, from 1 to 10. Each octave halves the variance of white noise and
///     doubles the delay.
/// mode : {"hard", "soft"}, default "hard"
///     Treatment of details above the threshold: "hard" keeps them, "soft" shrinks them by the
///     threshold. With "soft" the output is smoother at rest, but motion is distorted.
/// threshold : float, default 4.0
///     Threshold in standard deviations of the noise; 4 is VisuShrink's value for 3000 samples. 0
///     removes nothing.
/// channels : int, optional
///     Number of signals; ``None`` is a single signal without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> denoiser = zr.WaveletDenoiser(rate=200.0, level=3)
/// >>> denoiser.delay, denoiser.delay_seconds
/// (22, 0.11)
/// >>> z = 5.0 + np.random.default_rng(1).standard_normal(20_000)
/// >>> x = denoiser.process(z)
/// >>> round(float(x[10_000:].std()), 2)  # 1 / sqrt(2**3) = 0.35
/// 0.34
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct WaveletDenoiser {
    shared: Shared<Bank<core::WaveletDenoiser>>,
}

streaming!(
    WaveletDenoiser,
    update: "Process one sample and return the denoised value of ``delay`` samples ago.

    Sample and value are floats, or arrays (k,) with k channels.",
    process: "Return the value of ``update`` for each sample of a batch.

    Samples and values are (n,), or (n, k) with k channels. The interpreter lock is released.",
    out
);
streaming!(@bank WaveletDenoiser, core::WaveletDenoiser);

#[pymethods]
impl WaveletDenoiser {
    #[new]
    #[pyo3(signature = (
        rate, wavelet="db2", level=3, mode="hard", threshold=4.0, *, channels=None
    ))]
    fn new(
        rate: f64,
        wavelet: &str,
        level: i128,
        mode: &str,
        threshold: f64,
        channels: Option<i128>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let (wavelet, mode) = (known_wavelet(wavelet)?, known_mode(mode)?);
        let level = positive("level", level)?;
        let params = WaveletParams { rate, wavelet, level, mode, threshold };
        let denoiser = core::WaveletDenoiser::new(params).map_err(NativeError::from)?;
        let bank = Bank::new(&denoiser, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let WaveletParams { rate, wavelet, level, mode, threshold } = *this.first().params();
        let arguments = [
            ("rate", text(rate), ""),
            ("wavelet", format!("'{}'", wavelet.name()), "'db2'"),
            ("level", level.to_string(), "3"),
            ("mode", format!("'{}'", mode.name()), "'hard'"),
            ("threshold", text(threshold), "4.0"),
        ];
        Ok(call("WaveletDenoiser", &arguments, this.shared.channels))
    }
}

getters! { WaveletDenoiser, slf, py, this;
    /// Delay of the output, samples.
    delay: u64 = this.first().delay();
    /// Delay of the output, s.
    delay_seconds: f64 = this.first().delay() as f64 / this.first().params().rate;
    /// Standard deviation of the noise to date.
    ///
    /// Its unit is the samples' unit. It is zero before it is known. A float, or an array (k,) with
    /// k channels.
    sigma: Object<'py> = this.shared.each(py, |one| one.sigma())?;
    /// Number of missing samples to date.
    ///
    /// An int, or an array (k,) with k channels.
    missing_count: Object<'py> = this.shared.each(py, |one| one.missing() as i64)?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Samples per second.
    rate: f64 = this.first().params().rate;
    /// Name of the wavelet.
    wavelet: &'static str = this.first().params().wavelet.name();
    /// Number of denoised octaves.
    level: usize = this.first().params().level;
    /// Treatment of coefficients above the threshold: "hard" or "soft".
    mode: &'static str = this.first().params().mode.name();
    /// Threshold in standard deviations of the noise.
    threshold: f64 = this.first().params().threshold;
}
