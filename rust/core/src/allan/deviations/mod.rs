//! Deviations of a whole record: the Allan and Hadamard families with their relatives.

mod curves;
mod differences;
mod kind;
mod lanes;
mod modified;
mod modified_total;
mod noise_type;
mod parabolic;
mod record;
mod stretches;
mod theo1;
mod total;

pub use self::curves::{Curve, Estimate, curves};
pub use self::kind::Kind;
pub use self::record::Record;
