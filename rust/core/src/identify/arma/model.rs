//! Steps within a trust region of a quadratic model (Moré and Sorensen 1983).

use nalgebra::{DMatrix, DVector};

/// `-2 descentᵀ s + Σ curvature s²` along the axes of the curvature.
#[derive(Debug, Clone)]
pub struct Model {
    pub curvatures: DVector<f64>,
    pub axes: DMatrix<f64>,
    /// Along the axes.
    pub descent: DVector<f64>,
    /// Units of the scaled coordinates.
    pub scale: DVector<f64>,
}

/// A step and what the model says of it.
#[derive(Debug, Clone)]
pub struct Step {
    pub step: DVector<f64>,
    /// Length in scaled coordinates.
    pub length: f64,
    /// How much lower the model is there.
    pub gain: f64,
}

/// Curvatures below this part of the largest are rounding.
const FLAT: f64 = 1e-14;

impl Model {
    /// How much lower the model is at its minimum, infinite where it has none.
    pub fn depth(&self) -> f64 {
        if self.is_convex() { self.at(0.0).gain } else { f64::INFINITY }
    }

    /// The lowest point of the model within `radius`.
    pub fn step(&self, radius: f64) -> Step {
        if self.is_convex() {
            let newton = self.at(0.0);
            if newton.length <= radius {
                return newton;
            }
        }
        let lowest = self.curvatures.iter().copied().fold(0.0, |low: f64, x| low.max(-x));
        // At this damping no component can make the step longer than the radius.
        let (mut low, mut high) =
            (lowest, lowest + self.descent.norm() / radius + f64::MIN_POSITIVE);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match self.at(middle).length > radius {
                true => low = middle,
                false => high = middle,
            }
        }
        self.at(high)
    }

    fn is_convex(&self) -> bool {
        let largest = self.curvatures.iter().copied().fold(0.0, f64::max);
        self.curvatures.iter().all(|x| *x > FLAT * largest)
    }

    fn at(&self, damping: f64) -> Step {
        let along = self.descent.zip_map(&self.curvatures, |descent, curvature| {
            if descent == 0.0 { 0.0 } else { descent / (curvature + damping) }
        });
        let bent = along.component_mul(&along).dot(&self.curvatures);
        let gain = 2.0 * along.dot(&self.descent) - bent;
        let step = (&self.axes * &along).component_mul(&self.scale);
        Step { length: along.norm(), gain, step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(curvatures: [f64; 2]) -> Model {
        Model {
            curvatures: DVector::from_row_slice(&curvatures),
            axes: DMatrix::identity(2, 2),
            descent: DVector::from_row_slice(&[1.0, 1.0]),
            scale: DVector::from_row_slice(&[1.0, 2.0]),
        }
    }

    #[test]
    fn newton_where_it_fits_else_the_edge() {
        let newton = model([1.0, 0.5]).step(10.0);
        // Powers of two: exact.
        assert_eq!(newton.step.as_slice(), [1.0, 4.0]);
        assert_eq!(newton.gain, model([1.0, 0.5]).depth());
        for curvatures in [[1.0, 0.5], [1.0, -0.5], [0.0, 1.0]] {
            let edge = model(curvatures).step(0.25);
            // Sixty halvings.
            assert!((edge.length - 0.25).abs() < 1e-12, "{edge:?}");
            assert!(edge.gain > 0.0);
        }
        assert_eq!(model([1.0, -0.5]).depth(), f64::INFINITY);
    }
}
