//! The examples in C and in C++ compile without a warning, run, and give the bits of the core.

use std::path::{Path, PathBuf};
use std::process::Command;

use zerorate_core::attitude::{Attitude, AttitudeParams, Auto, AutoOptions, Frame, Sample};
use zerorate_core::{AutoFilter, AutoParams, RestLimits, Stream};

const FNV: u64 = 14_695_981_039_346_656_037;

fn sum_of(sum: u64, x: f64) -> u64 {
    if x.is_nan() { sum } else { (sum ^ x.to_bits()).wrapping_mul(1_099_511_628_211) }
}

/// Numbers from -0.5 to 0.5, as both programs have them.
fn noise(seed: &mut u32) -> f64 {
    *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    f64::from(*seed >> 8) / 16_777_216.0 - 0.5
}

/// The sum that the program `drift` prints.
fn drift() -> u64 {
    let limits = RestLimits { rest: Some(10.0), bias: Some(20.0) };
    let params = AutoParams { limits, ..AutoParams::default() };
    let mut gyro: AutoFilter<f64> = AutoFilter::new(params).expect("these are in their ranges");
    let mut seed = 1;
    (0..6000).fold(FNV, |sum, k| {
        let noise = noise(&mut seed);
        let turn = if k < 2000 { 0.0 } else { [-30.0, 30.0][k / 200 % 2] };
        let z = if k % 97 == 96 { f64::NAN } else { 0.5 + 0.25 * noise + turn };
        sum_of(sum, gyro.update(z))
    })
}

/// The sums that the program `attitude` prints.
fn attitude(mag: bool) -> u64 {
    let params = AttitudeParams {
        rate: 100.0,
        frame: Frame::Enu,
        mag,
        gyro_unit: 1.0,
        accel_unit: 1.0,
        gyro_range: None,
    };
    let auto = Auto::new(AutoOptions { mag, ..AutoOptions::default() }).expect("the defaults");
    let mut attitude = Attitude::new(params, auto).expect("these are in their ranges");
    let mut seed = 7;
    (0..3000).fold(FNV, |sum, k| {
        let turn = if k < 1000 { 0.0 } else { [-0.5, 0.5][k / 100 % 2] };
        let gyro = [
            0.01 + 0.01 * noise(&mut seed) + turn,
            -0.02 + 0.01 * noise(&mut seed),
            0.005 + 0.01 * noise(&mut seed) - 0.5 * turn,
        ];
        let accel = [0.1 * noise(&mut seed), 0.1 * noise(&mut seed), 9.81 + 0.1 * noise(&mut seed)];
        let field = [0.1 * noise(&mut seed), 20.0, -40.0];
        let mag = if mag { field } else { [f64::NAN; 3] };
        let quaternion = attitude.update(Sample { gyro, accel, mag, dt: f64::NAN });
        quaternion.into_iter().fold(sum, sum_of)
    })
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The static library next to this test, of the same build, or the one that `ZR_LIBRARY` names.
fn library() -> PathBuf {
    if let Some(named) = std::env::var_os("ZR_LIBRARY") {
        return root().join("../..").join(named);
    }
    let test = std::env::current_exe().expect("a program knows where it is");
    let folder = test.parent().expect("it lies in a folder");
    [folder, folder.parent().expect("and that in another")]
        .map(|folder| folder.join("libzerorate.a"))
        .into_iter()
        .find(|path| path.exists())
        .expect("cargo builds the static library before the tests")
}

/// The output of an example, by this compiler in this dialect.
fn printed(compiler: &str, dialect: &str, source: &str) -> String {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(source.replace('.', "-"));
    let compiled = Command::new(compiler)
        .args([dialect, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-ffp-contract=off"])
        .arg(root().join("examples").join(source))
        .arg("-I")
        .arg(root().join("include"))
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program)
        .output()
        .expect("a compiler of C is there");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(program).output().expect("it was just compiled");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).expect("text")
}

fn sums(printed: &str) -> Vec<&str> {
    printed.lines().filter_map(|line| line.strip_prefix("sum ")).collect()
}

#[test]
fn a_program_in_c_gives_the_bits_of_the_core() {
    let printed = printed("cc", "-std=c11", "drift.c");
    assert_eq!(sums(&printed), [format!("{:016x}", drift())]);
    let refusal = "refused: rate must be a positive number of samples a second, got -1.0";
    assert!(printed.contains(refusal), "{printed}");
    assert!(printed.contains("in motion"), "{printed}");
}

#[test]
fn a_program_in_cpp_gives_the_bits_of_the_core() {
    let printed = printed("c++", "-std=c++17", "attitude.cpp");
    assert_eq!(sums(&printed), [false, true].map(|mag| format!("{:016x}", attitude(mag))));
    assert!(printed.contains("refused: rate must be"), "{printed}");
}
