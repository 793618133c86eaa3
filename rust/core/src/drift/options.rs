//! The table of all options of a drift filter.
//!
//! Signatures, command line, documentation and errors use [`OPTIONS`]. A new option needs a field
//! of [`Params`] or [`Behaviour`] and a row here.

use super::robust::ZONES_EXPECTED;
use super::{AutoParams, Behaviour, Method, Params, RobustParams, Zones};
use crate::allan::AllanKind;
use crate::error::Error;
use crate::rest::RestLimits;

/// All options of a drift filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// A published method, or `None` for the self-tuning filter.
    pub method: Option<Method>,
    /// Orders (p, q) of the ARMA model.
    pub order: (usize, usize),
    /// Numeric parameters; the self-tuning filter uses `rate`, `startup` and `scale`.
    pub params: Params,
    /// Zones of method "robust", which otherwise equals "akf"; `None` for other methods.
    pub robust: Option<RobustParams>,
    /// Input, treatment of motion, and output.
    pub behaviour: Behaviour,
    /// Limits of rest, for the self-tuning filter.
    pub limits: RestLimits,
}

/// Names of the methods.
pub const METHODS: [&str; 5] = ["kf", "akf", "fading", "robust", "auto"];

/// Name of the default method.
pub const METHOD: &str = METHODS[4];

impl Options {
    /// The defaults of a method.
    pub fn of(method: Option<Method>, rate: f64) -> Self {
        let params = Params::default();
        let behaviour = Behaviour::default();
        Self {
            method,
            order: (2, 1),
            params: Params { rate, method: method.unwrap_or(params.method), ..params },
            robust: None,
            // No published method detects motion by default.
            behaviour: Behaviour { hold_in_motion: method.is_none(), ..behaviour },
            limits: RestLimits::default(),
        }
    }

    /// The defaults of the method of this name.
    pub fn of_method(name: &str, rate: f64) -> Option<Self> {
        let method = match name {
            "kf" => Some(Method::Kf),
            "akf" => Some(Method::Akf),
            "fading" => Some(Method::Fading),
            "robust" => return Some(Self::of_robust(rate)),
            "auto" => None,
            _ => return None,
        };
        Some(Self::of(method, rate))
    }

    /// Defaults of the robust method: its source uses a model of first order.
    fn of_robust(rate: f64) -> Self {
        let robust = Some(RobustParams::default());
        Self { order: (1, 0), robust, ..Self::of(Some(Method::Akf), rate) }
    }

    /// The name of the method.
    pub fn method_name(&self) -> &'static str {
        match (self.method, self.robust) {
            (Some(_), Some(_)) => METHODS[3],
            (Some(Method::Kf), None) => METHODS[0],
            (Some(Method::Akf), None) => METHODS[1],
            (Some(Method::Fading), None) => METHODS[2],
            (None, _) => METHODS[4],
        }
    }

    /// Parameters of the self-tuning filter.
    pub fn auto(&self) -> AutoParams {
        let Params { rate, startup, scale, .. } = self.params;
        AutoParams { rate, startup, scale, behaviour: self.behaviour, limits: self.limits }
    }

    /// True if the method uses an option.
    pub fn uses(&self, option: &DriftOption) -> bool {
        option.methods.contains(&self.method_name())
    }
}

/// The value of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// No value: always, or learned.
    None,
    /// A number.
    Number(f64),
    /// One of a few words.
    Word(&'static str),
    /// Orders (p, q).
    Order((i64, i64)),
    /// Two numbers.
    Pair((f64, f64)),
}

/// Kind of an option's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Number,
    /// A number, or nothing.
    MaybeNumber,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Orders (p, q).
    Order,
    /// Two numbers, or one of these words.
    PairOr(&'static [&'static str]),
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct DriftOption {
    /// Name in Python; the command line uses hyphens.
    pub name: &'static str,
    /// Kind of the values.
    pub kind: Kind,
    /// Unit of a number; empty without a unit.
    pub unit: &'static str,
    /// Range in words, for errors.
    pub expected: &'static str,
    /// Meaning, in one sentence without a full stop.
    pub meaning: &'static str,
    /// Methods that use the option.
    pub methods: &'static [&'static str],
    /// Returns the value.
    pub get: fn(&Options) -> Value,
    /// Sets a value of the option's kind.
    pub set: fn(&mut Options, Value),
}

const PUBLISHED: &[&str] = &["kf", "akf", "fading", "robust"];
const FADING: &[&str] = &["fading"];
const ROBUST: &[&str] = &["robust"];
const AS_PUBLISHED: &str = "published";
const AUTO: &[&str] = &["auto"];
const KEEPING: &[&str] = &["kf", "akf", "fading"];

