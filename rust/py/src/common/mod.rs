//! Conversion of arrays, errors, and the parts that all streaming classes share.

pub mod arrays;
pub mod elements;
pub mod errors;
pub mod getters;
pub mod outputs;
pub mod rules;
pub mod streaming;
pub mod work;
