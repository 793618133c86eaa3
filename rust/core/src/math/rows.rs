//! Rows of numbers, four at a time: in pairs, which every x86-64 has registers for, or in one AVX2
//! register if the processor has it.
//!
//! Each product and each sum is rounded separately, and the two forms give the same bits.

use wide::f64x4;

/// Layout of four numbers next to each other.
pub(crate) trait Fours: Copy {
    /// Four numbers.
    type Four: Copy;

    fn splat(self, x: f64) -> Self::Four;
    fn add(self, a: Self::Four, b: Self::Four) -> Self::Four;
    fn subtract(self, a: Self::Four, b: Self::Four) -> Self::Four;
    fn multiply(self, a: Self::Four, b: Self::Four) -> Self::Four;
    fn of(self, numbers: [f64; 4]) -> Self::Four;
    fn numbers(self, four: Self::Four) -> [f64; 4];

    /// The k-th group of four numbers in a row.
    #[inline(always)]
    fn take<const W: usize>(self, row: &[f64; W], k: usize) -> Self::Four {
        self.of(row.as_chunks().0[k])
    }

    /// Stores the four numbers.
    #[inline(always)]
    fn put<const W: usize>(self, four: Self::Four, row: &mut [f64; W], k: usize) {
        row.as_chunks_mut().0[k] = self.numbers(four);
    }

    /// Product plus sum, rounded twice.
    #[inline(always)]
    fn add_product(self, sum: Self::Four, a: Self::Four, b: Self::Four) -> Self::Four {
        self.add(sum, self.multiply(a, b))
    }

    /// `row` plus rows times factors; each number has the same sum as it would have alone.
    #[inline(always)]
    fn sum<const W: usize>(self, row: [f64; W], factors: &[f64], rows: &[[f64; W]]) -> [f64; W] {
        let mut total = row;
        for pair in 0..W / 8 {
            let (left, right) = (2 * pair, 2 * pair + 1);
            let (mut a, mut b) = (self.take(&total, left), self.take(&total, right));
            for (factor, row) in factors.iter().zip(rows) {
                let factor = self.splat(*factor);
                a = self.add_product(a, factor, self.take(row, left));
                b = self.add_product(b, factor, self.take(row, right));
            }
            self.put(a, &mut total, left);
            self.put(b, &mut total, right);
        }
        total
    }
}

/// Work on rows.
pub(crate) trait OnRows {
    type Output;

    fn run<F: Fours>(self, fours: F) -> Self::Output;
}

/// Four numbers as two pairs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pairs;

impl Fours for Pairs {
    type Four = f64x4;

    #[inline(always)]
    fn splat(self, x: f64) -> f64x4 {
        f64x4::splat(x)
    }

    #[inline(always)]
    fn add(self, a: f64x4, b: f64x4) -> f64x4 {
        a + b
    }

    #[inline(always)]
    fn subtract(self, a: f64x4, b: f64x4) -> f64x4 {
        a - b
    }

    #[inline(always)]
    fn multiply(self, a: f64x4, b: f64x4) -> f64x4 {
        a * b
    }

    #[inline(always)]
    fn of(self, numbers: [f64; 4]) -> f64x4 {
        f64x4::new(numbers)
    }

    #[inline(always)]
    fn numbers(self, four: f64x4) -> [f64; 4] {
        four.to_array()
    }
}

/// Does the work in the widest registers of the processor.
#[inline(always)]
pub(crate) fn widest<W: OnRows>(work: W) -> W::Output {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    if let Some(avx2) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(avx2, avx2::Work { work, avx2 });
    }
    work.run(Pairs)
}

#[cfg(all(feature = "std", target_arch = "x86_64"))]
mod avx2 {
    use pulp::x86::V3;
    use pulp::{Simd, WithSimd};

    use super::{Fours, OnRows};

    pub(super) struct Work<W> {
        pub work: W,
        pub avx2: V3,
    }

    impl<W: OnRows> WithSimd for Work<W> {
        type Output = W::Output;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> W::Output {
            self.work.run(self.avx2)
        }
    }

    impl Fours for V3 {
        type Four = pulp::f64x4;

        #[inline(always)]
        fn splat(self, x: f64) -> pulp::f64x4 {
            self.splat_f64s(x)
        }

        #[inline(always)]
        fn add(self, a: pulp::f64x4, b: pulp::f64x4) -> pulp::f64x4 {
            self.add_f64s(a, b)
        }

        #[inline(always)]
        fn subtract(self, a: pulp::f64x4, b: pulp::f64x4) -> pulp::f64x4 {
            self.sub_f64s(a, b)
        }

        #[inline(always)]
        fn multiply(self, a: pulp::f64x4, b: pulp::f64x4) -> pulp::f64x4 {
            self.mul_f64s(a, b)
        }

        #[inline(always)]
        fn of(self, numbers: [f64; 4]) -> pulp::f64x4 {
            pulp::cast(numbers)
        }

        #[inline(always)]
        fn numbers(self, four: pulp::f64x4) -> [f64; 4] {
            pulp::cast(four)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Fours, OnRows, Pairs, widest};

    /// Sums, and each sum minus the next number times a factor.
    #[derive(Clone, Copy)]
    struct Sums<'a>(&'a [[f64; 24]; 7], &'a [f64; 7]);

    impl OnRows for Sums<'_> {
        type Output = [f64; 24];

        fn run<F: Fours>(self, fours: F) -> [f64; 24] {
            let Self(rows, factors) = self;
            let mut sums = fours.sum(rows[0], factors, rows);
            for k in 0..5 {
                let next = fours.multiply(fours.splat(factors[k]), fours.take(&sums, k + 1));
                fours.put(fours.subtract(fours.take(&sums, k), next), &mut sums, k);
            }
            sums
        }
    }

    #[test]
    fn all_registers_give_the_same_bits() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for _ in 0..100 {
            let rows = core::array::from_fn(|_| core::array::from_fn(|_| random()));
            let factors = core::array::from_fn(|_| random());
            let work = Sums(&rows, &factors);
            let alone = |j: usize| {
                let sum = |sum: f64, i: usize| sum + factors[i] * rows[i][j];
                (0..7).fold(rows[0][j], sum)
            };
            assert_eq!(widest(work).map(f64::to_bits), work.run(Pairs).map(f64::to_bits));
            assert_eq!(work.run(Pairs)[20..], core::array::from_fn::<_, 4, _>(|j| alone(20 + j)));
        }
    }
}
