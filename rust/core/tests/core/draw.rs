//! Hostile numbers and histories of samples, drawn from a seed.

/// Ends of ranges, and what lies beyond most of them.
const EXTREMES: [f64; 20] = [
    0.0,
    5e-324,
    1e-310,
    1e-30,
    1e-12,
    1e-9,
    1e-6,
    1e-3,
    0.5,
    1.0,
    2.0,
    10.0,
    60.0,
    1e3,
    1e6,
    1e9,
    1e12,
    1e30,
    1e150,
    f64::MAX,
];
const LEVELS: [f64; 8] = [0.0, 1.0, -1.0, 0.01, 9.81, 50.0, -0.0, 1e-3];
/// Seconds between two samples; a year of gaps comes together within one history.
const STEPS_S: [f64; 16] = [
    0.0,
    5e-324,
    1e-9,
    1e-3,
    0.01,
    0.1,
    1.0,
    60.0,
    3600.0,
    1e6,
    3.2e7,
    1e12,
    1e300,
    -1.0,
    f64::INFINITY,
    f64::NAN,
];
/// Of a filter whose time only grows.
const STARTS_S: [f64; 7] = [0.0, -0.01, -1e9, 1e-300, 1.0, 1.7e9, 1e15];
const MAX_ROWS: usize = 60;

/// A generator of random numbers: SplitMix64.
pub struct Draw(u64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// From 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }

    pub fn flag(&mut self) -> bool {
        self.below(2) == 1
    }

    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// A parameter: the usual value, a multiple of it, or an extreme.
    pub fn number(&mut self, usual: f64) -> f64 {
        match self.below(4) {
            0 | 1 => usual,
            2 => usual * 10f64.powf(6.0 * self.uniform() - 3.0),
            _ => self.one_of(&EXTREMES),
        }
    }

    pub fn maybe(&mut self, usual: f64) -> Option<f64> {
        self.flag().then(|| self.number(usual))
    }

    pub fn three(&mut self, usual: f64) -> [f64; 3] {
        [(); 3].map(|()| self.number(usual))
    }

    /// A sample that no sensor should give.
    fn any(&mut self) -> f64 {
        let sign = self.one_of(&[1.0, -1.0]);
        match self.below(6) {
            0 => f64::NAN,
            1 => sign * f64::INFINITY,
            2 => sign * self.one_of(&EXTREMES),
            3 => f64::from_bits(self.bits()),
            4 => sign * 10f64.powf(640.0 * self.uniform() - 320.0),
            _ => 10.0 * self.normal(),
        }
    }

    /// Rows of `width` numbers: constant, zero, alternating, noise, some of it hostile.
    fn block(&mut self, width: usize) -> Vec<Vec<f64>> {
        let level: Vec<f64> = (0..width).map(|_| self.one_of(&LEVELS)).collect();
        let (kind, size) = (self.below(6), self.one_of(&LEVELS));
        let row = |k: usize, draw: &mut Self| {
            let level = level.iter();
            match kind {
                0 => level.copied().collect(),
                1 => vec![0.0; width],
                2 => level.map(|x| if k.is_multiple_of(2) { *x } else { -x }).collect(),
                3 => level.map(|x| x + size * draw.normal()).collect(),
                4 => (0..width).map(|_| draw.any()).collect(),
                _ => level.map(|x| if draw.below(9) > 0 { *x } else { draw.any() }).collect(),
            }
        };
        (0..=self.below(MAX_ROWS)).map(|k| row(k, self)).collect()
    }

    /// Blocks of rows, with the seconds since the row before in the column of a step, or the time,
    /// which grows, in that of a stamp.
    pub fn history(&mut self, width: usize, clock: Clock) -> Vec<Vec<Vec<f64>>> {
        let mut time = self.one_of(&STARTS_S);
        let mut blocks: Vec<_> = (0..2 + self.below(7)).map(|_| self.block(width)).collect();
        for block in &mut blocks {
            let step = self.one_of(&STEPS_S);
            for row in block {
                match clock {
                    Clock::None => {}
                    Clock::Step(column) => row[column] = step,
                    Clock::Stamp(column) => {
                        time += if step.abs() < 1e8 { step.abs() } else { 0.01 };
                        row[column] = time;
                    }
                }
            }
        }
        blocks
    }
}

/// The column of a sample that has its time.
#[derive(Clone, Copy)]
pub enum Clock {
    None,
    Step(usize),
    #[allow(dead_code)]
    Stamp(usize),
}

/// Histories of each stream: `ZERORATE_HISTORIES`, or `usual`.
pub fn count(usual: u64) -> u64 {
    let asked = std::env::var("ZERORATE_HISTORIES").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(usual)
}
