//! Products and transposes of matrices stored row after row.

use core::ops::{Add, Mul};

use wide::f64x2;

use crate::math::Fours;

/// c = a b, of sizes rows × inner and inner × columns; with `upper` at least the upper triangle of
/// a square.
#[inline(always)]
pub(in crate::linear) fn product<F: Fours>(
    fours: F,
    upper: bool,
    [rows, inner, columns]: [usize; 3],
    a: &[f64],
    b: &[f64],
    c: &mut [f64],
) {
    let (a, b, c) = (&a[..rows * inner], &b[..inner * columns], &mut c[..rows * columns]);
    for i in 0..rows {
        let row = &a[i * inner..][..inner];
        let out = &mut c[i * columns..][..columns];
        let mut j = if upper { i - i % 4 } else { 0 };
        while j + 4 <= columns {
            four(fours, row, b, columns, j, out);
            j += 4;
        }
        // In smaller matrices, a pair would be read too soon after one of its numbers was written.
        if j + 2 <= columns && columns > 3 {
            tile(row, b, columns, j, out, f64x2::from, f64x2::to_array);
            j += 2;
        }
        while j < columns {
            tile(row, b, columns, j, out, |[b]: [f64; 1]| b, |b| [b]);
            j += 1;
        }
    }
}

/// Four elements of a row of a product, summed in registers.
#[inline(always)]
fn four<F: Fours>(fours: F, row: &[f64], b: &[f64], columns: usize, j: usize, out: &mut [f64]) {
    let mut sum = fours.splat(0.0);
    for (h, factor) in row.iter().enumerate() {
        let Some(b) = b.get(h * columns + j..).and_then(|b| b.first_chunk()) else { return };
        sum = fours.add_product(sum, fours.splat(*factor), fours.of(*b));
    }
    if let Some(out) = out.get_mut(j..).and_then(|out| out.first_chunk_mut()) {
        *out = fours.numbers(sum);
    }
}

/// Two elements, or one.
#[inline(always)]
fn tile<T, const W: usize>(
    row: &[f64],
    b: &[f64],
    columns: usize,
    j: usize,
    out: &mut [f64],
    of: impl Fn([f64; W]) -> T,
    array: impl Fn(T) -> [f64; W],
) where
    T: Copy + Add<Output = T> + Mul<Output = T>,
{
    let mut sum = of([0.0; W]);
    for (h, factor) in row.iter().enumerate() {
        let Some(b) = b.get(h * columns + j..).and_then(|b| b.first_chunk()) else { return };
        sum = sum + of([*factor; W]) * of(*b);
    }
    if let Some(out) = out.get_mut(j..).and_then(|out| out.first_chunk_mut()) {
        *out = array(sum);
    }
}

/// b = aᵀ, of size rows × columns.
#[inline(always)]
pub(in crate::linear) fn transpose(rows: usize, columns: usize, a: &[f64], b: &mut [f64]) {
    let (a, b) = (&a[..rows * columns], &mut b[..rows * columns]);
    for i in 0..rows {
        for j in 0..columns {
            b[j * rows + i] = a[i * columns + j];
        }
    }
}
