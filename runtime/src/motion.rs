//! m
mod lowpass;
mod pchip;
mod resample;
