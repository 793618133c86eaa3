//! A control loop that turns a platform by a simulated gyro: some samples get lost, and halfway the
//! controller restarts from a checkpoint. `std` is used to print, nothing else; no heap is.
//!
//! `cargo run --package zerorate-core --no-default-features --example controller`
#![no_std]

extern crate std;

use std::println;

use zerorate_core::checkpoint;
use zerorate_core::{AutoFilter, AutoParams, Error, Stream};

const RATE: f32 = 500.0;
const STEP: f32 = 1.0 / RATE;

fn main() -> Result<(), Error> {
    let mut platform = Platform::new();
    let mut controller = Controller::new()?;
    run(20.0, &mut platform, &mut controller, 0.0);
    let (bias, sigma) = (controller.gyro.bias(), controller.gyro.bias_sigma());
    println!("20 s at rest: bias {bias:.3} deg/s, in truth {BIAS}");
    println!("as long as it may be a motion: ± {sigma:.3}");

    run(3.0, &mut platform, &mut controller, 90.0);
    let mut buffer = [0; 2048];
    let saved = checkpoint::write(&controller.gyro, &mut buffer)?;
    println!("in motion: a checkpoint of {} bytes", saved.len());
    let mut restarted = Controller { gyro: checkpoint::read(saved)?, ..controller };

    let mut other_platform = platform.clone();
    run(57.0, &mut platform, &mut controller, 90.0);
    run(57.0, &mut other_platform, &mut restarted, 90.0);
    let bits = |controller: &Controller, platform: &Platform| {
        let known = [controller.gyro.bias(), controller.gyro.bias_sigma(), controller.heading];
        (known.map(f32::to_bits), platform.heading.to_bits())
    };
    let same = bits(&restarted, &other_platform) == bits(&controller, &platform);
    println!("after the restart: {}", if same { "the same bits" } else { "other numbers" });

    println!("samples lost: {}", platform.lost);
    println!("turned by {:.2}°, 90° were asked for", platform.heading);
    println!("with the raw rate it would be off by {:.0}°", platform.raw - platform.heading);
    Ok(())
}

fn run(seconds: f32, platform: &mut Platform, controller: &mut Controller, target: f32) {
    for _ in 0..(seconds * RATE) as u32 {
        let torque = controller.step(platform.sample(), target);
        platform.turn(torque);
    }
}

/// Turns to a heading by the compensated rate.
#[derive(Clone, Copy)]
struct Controller {
    gyro: AutoFilter<f32>,
    rate: f32,
    heading: f32,
}

impl Controller {
    fn new() -> Result<Self, Error> {
        let params = AutoParams { rate: f64::from(RATE), ..AutoParams::default() };
        Ok(Self { gyro: AutoFilter::new(params)?, rate: 0.0, heading: 0.0 })
    }

    /// The rate to turn at.
    fn step(&mut self, z: f32, target: f32) -> f32 {
        let rate = self.gyro.update(z);
        // A lost sample has no answer: the rate before it holds.
        if rate.is_finite() {
            self.rate = rate;
        }
        self.heading += self.rate * STEP;
        (target - self.heading).clamp(-30.0, 30.0)
    }
}

const BIAS: f32 = 0.8;
const NOISE: f32 = 0.1;

/// A rotating platform, in deg and deg/s, and the gyro on it.
#[derive(Clone)]
struct Platform {
    heading: f32,
    rate: f32,
    /// The integral of what the gyro says.
    raw: f32,
    samples: u32,
    lost: u32,
    seed: u32,
}

impl Platform {
    fn new() -> Self {
        Self { heading: 0.0, rate: 0.0, raw: 0.0, samples: 0, lost: 0, seed: 1 }
    }

    /// Follows the commanded rate within a tenth of a second; brakes hold it when that is small.
    fn turn(&mut self, command: f32) {
        let wanted = if command.abs() < 0.05 { 0.0 } else { command };
        self.rate += (wanted - self.rate) * 10.0 * STEP;
        self.heading += self.rate * STEP;
    }

    /// Every 97th sample is lost.
    fn sample(&mut self) -> f32 {
        let z = self.rate + BIAS + NOISE * self.noise();
        self.raw += z * STEP;
        self.samples += 1;
        if self.samples.is_multiple_of(97) {
            self.lost += 1;
            return f32::NAN;
        }
        z
    }

    /// Nearly Gaussian, of unit deviation: the sum of twelve uniform numbers minus its mean.
    fn noise(&mut self) -> f32 {
        (0..12).map(|_| self.uniform()).sum::<f32>() - 6.0
    }

    fn uniform(&mut self) -> f32 {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.seed >> 8) as f32 / (1 << 24) as f32
    }
}
