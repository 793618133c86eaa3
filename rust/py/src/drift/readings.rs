//! Drift, its deviation and rest at every sample, in one pass.

use std::any::Any;

use zerorate_core::{AutoFilter, Filter};

use super::any::AnyDrift;
use crate::stream::Labelled;

/// Samples of a channel that are worked on before the next channel's.
const ROWS: usize = 512;

/// What is filled beside the drift, a slice a channel.
pub struct Beside<'a> {
    pub bias_sigma: Vec<&'a mut [f64]>,
    pub at_rest: Vec<&'a mut [bool]>,
}

/// Filters a slice a channel into another, all of one length.
pub fn replay(
    filter: &mut dyn AnyDrift,
    z: &[&[f64]],
    out: &mut [&mut [f64]],
    mut beside: Option<Beside<'_>>,
) {
    let n = z.first().map_or(0, |z| z.len());
    let mut rows = vec![0.0; ROWS.min(n) * z.len()];
    for first in (0..n).step_by(ROWS) {
        let end = n.min(first + ROWS);
        let rows = &mut rows[..(end - first) * z.len()];
        let tile: Vec<&[f64]> = z.iter().map(|z| &z[first..end]).collect();
        match &mut beside {
            Some(beside) => told(filter, &tile, rows, first, out, beside),
            None => {
                interleave(&tile, rows);
                filter.process(rows, 1);
                spread(rows, first, out);
            }
        }
    }
}

fn told(
    filter: &mut dyn AnyDrift,
    tile: &[&[f64]],
    rows: &mut [f64],
    first: usize,
    out: &mut [&mut [f64]],
    beside: &mut Beside<'_>,
) {
    let any: &mut dyn Any = filter;
    if let Some(auto) = any.downcast_mut::<Labelled<AutoFilter<f64>>>() {
        return told_at_once(auto, tile, first, out, beside);
    }
    interleave(tile, rows);
    let record = filter.trace(rows);
    spread(&record.bias, first, out);
    spread(&record.bias_sigma, first, &mut beside.bias_sigma);
    spread(&record.at_rest, first, &mut beside.at_rest);
}

/// Without a record of all the rest, which takes longer than the filter.
fn told_at_once(
    auto: &mut Labelled<AutoFilter<f64>>,
    tile: &[&[f64]],
    first: usize,
    out: &mut [&mut [f64]],
    beside: &mut Beside<'_>,
) {
    for (c, filter) in auto.bank.filters_mut().iter_mut().enumerate() {
        for (i, z) in (first..).zip(tile[c]) {
            filter.update(*z);
            let now = filter.snapshot();
            out[c][i] = now.bias;
            beside.bias_sigma[c][i] = now.bias_sigma;
            beside.at_rest[c][i] = now.at_rest;
        }
    }
}

fn interleave(columns: &[&[f64]], rows: &mut [f64]) {
    for (c, column) in columns.iter().enumerate() {
        for (row, x) in rows.chunks_exact_mut(columns.len()).zip(*column) {
            row[c] = *x;
        }
    }
}

fn spread<T: Copy>(rows: &[T], first: usize, columns: &mut [&mut [T]]) {
    let channels = columns.len();
    for (c, column) in columns.iter_mut().enumerate() {
        for (x, row) in column[first..].iter_mut().zip(rows.chunks_exact(channels)) {
            *x = row[c];
        }
    }
}
