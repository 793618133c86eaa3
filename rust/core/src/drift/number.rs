//! Number types of drift filters.

use crate::stream::Number;
#[cfg(feature = "std")]
use crate::{
    drift::{AutoFilter, DriftFilter, auto, filter::side_by_side},
    stream::Block,
};

/// A number type of drift filters: one number, or several that share a register.
pub trait DriftNumber: Number {
    /// Number of filters in one number.
    #[cfg(feature = "std")]
    fn lane_count() -> usize {
        1
    }

    /// Processes a block by published filters, one per channel.
    #[cfg(feature = "std")]
    fn process_block<const N: usize, const M: usize>(
        filters: &mut [DriftFilter<Self, N, M>],
        block: &mut Block<'_>,
    ) {
        for (channel, filter) in filters.iter_mut().enumerate() {
            block.run(channel, filter);
        }
    }

    /// Processes a block by filters that tune themselves.
    #[cfg(feature = "std")]
    fn process_block_of_auto(filters: &mut [AutoFilter<Self>], block: &mut Block<'_>) {
        for (channel, filter) in filters.iter_mut().enumerate() {
            block.run(channel, filter);
        }
    }
}

impl DriftNumber for f32 {}

impl DriftNumber for f64 {
    #[cfg(feature = "std")]
    fn lane_count() -> usize {
        pulp::Arch::new().dispatch(side_by_side::Width)
    }

    #[cfg(feature = "std")]
    fn process_block<const N: usize, const M: usize>(
        filters: &mut [DriftFilter<f64, N, M>],
        block: &mut Block<'_>,
    ) {
        dispatch(filters.len(), side_by_side::Together { filters, block });
    }

    #[cfg(feature = "std")]
    fn process_block_of_auto(filters: &mut [AutoFilter<f64>], block: &mut Block<'_>) {
        dispatch(filters.len(), auto::side_by_side::Together { filters, block });
    }
}

/// Selects the widest registers that this number of filters fills at least half. Wider registers
/// are slower: a row of two filters would take longer than one filter after the other.
#[cfg(feature = "std")]
fn dispatch<W: pulp::WithSimd>(filters: usize, work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if filters <= 4
        && let Some(simd) = pulp::x86::V3::try_new()
    {
        return pulp::Simd::vectorize(simd, work);
    }
    pulp::Arch::new().dispatch(work)
}
