//! What the benches share.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// White noise of deviation one, the same each time.
pub fn noise(n: usize) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(1);
    (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
}
