//! What `check` says of strings: points, the proof that they are stable, pitch, what saturates.

use whippen_compiler::ideal::Ideal;
use whippen_compiler::lower::LoweredStrand;
use whippen_compiler::model::Strand;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::{Dim, shown};
use whippen_runtime::device::Device;
use whippen_runtime::vibration::first_mode_hz;

/// A line for each string.
pub fn report(compiled: &Compiled, device: &Device) -> Vec<String> {
    let strands = compiled.lowered.strands.iter();
    strands
        .map(|lowered| line(compiled, device, lowered))
        .collect()
}

fn line(compiled: &Compiled, device: &Device, lowered: &LoweredStrand) -> String {
    let strand = &compiled.model.strands[lowered.strand];
    let bend = shown(strand.largest_bend(compiled.model.rate_hz), Dim::LENGTH);
    format!(
        "  string {}: {} points{}, stable ({:.4} of 2){}; what bends by more than {bend} between neighbours saturates{}",
        strand.name,
        strand.parts - 1,
        capped(strand),
        lowered.sum,
        pitch(compiled, device, strand),
        rounded(lowered.error)
    )
}

/// Whether it has no more points only because no string has.
fn capped(strand: &Strand) -> &'static str {
    match strand.points.is_none() && strand.parts == Strand::PARTS[1] {
        true => " (the most that a string may have)",
        false => "",
    }
}

/// What a tick rounds, where a bound of that is known.
fn rounded(error: f64) -> String {
    match error.is_finite() {
        true => format!("; a tick rounds {error:.1e} m/s at most"),
        false => "; it is rubbed, so what a tick rounds has no bound".to_string(),
    }
}

/// How far a tuned string is off, with what is live as it begins.
fn pitch(compiled: &Compiled, device: &Device, strand: &Strand) -> String {
    let Some(pitch) = strand.pitch else {
        return String::new();
    };
    let model = &compiled.model;
    let mut ideal = Ideal::new(model, &device.scales(), 1);
    ideal.tick(&vec![0; model.senses.len()]);
    let wanted_hz = ideal.value(0, pitch);
    let found_hz = first_mode_hz(compiled, device, strand);
    let cents = 1200.0 * (found_hz / wanted_hz).log2();
    format!(", {:.4} cents off its {wanted_hz:.3} Hz", cents.abs())
}