/// All options except the method and the rate.
pub const OPTIONS: &[DriftOption] = &[
    DriftOption {
        name: "output",
        kind: Kind::Choice(&["compensated", "estimate"]),
        unit: "",
        expected: "'compensated' or 'estimate'",
        meaning: "Output: samples minus their bias, or the bias",
        methods: &METHODS,
        get: |o| Value::Word(if o.behaviour.compensated { "compensated" } else { "estimate" }),
        set: |o, value| o.behaviour.compensated = value == Value::Word("compensated"),
    },
    DriftOption {
        name: "motion",
        kind: Kind::Choice(&["hold", "ignore"]),
        unit: "",
        expected: "'hold' or 'ignore'",
        meaning: "In motion: 'hold' the bias (default of auto), or 'ignore' motion and treat every sample as \
                  rest (default of the others)",
        methods: &METHODS,
        get: |o| Value::Word(if o.behaviour.hold_in_motion { "hold" } else { "ignore" }),
        set: |o, value| o.behaviour.hold_in_motion = value == Value::Word("hold"),
    },
    DriftOption {
        name: "limit",
        kind: Kind::MaybeNumber,
        unit: "unit of the samples",
        expected: "a positive number",
        meaning: "End of the sensor's range; samples at or beyond it count as missing",
        methods: &METHODS,
        get: |o| maybe(o.behaviour.limit),
        set: |o, value| set_maybe(&mut o.behaviour.limit, value),
    },
    DriftOption {
        name: "rest_limit",
        kind: Kind::MaybeNumber,
        unit: "unit of the samples",
        expected: "a positive number",
        meaning: "Standard deviation above which a sensor cannot be at rest",
        methods: AUTO,
        get: |o| maybe(o.limits.rest),
        set: |o, value| set_maybe(&mut o.limits.rest, value),
    },
    DriftOption {
        name: "bias_limit",
        kind: Kind::MaybeNumber,
        unit: "unit of the samples",
        expected: "a positive number",
        meaning: "Largest level that can be a bias",
        methods: AUTO,
        get: |o| maybe(o.limits.bias),
        set: |o, value| set_maybe(&mut o.limits.bias, value),
    },
    DriftOption {
        name: "order",
        kind: Kind::Order,
        unit: "",
        expected: "(p, q) with p from 1 to 3 and q from 0 to 3",
        meaning: "Orders of the drift's ARMA model",
        methods: PUBLISHED,
        get: |o| Value::Order((o.order.0 as i64, o.order.1 as i64)),
        set: |o, value| {
            if let Value::Order((p, q)) = value {
                o.order = (p as usize, q as usize);
            }
        },
    },
    DriftOption {
        name: "process_noise",
        kind: Kind::Number,
        unit: "",
        expected: "zero or a positive number",
        meaning: "Initial process noise of the drift, relative to the noise: 1e-6 is slow, 1 follows \
                  motion",
        methods: PUBLISHED,
        get: |o| Value::Number(o.params.process_noise),
        set: |o, value| set_number(&mut o.params.process_noise, value),
    },
    DriftOption {
        name: "fading",
        kind: Kind::Number,
        unit: "",
        expected: "above 0 and at most 1",
        meaning: "Fading factor of the measurement noise: 0.97 averages about 33 samples, 1 all",
        methods: FADING,
        get: |o| Value::Number(o.params.fading),
        set: |o, value| set_number(&mut o.params.fading, value),
    },
    DriftOption {
        name: "process_noise_memory",
        kind: Kind::Number,
        unit: "samples",
        expected: "zero or a positive number",
        meaning: "Weight of the initial process noise, in samples",
        methods: FADING,
        get: |o| Value::Number(o.params.process_noise_memory),
        set: |o, value| set_number(&mut o.params.process_noise_memory, value),
    },
    DriftOption {
        name: "noise",
        kind: Kind::Choice(&["allan", "hadamard"]),
        unit: "",
        expected: "'allan' or 'hadamard'",
        meaning: "Variance for the measurement noise: 'hadamard' ignores a steady change of the rate",
        methods: PUBLISHED,
        get: |o| Value::Word(o.params.noise.name()),
        set: |o, value| {
            let word = if let Value::Word(word) = value { word } else { "" };
            o.params.noise = AllanKind::of_name(word).unwrap_or(o.params.noise);
        },
    },
    DriftOption {
        name: "outliers",
        kind: Kind::Choice(&["keep", "reject"]),
        unit: "",
        expected: "'keep' or 'reject'",
        meaning: "Outliers: kept, as published, or rejected, as by auto",
        methods: KEEPING,
        get: |o| Value::Word(if o.behaviour.reject_outliers { "reject" } else { "keep" }),
        set: |o, value| o.behaviour.reject_outliers = value == Value::Word("reject"),
    },
    DriftOption {
        name: "adapt_for",
        kind: Kind::MaybeNumber,
        unit: "s",
        expected: "zero or a positive number of seconds",
        meaning: "Learning time of the drift model after the start-up",
        methods: PUBLISHED,
        get: |o| maybe(o.params.adapt_for),
        set: |o, value| set_maybe(&mut o.params.adapt_for, value),
    },
    DriftOption {
        name: "forgetting_factor",
        kind: Kind::Number,
        unit: "",
        expected: "above 0 and at most 1",
        meaning: "Forgetting factor of the drift model: 1 forgets nothing",
        methods: PUBLISHED,
        get: |o| Value::Number(o.params.forgetting_factor),
        set: |o, value| set_number(&mut o.params.forgetting_factor, value),
    },
    DriftOption {
        name: "zones",
        kind: Kind::PairOr(&[AS_PUBLISHED]),
        unit: "",
        expected: ZONES_EXPECTED,
        meaning: "Thresholds kappa,beta: above kappa standard deviations of the innovation a sample is an \
                  outlier; above beta times kappa its innovation is bounded",
        methods: ROBUST,
        get: |o| match robust(o).zones {
            Zones::Published => Value::Word(AS_PUBLISHED),
            Zones::Deviations(kappa, beta) => Value::Pair((kappa, beta)),
        },
        set: |o, value| {
            set_robust(o, |robust| match value {
                Value::Word(_) => robust.zones = Zones::Published,
                Value::Pair((kappa, beta)) => robust.zones = Zones::Deviations(kappa, beta),
                _ => {}
            });
        },
    },
    DriftOption {
        name: "damping",
        kind: Kind::Number,
        unit: "",
        expected: "from 0 to 1",
        meaning: "Share of the gain for an outlier",
        methods: ROBUST,
        get: |o| Value::Number(robust(o).damping),
        set: |o, value| set_robust(o, |robust| set_number(&mut robust.damping, value)),
    },
    DriftOption {
        name: "correction",
        kind: Kind::Number,
        unit: "",
        expected: "from 0 to 1",
        meaning: "Share of an innovation between the zones; 0 bounds it",
        methods: ROBUST,
        get: |o| Value::Number(robust(o).correction),
        set: |o, value| set_robust(o, |robust| set_number(&mut robust.correction, value)),
    },
    DriftOption {
        name: "startup",
        kind: Kind::Number,
        unit: "s",
        expected: "a positive number of seconds",
        meaning: "Length of the start-up; its mean is the first bias",
        methods: &METHODS,
        get: |o| Value::Number(o.params.startup),
        set: |o, value| set_number(&mut o.params.startup, value),
    },
    DriftOption {
        name: "scale",
        kind: Kind::MaybeNumber,
        unit: "unit of the samples",
        expected: "a positive number",
        meaning: "Standard deviation of the noise; by default learned",
        methods: &METHODS,
        get: |o| maybe(o.params.scale),
        set: |o, value| set_maybe(&mut o.params.scale, value),
    },
];

/// The option with this name.
pub fn option(name: &str) -> Option<&'static DriftOption> {
    OPTIONS.iter().find(|option| option.name == name)
}

impl Options {
    /// The options, if each number is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first number out of range.
    pub fn validate(self) -> Result<Self, Error> {
        let (params, behaviour) = (self.params.validate()?, self.behaviour.validate()?);
        let robust = self.robust.map(RobustParams::validate).transpose()?;
        Ok(Self { params, robust, behaviour, limits: self.limits.validate()?, ..self })
    }
}

/// The zones; for a method without zones, the defaults.
fn robust(options: &Options) -> RobustParams {
    options.robust.unwrap_or_default()
}

fn set_robust(options: &mut Options, set: impl FnOnce(&mut RobustParams)) {
    if let Some(robust) = &mut options.robust {
        set(robust);
    }
}

fn maybe(value: Option<f64>) -> Value {
    value.map_or(Value::None, Value::Number)
}

fn set_number(slot: &mut f64, value: Value) {
    if let Value::Number(number) = value {
        *slot = number;
    }
}

fn set_maybe(slot: &mut Option<f64>, value: Value) {
    *slot = if let Value::Number(number) = value { Some(number) } else { None };
}
