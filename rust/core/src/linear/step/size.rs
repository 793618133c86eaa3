//! Sizes of a filter, known at compile time or at run time, and working memory of a step.

use wide::f64x4;

/// Numbers of states and measurements.
pub(in crate::linear) trait Size: Copy {
    /// The same number of states with any measurements: code that needs no more is compiled once
    /// for them.
    type States: Size;
    /// One number per state, or per measurement; in registers if the compiler knows the size.
    type Column<'a, T: Copy + 'a>: AsMut<[T]>;
    type Row<'a, T: Copy + 'a>: AsMut<[T]>;
    /// True if a step is so short that a call would take longer.
    const IS_SMALL: bool;

    fn n(self) -> usize;
    fn m(self) -> usize;
    fn states(self) -> Self::States;
    /// Columns for writing, in this working memory if the size is known only at run time.
    fn column<'a, T: Copy + 'a>(self, zero: T, room: &'a mut [T]) -> Self::Column<'a, T>;
    fn row<'a, T: Copy + 'a>(self, zero: T, room: &'a mut [T]) -> Self::Row<'a, T>;
}

/// Sizes known to the compiler.
#[derive(Debug, Clone, Copy)]
pub(in crate::linear) struct Fixed<const N: usize, const M: usize>;

impl<const N: usize, const M: usize> Size for Fixed<N, M> {
    type States = Fixed<N, 1>;
    type Column<'a, T: Copy + 'a> = [T; N];
    type Row<'a, T: Copy + 'a> = [T; M];
    const IS_SMALL: bool = N <= 4;

    #[inline(always)]
    fn n(self) -> usize {
        N
    }

    #[inline(always)]
    fn states(self) -> Fixed<N, 1> {
        Fixed
    }

    #[inline(always)]
    fn m(self) -> usize {
        M
    }

    #[inline(always)]
    fn column<'a, T: Copy + 'a>(self, zero: T, _: &'a mut [T]) -> [T; N] {
        [zero; N]
    }

    #[inline(always)]
    fn row<'a, T: Copy + 'a>(self, zero: T, _: &'a mut [T]) -> [T; M] {
        [zero; M]
    }
}

/// Working memory for the intermediate results of a step.
#[derive(Debug)]
pub(in crate::linear) struct Work<'a> {
    /// n × n: I - K H, two working matrices, K R Kᵀ.
    pub a: &'a mut [f64],
    pub b: &'a mut [f64],
    pub c: &'a mut [f64],
    pub d: &'a mut [f64],
    /// m × n: H P, L⁻¹ H P, the transposed gain, the used rows of H, R Kᵀ.
    pub hp: &'a mut [f64],
    pub v: &'a mut [f64],
    pub k: &'a mut [f64],
    pub h: &'a mut [f64],
    /// m × m: the factor L, and R of the used measurements.
    pub l: &'a mut [f64],
    pub r: &'a mut [f64],
    pub rk: &'a mut [f64],
    /// m: reciprocals of the diagonal D, and the used measurements.
    pub inverse: &'a mut [f64],
    pub counts: &'a mut [bool],
    /// n: variances before the step.
    pub before: &'a mut [f64],
    /// n, n and m: states, predicted states, and D⁻¹ L⁻¹ y, of one channel and of several. Empty if
    /// they are [columns](Size::Column).
    pub one: [&'a mut [f64]; 3],
    #[cfg_attr(not(feature = "std"), allow(dead_code))]
    pub several: [&'a mut [f64x4]; 3],
}

/// Working memory of fixed size.
#[derive(Debug)]
pub(in crate::linear) struct FixedRoom<const N: usize, const M: usize> {
    a: [[f64; N]; N],
    b: [[f64; N]; N],
    c: [[f64; N]; N],
    d: [[f64; N]; N],
    hp: [[f64; N]; M],
    v: [[f64; N]; M],
    k: [[f64; N]; M],
    h: [[f64; N]; M],
    l: [[f64; M]; M],
    r: [[f64; M]; M],
    rk: [[f64; N]; M],
    inverse: [f64; M],
    counts: [bool; M],
    before: [f64; N],
}

impl<const N: usize, const M: usize> FixedRoom<N, M> {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            a: [[0.0; N]; N],
            b: [[0.0; N]; N],
            c: [[0.0; N]; N],
            d: [[0.0; N]; N],
            hp: [[0.0; N]; M],
            v: [[0.0; N]; M],
            k: [[0.0; N]; M],
            h: [[0.0; N]; M],
            l: [[0.0; M]; M],
            r: [[0.0; M]; M],
            rk: [[0.0; N]; M],
            inverse: [0.0; M],
            counts: [false; M],
            before: [0.0; N],
        }
    }

    #[inline(always)]
    pub fn work(&mut self) -> Work<'_> {
        Work {
            a: self.a.as_flattened_mut(),
            b: self.b.as_flattened_mut(),
            c: self.c.as_flattened_mut(),
            d: self.d.as_flattened_mut(),
            hp: self.hp.as_flattened_mut(),
            v: self.v.as_flattened_mut(),
            k: self.k.as_flattened_mut(),
            h: self.h.as_flattened_mut(),
            l: self.l.as_flattened_mut(),
            r: self.r.as_flattened_mut(),
            rk: self.rk.as_flattened_mut(),
            inverse: &mut self.inverse,
            counts: &mut self.counts,
            before: &mut self.before,
            one: [&mut [], &mut [], &mut []],
            several: [&mut [], &mut [], &mut []],
        }
    }
}
