//! The linear filter of fixed size gives the bits of the one whose sizes are known when it runs.
#![allow(non_snake_case)]

use zerorate_core::linear::{Batch, Known, LinearBank, LinearKalman, Model};

const F: [[f64; 3]; 3] = [[1.0, 0.1, 0.005], [0.0, 1.0, 0.1], [0.0, 0.0, 0.9]];
const H: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.5, 0.0, 1.0]];
const Q: [[f64; 3]; 3] = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.01], [0.0, 0.01, 0.03]];
const R: [[f64; 2]; 2] = [[1.0, 0.2], [0.2, 0.5]];
const B: [[f64; 1]; 3] = [[0.0], [0.1], [1.0]];

#[test]
fn of_fixed_size() {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut fixed = LinearKalman::<3, 2> { x: [0.0; 3], P: identity };
    let model = Model {
        sizes: [3, 2, 1],
        F: F.as_flattened().to_vec(),
        H: H.as_flattened().to_vec(),
        Q: Q.as_flattened().to_vec(),
        R: R.as_flattened().to_vec(),
        B: B.as_flattened().to_vec(),
    };
    let mut bank = LinearBank::new(model, None, Some(identity.as_flattened()), None).unwrap();
    for k in 0..200 {
        let (u, mut z) = ([(0.3 * f64::from(k)).sin()], [f64::from(k).cos(), f64::from(k).sin()]);
        if k % 7 == 3 {
            z[k as usize % 2] = f64::NAN;
        }
        if k % 11 == 5 {
            z = [f64::INFINITY; 2];
        }
        let batch =
            Batch { steps: 1, predicts: true, corrects: true, u: &u, z: &z, ..Batch::default() };
        bank.run(&batch, &mut Known::nothing());
        fixed.predict(&F, &Q, &B, &u);
        let step = fixed.update(&z, &H, &R);
        assert_eq!(bank.state(), fixed.x);
        assert_eq!(bank.covariance(), fixed.P.as_flattened());
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(bank.innovation()), bits(&step.innovation));
        assert_eq!(bits(bank.nis()), bits(&[step.nis]));
        assert_eq!(bank.log_likelihood(), [step.log_likelihood]);
    }
}

/// Two sensors of one state: three pieces of knowledge of the same weight.
#[test]
fn more_measurements_than_states() {
    let mut fixed = LinearKalman::<1, 2> { x: [0.0], P: [[1.0]] };
    let step = fixed.update(&[1.0, 3.0], &[[1.0], [1.0]], &[[1.0, 0.0], [0.0, 1.0]]);
    assert!((fixed.x[0] - 4.0 / 3.0).abs() < 1e-15, "{}", fixed.x[0]);
    assert!((fixed.P[0][0] - 1.0 / 3.0).abs() < 1e-15, "{}", fixed.P[0][0]);
    assert_eq!(step.innovation, [1.0, 3.0]);
}
