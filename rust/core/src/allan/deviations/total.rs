//! TOTDEV: second differences of the phase, reflected about both ends of the record.

use super::differences::BLOCK;
use super::record::Record;

/// Sums of the squared second differences about every point but the ends, at each factor.
pub fn sums(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut sums = vec![0.0; factors.len()];
    let (mut before, mut after) = ([0.0; BLOCK], [0.0; BLOCK]);
    for x in record.stretches() {
        let last = x.len() - 1;
        for start in (1..last).step_by(BLOCK) {
            let end = last.min(start + BLOCK);
            for (m, sum) in factors.iter().zip(&mut sums).filter(|(m, _)| **m <= last) {
                let before = points_before(x, start, end, *m, &mut before);
                let after = points_after(x, start, end, *m, &mut after);
                *sum += record.lanes().squared_differences([before, &x[start..end], after]);
            }
        }
    }
    sums
}

/// The points m before those from `start` to `end`: a slice of `x`, or reflected at its start.
fn points_before<'a>(
    x: &'a [f64],
    start: usize,
    end: usize,
    m: usize,
    block: &'a mut [f64; BLOCK],
) -> &'a [f64] {
    if m <= start {
        return &x[start - m..end - m];
    }
    let block = &mut block[..end - start];
    let (reflected, inside) = block.split_at_mut((m - start).min(end - start));
    let mirror = &x[m + 1 - start - reflected.len()..m + 1 - start];
    reflected.iter_mut().zip(mirror.iter().rev()).for_each(|(b, z)| *b = 2.0 * x[0] - z);
    inside.copy_from_slice(&x[..inside.len()]);
    block
}

/// The points m after those from `start` to `end`: a slice of `x`, or reflected at its end.
fn points_after<'a>(
    x: &'a [f64],
    start: usize,
    end: usize,
    m: usize,
    block: &'a mut [f64; BLOCK],
) -> &'a [f64] {
    let last = x.len() - 1;
    if end + m <= x.len() {
        return &x[start + m..end + m];
    }
    let block = &mut block[..end - start];
    let (inside, reflected) = block.split_at_mut(x.len().saturating_sub(start + m));
    inside.copy_from_slice(&x[x.len() - inside.len()..]);
    let first = start + m + inside.len() - last;
    let mirror = &x[last + 1 - first - reflected.len()..last + 1 - first];
    reflected.iter_mut().zip(mirror.iter().rev()).for_each(|(b, z)| *b = 2.0 * x[last] - z);
    block
}
