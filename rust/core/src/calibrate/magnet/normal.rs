//! Normal equations of hard irons, elements of soft iron and a field that changes slowly between
//! windows: sums of a range of ticks, and elimination of the fields.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

/// Standard deviation of the difference of two windows' fields.
const FIELD_WALK_SIGMA: f64 = 0.1;

/// An element of the soft iron.
pub type Element = Matrix3<f64>;

/// Weighted sums over ticks of one window and one group: A = D Bᵀ, s = Bᵀ h, and v, the residual of
/// y.
#[derive(Debug, Clone, Default)]
pub struct Sums {
    weight: f64,
    a: Matrix3<f64>,
    aa: Matrix3<f64>,
    /// For each axis of the sensor: column of A times s.
    a_s: [Matrix3<f64>; 3],
    s: Vector3<f64>,
    ss: Matrix3<f64>,
    av: Vector3<f64>,
    vs: Matrix3<f64>,
    v: Vector3<f64>,
}

impl Sums {
    /// Adds a tick.
    #[inline(always)]
    pub fn add(
        &mut self,
        weight: f64,
        a: &Matrix3<f64>,
        s: &Vector3<f64>,
        v: &Vector3<f64>,
        soft: bool,
    ) {
        let (wa, wv) = (a * weight, v * weight);
        self.weight += weight;
        self.a += wa;
        self.aa += wa.transpose() * a;
        self.av += wa.transpose() * v;
        self.v += wv;
        if soft {
            for i in 0..3 {
                self.a_s[i] += wa.row(i).transpose() * s.transpose();
            }
            self.s += s * weight;
            self.ss += s * s.transpose() * weight;
            self.vs += wv * s.transpose();
        }
    }
}

/// Unknowns: one field per window, elements of the soft iron, one hard iron per group.
#[derive(Debug, Clone)]
pub struct Normal {
    /// Block of each window.
    inner: Vec<Matrix3<f64>>,
    right: Vec<Vector3<f64>>,
    /// Block of each window with the other unknowns.
    across: Vec<Matrix3xX<f64>>,
    /// Block of the elements, then of the hard irons.
    pub own: DMatrix<f64>,
    pub own_right: DVector<f64>,
    soft: usize,
    walk: f64,
}

impl Normal {
    /// Equations for these numbers of windows, elements and groups. The difference of two fields
    /// has the weight `noise / WALK²`.
    pub fn new(windows: usize, soft: usize, groups: usize, noise: f64) -> Self {
        let size = soft + 3 * groups;
        Self {
            inner: vec![Matrix3::zeros(); windows],
            right: vec![Vector3::zeros(); windows],
            across: vec![Matrix3xX::zeros(size); windows],
            own: DMatrix::zeros(size, size),
            own_right: DVector::zeros(size),
            soft,
            walk: noise / (FIELD_WALK_SIGMA * FIELD_WALK_SIGMA),
        }
    }

    /// Adds the sums of a range of ticks.
    pub fn add(&mut self, window: usize, group: usize, sums: &Sums, elements: &[Element]) {
        let first = self.soft + 3 * group;
        self.inner[window] += sums.aa;
        self.right[window] += sums.av;
        let mut across = self.across[window].columns_mut(first, 3);
        across += sums.a.transpose();
        for i in 0..3 {
            self.own[(first + i, first + i)] += sums.weight;
            self.own_right[first + i] += sums.v[i];
        }
        for (k, element) in elements.iter().enumerate() {
            for i in 0..3 {
                let row = element.row(i).transpose();
                let mut column = self.across[window].column_mut(k);
                column += sums.a_s[i] * row;
                let with_iron = row.dot(&sums.s);
                self.own[(k, first + i)] += with_iron;
                self.own[(first + i, k)] += with_iron;
                self.own_right[k] += sums.vs.row(i).transpose().dot(&row);
                for (l, other) in elements.iter().enumerate() {
                    self.own[(k, l)] += (sums.ss * row).dot(&other.row(i).transpose());
                }
            }
        }
    }

    /// Adds the coupling of neighbouring fields, at their present values, and the regularisation.
    pub fn smooth(&mut self, fields: &[Vector3<f64>], little: f64) {
        let one = Matrix3::identity();
        for w in 0..self.inner.len() {
            self.inner[w] += one * little;
            if w > 0 {
                let apart = (fields[w] - fields[w - 1]) * self.walk;
                self.inner[w - 1] += one * self.walk;
                self.inner[w] += one * self.walk;
                self.right[w - 1] += apart;
                self.right[w] -= apart;
            }
        }
    }

    /// Eliminates the fields from the other equations.
    pub fn eliminate(mut self) -> Option<Eliminated> {
        let mut inverses = Vec::with_capacity(self.inner.len());
        for w in 0..self.inner.len() {
            let inverse = self.inner[w].try_inverse()?;
            let solved = inverse * &self.across[w];
            self.own -= self.across[w].transpose() * &solved;
            self.own_right -= solved.transpose() * self.right[w];
            if w + 1 < self.inner.len() {
                // The coupling of neighbours is -walk.
                self.inner[w + 1] -= inverse * (self.walk * self.walk);
                let propagated = inverse * self.right[w] * self.walk;
                self.right[w + 1] += propagated;
                self.across[w + 1] += solved * self.walk;
            }
            inverses.push(inverse);
        }
        Some(Eliminated { rest: self, inverses })
    }
}

/// Equations without the fields, and the data for the fields.
#[derive(Debug, Clone)]
pub struct Eliminated {
    pub rest: Normal,
    inverses: Vec<Matrix3<f64>>,
}

impl Eliminated {
    /// Solves for the other unknowns and the field of each window.
    pub fn solve(&self) -> Option<(DVector<f64>, Vec<Vector3<f64>>)> {
        let rest = match self.rest.own.clone().cholesky() {
            Some(factor) => factor.solve(&self.rest.own_right),
            None => self.rest.own.clone().lu().solve(&self.rest.own_right)?,
        };
        let mut fields = vec![Vector3::zeros(); self.inverses.len()];
        let mut next = Vector3::zeros();
        for w in (0..fields.len()).rev() {
            let right = self.rest.right[w] - &self.rest.across[w] * &rest + next * self.rest.walk;
            next = self.inverses[w] * right;
            fields[w] = next;
        }
        Some((rest, fields))
    }
}
