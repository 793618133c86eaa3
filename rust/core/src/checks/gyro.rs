//! Costs of a gyro's units and axis senses, compared with the accelerometer.

use nalgebra::{Matrix3, Vector3};

use super::cost::{Means, average, null, with_bias};
use super::propagation::{WindowMeans, propagate};
use super::window::{MEANS, windows};
use super::{ROTATIONS, Sense, UNITS};
use crate::math::parallel;
use crate::work::{collect, pause, push};

/// Number of senses: the rotations with two signs.
const SENSES: usize = 2 * ROTATIONS;
/// Numbers of ticks in a window: of the first test, and of a test of slower motion.
const SHORT_WINDOW_TICKS: usize = 400;
const LONG_WINDOW_TICKS: usize = 800;
/// Smallest number of long windows; with fewer, short windows are used.
const MIN_LONG_WINDOWS: usize = 6;
/// Largest number of windows.
const MAX_WINDOWS: usize = 150;
/// Largest initial bias of a hypothesis, and largest bias of any gyro, rad/s.
const MAX_INITIAL_BIAS_RAD_S: f64 = 0.175;
const MAX_GYRO_BIAS_RAD_S: f64 = 0.35;

/// Costs of the hypotheses on a gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroCosts {
    /// First tick of each window.
    pub starts: Vec<usize>,
    /// Number of ticks in a window.
    pub length: usize,
    /// Costs by unit, sense and window.
    pub costs: Vec<f64>,
    /// Costs of the forces without any rotation, by window.
    pub null: Vec<f64>,
    /// Biases by unit and sense, rad/s, in the axes and unit of the hypothetical gyro.
    pub biases: Vec<[f64; 3]>,
}

/// Tests all units and senses from ticks of a gyro, in the named unit as rad/s, and of an
/// accelerometer.
pub fn gyro_costs(rates: &[[f64; 3]], forces: &[[f64; 3]]) -> GyroCosts {
    let record = Record::of(rates, forces);
    let starts = windows(&record.rates, &record.forces, SHORT_WINDOW_TICKS, MAX_WINDOWS);
    let zero = [Vector3::zeros(); 3];
    let short = record.of_units(&starts, SHORT_WINDOW_TICKS, &zero);
    let longer = windows(&record.rates, &record.forces, LONG_WINDOW_TICKS, MAX_WINDOWS);
    if longer.len() < MIN_LONG_WINDOWS {
        return record.collect(starts, SHORT_WINDOW_TICKS, short);
    }
    let begun = core::array::from_fn(|u| {
        let best = short[u].iter().min_by(|a, b| a.average().total_cmp(&b.average()));
        let bias = best.map_or_else(Vector3::zeros, |best| best.bias);
        bias * (MAX_INITIAL_BIAS_RAD_S / bias.norm().max(MAX_INITIAL_BIAS_RAD_S))
    });
    let mut long = record.of_units(&longer, LONG_WINDOW_TICKS, &begun);
    // The stated sense also begins with its own best bias.
    let own = short[0][0].bias;
    for bias in [Vector3::zeros(), own] {
        let other = record.of_sense(&longer, LONG_WINDOW_TICKS, &bias);
        if other.average() < long[0][0].average() {
            long[0][0] = other;
        }
    }
    record.collect(longer, LONG_WINDOW_TICKS, long)
}

pub(super) struct Record {
    pub(super) rates: Vec<Vector3<f64>>,
    pub(super) forces: Vec<Vector3<f64>>,
}

/// A hypothesis: its costs by window, and its bias.
struct SenseCosts {
    costs: Vec<f64>,
    bias: Vector3<f64>,
}

impl SenseCosts {
    fn average(&self) -> f64 {
        average(&self.costs)
    }
}

impl Record {
    pub(super) fn of(rates: &[[f64; 3]], forces: &[[f64; 3]]) -> Self {
        let vectors = |all: &[[f64; 3]]| collect(all.iter().map(|v| Vector3::from(*v)));
        Self { rates: vectors(rates), forces: vectors(forces) }
    }

    /// All senses of each unit, in windows propagated with the unit's bias.
    fn of_units(
        &self,
        starts: &[usize],
        length: usize,
        biases: &[Vector3<f64>; 3],
    ) -> Vec<Vec<SenseCosts>> {
        let tasks = collect((0..UNITS.len()).flat_map(|u| [(u, 1.0), (u, -1.0)]));
        let halves = parallel::map(tasks, true, |(unit, sign)| {
            let all = self.propagate(starts, length, UNITS[unit], sign, &biases[unit]);
            evaluate_senses(&all, &Sense::rotations(), sign, &biases[unit])
        });
        let mut units: Vec<Vec<SenseCosts>> = collect([]);
        for (k, half) in halves.into_iter().enumerate() {
            match units.last_mut() {
                Some(unit) if k % 2 == 1 => half.into_iter().for_each(|one| push(unit, one)),
                _ => push(&mut units, half),
            }
        }
        units
    }

    /// Only the stated sense, in the stated unit.
    fn of_sense(&self, starts: &[usize], length: usize, bias: &Vector3<f64>) -> SenseCosts {
        let all = self.propagate(starts, length, UNITS[0], 1.0, bias);
        evaluate_senses(&all, &Sense::rotations()[..1], 1.0, bias).swap_remove(0)
    }

    fn propagate(
        &self,
        starts: &[usize],
        length: usize,
        unit: f64,
        sign: f64,
        bias: &Vector3<f64>,
    ) -> Vec<WindowMeans> {
        collect(starts.iter().map(|first| {
            pause();
            let part = *first..*first + length;
            propagate(&self.rates[part.clone()], &self.forces[part], sign * unit, &(bias * sign))
        }))
    }

    fn collect(&self, starts: Vec<usize>, length: usize, units: Vec<Vec<SenseCosts>>) -> GyroCosts {
        let all = || units.iter().flatten();
        GyroCosts {
            null: null(&self.forces, &starts, length),
            costs: collect(all().flat_map(|one| one.costs.iter().copied())),
            biases: collect(all().map(|one| one.bias.into())),
            starts,
            length,
        }
    }
}

fn evaluate_senses(
    windows: &[WindowMeans],
    senses: &[Sense],
    sign: f64,
    bias: &Vector3<f64>,
) -> Vec<SenseCosts> {
    let integrals: Vec<[Matrix3<f64>; MEANS]> =
        collect(windows.iter().map(|window| window.integrals.map(|psi| psi * sign)));
    collect(senses.iter().map(|sense| {
        pause();
        let means = |window: &WindowMeans| -> Means {
            core::array::from_fn(|k| sense.of(&window.tensors[k]))
        };
        let means = collect(windows.iter().map(means));
        let (mut costs, more) = with_bias(&means, &integrals, bias);
        let bias = bias + more;
        if bias.norm() > MAX_GYRO_BIAS_RAD_S {
            costs.iter_mut().for_each(|cost| *cost += 1.0);
        }
        SenseCosts { costs, bias }
    }))
}

const _: () = assert!(SENSES == 48);
