//! Events of a filter at a sample, one bit each.

/// Bits of [`EVENTS`], in their order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Events(u16);

/// Names of the bits, the lowest first.
pub const EVENTS: [&str; 14] = [
    "rate left out",
    "rate missing",
    "clipped",
    "gap",
    "glitch",
    "knock",
    "fall",
    "bias jump",
    "rest undone",
    "heading drift",
    "field held",
    "field ignored",
    "unclear rest",
    "wrong unit",
];

impl Events {
    /// A rate beyond the gyro's range.
    pub const LEFT_OUT: Self = Self(1 << 0);
    /// No rate for longer than the last rate is valid.
    pub const MISSING: Self = Self(1 << 1);
    /// A rate at the gyro's range.
    pub const CLIPPED: Self = Self(1 << 2);
    /// A jump or step back of the clock before the sample.
    pub const GAP: Self = Self(1 << 3);
    /// The previous rate was an outlier, and its rotation was undone.
    pub const GLITCH: Self = Self(1 << 4);
    /// A wrong tilt was corrected, after a knock or a bias jump.
    pub const KNOCK: Self = Self(1 << 5);
    /// The tilt was wrong by more than 45 degrees and was levelled again.
    pub const FALL: Self = Self(1 << 6);
    /// A rest showed that the bias has jumped.
    pub const BIAS_JUMP: Self = Self(1 << 7);
    /// A false rest was undone.
    pub const REST_UNDONE: Self = Self(1 << 8);
    /// The field showed that the heading drifts.
    pub const DRIFT: Self = Self(1 << 9);
    /// The magnetometer repeated one value while the body rotated, and was not used.
    pub const FIELD_HELD: Self = Self(1 << 10);
    /// A field other than the known one was not used.
    pub const FIELD_IGNORED: Self = Self(1 << 11);
    /// A rest with a bias above the limit, or a rate table.
    pub const UNCLEAR: Self = Self(1 << 12);
    /// Rates seem to be in another unit.
    pub const WRONG_UNIT: Self = Self(1 << 13);

    /// Adds bits.
    #[inline(always)]
    pub fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// The bits, with `other` added if `so`.
    #[inline(always)]
    pub fn with(self, other: Self, so: bool) -> Self {
        if so { Self(self.0 | other.0) } else { self }
    }

    /// The bits as a whole number.
    pub fn bits(self) -> u16 {
        self.0
    }
}
