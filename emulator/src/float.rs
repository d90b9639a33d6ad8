//! Single-precision arithmetic as the architecture defines it.

/// The bits of FPSCR that exist: flags, AHP, DN, FZ, rounding mode, cumulative exceptions.
pub(crate) const FPSCR_BITS: u32 = 0xf7c0_009f;
