//! Partition into spans of least cost, each with one hard iron or an *outlier*, by dynamic
//! programming.

use pulp::{Arch, Simd, WithSimd};

use super::span::{Cost, MAX_EXTRA_COST, MAX_OUTLIER_S, OUTLIER_COST, SPAN_COST, Seen, Span};
use super::together::{gather, scatter};
use crate::math::{Lane, Real, parallel};
use crate::work::pause;

/// Number of ticks in a second; a span begins and ends with a second.
const TICKS_PER_SECOND: usize = 10;
/// Duration of a tick, s.
const TICK: f64 = 0.1;

/// Ticks: index since the first sample, e, and the rows of B.
#[derive(Debug, Clone, Copy)]
pub struct Turned<'a> {
    /// Index of each tick, increasing.
    pub number: &'a [usize],
    /// Mean rotated field e.
    pub turned: &'a [[f64; 3]],
    /// Rows of B.
    pub rotation: &'a [[f64; 9]],
}

/// Seconds with one hard iron, or an outlier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// First second.
    pub start: usize,
    /// End (exclusive), s.
    pub stop: usize,
    /// True for an outlier, whose field is not used.
    pub outlier: bool,
}

/// Partition of a record, and its cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Partition {
    /// Cost of all ticks.
    pub cost: f64,
    /// Pieces in order.
    pub pieces: Vec<Piece>,
}

/// Partition of least cost for each random walk of the field, in standard deviations of the noise
/// per √s.
pub fn partition(ticks: &Turned<'_>, noise: f64, walks: &[f64]) -> Vec<Partition> {
    parallel::map(walks.to_vec(), true, |walk| {
        Search::new(ticks, noise, walk * walk * noise * TICK).run()
    })
}

/// An open span: its first second, its cost, and its filter.
#[derive(Debug, Clone, Copy)]
struct Going {
    start: usize,
    cost: f64,
    span: Span<f64>,
}

impl AsRef<Span<f64>> for Going {
    #[inline(always)]
    fn as_ref(&self) -> &Span<f64> {
        &self.span
    }
}

impl AsMut<Span<f64>> for Going {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut Span<f64> {
        &mut self.span
    }
}

struct Search<'a> {
    ticks: &'a Turned<'a>,
    noise: f64,
    walk: f64,
    /// Least cost of everything before each second, and the last piece in it.
    best: Vec<f64>,
    came: Vec<Piece>,
    /// Cost of each second as an outlier.
    outlier: Vec<f64>,
    going: Vec<Going>,
}

impl<'a> Search<'a> {
    fn new(ticks: &'a Turned<'a>, noise: f64, walk: f64) -> Self {
        let (best, came, outlier, going) = (vec![0.0], Vec::new(), Vec::new(), Vec::new());
        Self { ticks, noise, walk, best, came, outlier, going }
    }

    fn run(mut self) -> Partition {
        let Some(last) = self.ticks.number.last() else {
            return Partition { cost: 0.0, pieces: Vec::new() };
        };
        let seconds = last / TICKS_PER_SECOND + 1;
        let mut first = 0;
        for second in 0..seconds {
            pause();
            let rest = &self.ticks.number[first..];
            let inside =
                first..first + rest.partition_point(|k| *k < (second + 1) * TICKS_PER_SECOND);
            first = inside.end;
            self.take(second, inside);
        }
        Partition { cost: self.best[seconds], pieces: self.path(seconds) }
    }

    fn take(&mut self, second: usize, inside: core::ops::Range<usize>) {
        self.outlier.push(OUTLIER_COST * inside.len() as f64);
        if !inside.is_empty() {
            let span = Span::new(median(&self.ticks.turned[inside.clone()]));
            self.going.push(Going { start: second, cost: 0.0, span });
            self.step(inside);
        }
        let (mut least, mut piece) = self.cheapest_outlier(second);
        for one in &self.going {
            let cost = self.best[one.start] + one.cost;
            if cost < least {
                (least, piece) = (cost, Piece { start: one.start, outlier: false, ..piece });
            }
        }
        let found = least + SPAN_COST;
        self.came.push(piece);
        let best = &self.best;
        self.going.retain(|one| best[one.start] + one.cost <= found + MAX_EXTRA_COST);
        self.best.push(found);
    }

    /// Returns the outlier of least cost that ends with a second.
    fn cheapest_outlier(&self, second: usize) -> (f64, Piece) {
        let (mut least, mut start, mut sum) = (f64::INFINITY, second, 0.0);
        for i in ((second + 1).saturating_sub(MAX_OUTLIER_S)..=second).rev() {
            sum += self.outlier[i];
            if self.best[i] + sum <= least {
                (least, start) = (self.best[i] + sum, i);
            }
        }
        (least, Piece { start, stop: second + 1, outlier: true })
    }

    fn step(&mut self, inside: core::ops::Range<usize>) {
        let ticks = self.ticks;
        let since = |k: usize| if k == 0 { 1 } else { ticks.number[k] - ticks.number[k - 1] };
        let walked: Vec<f64> = inside.clone().map(|k| self.walk * since(k) as f64).collect();
        let (turned, rotation) = (&ticks.turned[inside.clone()], &ticks.rotation[inside]);
        let step = Step { going: &mut self.going, turned, rotation, walked, noise: self.noise };
        Arch::new().dispatch(step);
    }

    fn path(&self, seconds: usize) -> Vec<Piece> {
        let (mut pieces, mut stop) = (Vec::new(), seconds);
        while stop > 0 {
            let piece = self.came[stop - 1];
            pieces.push(piece);
            stop = piece.start;
        }
        pieces.reverse();
        pieces
    }
}

/// The ticks of a second for all open spans.
struct Step<'a> {
    going: &'a mut [Going],
    turned: &'a [[f64; 3]],
    rotation: &'a [[f64; 9]],
    walked: Vec<f64>,
    noise: f64,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for some in self.going.chunks_mut(S::F64_LANES) {
            let mut span = gather::<S>(some);
            // The product of a second's determinants is in the usual range: one logarithm is
            // enough.
            let (mut product, mut misfit) = (Lane::<S>::of(1.0), Lane::<S>::of(0.0));
            for k in 0..self.turned.len() {
                let seen = Seen::of(&self.turned[k], &self.rotation[k], self.walked[k], self.noise);
                let Cost { determinant, misfit: more } = span.step(&seen);
                product *= determinant;
                misfit += more;
            }
            scatter(&span, some);
            let (product, misfit) = (product.store(), misfit.store());
            for (k, one) in some.iter_mut().enumerate() {
                one.cost += product[k].ln() + misfit[k];
            }
        }
    }
}

/// Median of each axis.
fn median(values: &[[f64; 3]]) -> [f64; 3] {
    core::array::from_fn(|i| {
        let mut axis: Vec<f64> = values.iter().map(|v| v[i]).collect();
        super::fit::median(&mut axis)
    })
}
