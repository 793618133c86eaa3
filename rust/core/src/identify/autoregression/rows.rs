//! The triangular factor from the rows themselves: slower than from their products, twice as
//! many digits.

use nalgebra::DMatrix;

use super::centre::Centre;
use crate::identify::stretches;

/// Rows taken in at once, as a multiple of the columns: the triangle found so far goes along.
const DEPTH: usize = 16;

/// Triangle of the rows `[1, y_(t-1), ..., y_(t-order), y_t]`, the first only if asked for.
pub fn triangle(record: &[f64], order: usize, centre: Centre, constant: bool) -> DMatrix<f64> {
    let size = order + 1 + usize::from(constant);
    let depth = DEPTH * size;
    let mut upper = DMatrix::zeros(size, size);
    for stretch in stretches(record) {
        let late = stretch.len().saturating_sub(order);
        for start in (0..late).step_by(depth) {
            let block = &stretch[start..stretch.len().min(start + depth + order)];
            upper = joined(&upper, block, order, centre, constant);
        }
    }
    upper
}

/// Triangle of that of earlier rows and those of a block.
fn joined(
    upper: &DMatrix<f64>,
    block: &[f64],
    order: usize,
    centre: Centre,
    constant: bool,
) -> DMatrix<f64> {
    let (size, first) = (upper.ncols(), usize::from(constant));
    let count = block.len() - order;
    let mut rows = DMatrix::from_element(size + count, size, 1.0);
    rows.view_mut((0, 0), (size, size)).copy_from(upper);
    for lag in 0..=order {
        let column = if lag == 0 { size - 1 } else { lag - 1 + first };
        let values = block[order - lag..].iter().map(|z| centre.taken_off(*z));
        rows.view_mut((size, column), (count, 1))
            .iter_mut()
            .zip(values)
            .for_each(|(to, y)| *to = y);
    }
    rows.qr().unpack_r()
}
