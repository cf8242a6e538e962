//! Numerical methods on sampled signals: filters, quantiles, spectra and binned means.

mod bins;
pub mod filter;
pub mod quantile;
mod spectrum;

pub use bins::{Band, Bin, binned};
pub use spectrum::Spectrum;
