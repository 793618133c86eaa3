//! An array of three gyros of one axis, as a stream.

use serde::{Deserialize, Serialize};
use zerorate_core::array::{ArrayParams, Fusion, GyroArray, Weights};
use zerorate_core::checkpoint::Checkpoint;
use zerorate_core::{Error, RestLimits, Stream};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Three(GyroArray<1>);

impl Three {
    pub fn new(limit: Option<f64>) -> Result<Self, Error> {
        let params = ArrayParams {
            rate: 16.0,
            sensors: 3,
            labels: ["a", "b", "c"].map(String::from).to_vec(),
            rotations: None,
            corrections: None,
            limit,
            limits: RestLimits::default(),
            weights: Weights::Auto,
            scale_error: 0.01,
            fusion: Fusion::Voted,
        };
        Ok(Self(GyroArray::new(params)?))
    }
}

impl Stream for Three {
    type Input = [f64; 3];
    type Output = f64;

    /// The rate, zero where no sensor is left.
    fn update(&mut self, input: [f64; 3]) -> f64 {
        let mut rate = [0.0];
        self.0.update(&input, &mut rate);
        if rate[0].is_nan() { 0.0 } else { rate[0] }
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

impl Checkpoint for Three {
    const TAG: &'static str = "three";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        self.0.is_valid()
    }
}
