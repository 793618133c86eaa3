//! The tests of the core in one program: what they make of twelve orders is compiled once.

#[macro_use]
mod common;

#[cfg(feature = "std")]
mod arma;
#[cfg(feature = "std")]
mod array;
mod auto;
#[cfg(feature = "parallel")]
mod contract;
#[cfg(feature = "std")]
mod deviations;
mod draw;
mod forged;
mod histories;
mod holding;
#[cfg(feature = "parallel")]
mod lanes;
mod laws;
#[cfg(feature = "std")]
mod linear;
mod navigation;
mod reference;
mod rest;
#[cfg(feature = "std")]
mod streaming;
#[cfg(feature = "std")]
mod vehicles;
#[cfg(feature = "std")]
mod wavelet;
