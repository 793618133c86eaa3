//! The drift filter that tunes itself: [`AutoFilter`].
//!
//! Samples are gathered to ticks of a quarter second, in which a [`RestDetector`] sees motion, and
//! ticks at rest to blocks of two seconds, whose means a set of random walks explains. What one
//! sensor needs is learned: its white noise from the fading Allan variance of the ticks, the
//! strength of its drift from the likelihood of each walk.
//!
//! [`RestDetector`]: crate::rest::RestDetector

mod block;
mod filter;
mod following;
mod learned;
mod noise;
mod walks;

pub use filter::{AutoFilter, AutoParams, Status};
