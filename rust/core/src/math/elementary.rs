//! Logarithm and exponential without a branch or a call: loops over several numbers are vectorised.
//!
//! The argument is reduced by its exponent, then a series is summed to rounding. The series are the
//! inverse hyperbolic tangent (Abramowitz & Stegun, 4.1.27) and Taylor's.

/// Coefficients of atanh(s)/s in s².
const INVERSE_TANGENT: [f64; 9] = [
    1.0,
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
];

/// Coefficients of the exponential.
const EXPONENTIAL: [f64; 13] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
];

/// ln 2 in two parts; products of the first part with whole numbers are exact.
const LN_2: [f64; 2] = [0.693_359_375, -2.121_944_400_546_905_8e-4];

/// Numbers whose bits are a fraction and an exponent.
pub trait Elementary: Sized {
    /// Natural logarithm of a normal positive number, to rounding; a finite number for other
    /// arguments.
    fn logarithm(self) -> Self;

    /// Exponential of a number from -80 to 0, to rounding.
    fn exponential(self) -> Self;
}

/// A polynomial by Horner's rule.
macro_rules! series {
    ($number:ty, $coefficients:expr, $x:expr) => {{
        let mut sum = 0.0;
        let mut k = $coefficients.len();
        while k > 0 {
            k -= 1;
            sum = sum * $x + $coefficients[k] as $number;
        }
        sum
    }};
}

macro_rules! elementary {
    ($number:ident, $bits:ident, $fraction:literal, $bias:literal, $root:literal) => {
        impl Elementary for $number {
            #[inline(always)]
            fn logarithm(self) -> Self {
                const ONE: $bits = $bias << $fraction;
                const ROOT: $bits = $root;
                // A number whose last place is one, so that what is put into its fraction counts.
                const WHOLE: $bits = ($bias + $fraction) << $fraction;
                let above = self.to_bits().wrapping_add(ONE - ROOT);
                let exponent = $number::from_bits((above >> $fraction) | WHOLE)
                    - $number::from_bits(WHOLE | $bias);
                let m = $number::from_bits((above & ((1 << $fraction) - 1)) + ROOT);
                let s = (m - 1.0) / (m + 1.0);
                let series = series!($number, INVERSE_TANGENT, (s * s));
                exponent * core::$number::consts::LN_2 + (s + s) * series
            }

            #[inline(always)]
            fn exponential(self) -> Self {
                // Half as much again as the number whose last place is one: rounds to whole numbers.
                const WHOLE: $bits = ($bias + $fraction) << $fraction | 1 << ($fraction - 1);
                let shifted = self * core::$number::consts::LOG2_E + $number::from_bits(WHOLE);
                let whole = shifted - $number::from_bits(WHOLE);
                let [high, low] = LN_2.map(|part| part as $number);
                let rest = (self - whole * high) - whole * low;
                let series = series!($number, EXPONENTIAL, rest);
                $number::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << $fraction))
            }
        }
    };
}

// The bits of the root of one half.
elementary!(f64, u64, 52, 1023, 0x3fe6_a09e_667f_3bcd);
elementary!(f32, u32, 23, 127, 0x3f35_04f3);

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Elementary;

    proptest! {
        #[test]
        fn logarithms_of_both_precisions(exponent in -300.0..300.0_f64, near in -0.5..0.5_f64) {
            let x = 10_f64.powf(exponent);
            // A few roundings of the logarithm, or of the one next to the argument.
            prop_assert!((x.logarithm() - x.ln()).abs() <= 5e-16 * x.ln().abs().max(1.0));
            let x = 1.0 + near;
            prop_assert!((x.logarithm() - x.ln()).abs() <= 5e-16);
            let x = 10_f32.powf(exponent as f32 / 9.0);
            prop_assert!((x.logarithm() - x.ln()).abs() <= 3e-7 * x.ln().abs().max(1.0));
        }

        #[test]
        fn exponentials_of_both_precisions(x in -80.0..0.0_f64) {
            prop_assert!((x.exponential() / x.exp() - 1.0).abs() < 4e-16);
            let x = x as f32;
            prop_assert!((x.exponential() / x.exp() - 1.0).abs() < 3e-7);
        }
    }

    #[test]
    fn exact_values() {
        assert_eq!((1.0_f64.logarithm(), 0.0_f64.exponential()), (0.0, 1.0));
        assert_eq!((1.0_f32.logarithm(), 0.0_f32.exponential()), (0.0, 1.0));
    }
}
