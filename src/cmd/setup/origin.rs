//! What the bounds of an image follow from.

use std::hash::Hash;

use whippen_compiler::firmware::{Midi, Setup};
use whippen_compiler::kernel::Kernel;
use whippen_runtime::image::{self, ImageInstrument};

use super::ImageSetup;

/// An instrument, whatever its live values and its constants per key are: memory alone holds these,
/// and no bound rests on what memory holds at first. Its modes and its parts follow from its
/// Kernel.
#[derive(Hash)]
struct InstrumentOrigin<'a> {
    kernel: Kernel,
    midi: &'a Midi,
    is_in_parts: bool,
}

impl ImageSetup {
    /// Everything that the bounds of its images follow from, for however many keys: for the same,
    /// they are the same. Where the text stands is not part of it.
    pub fn origin<'a>(&'a self, instruments: &'a [ImageInstrument]) -> impl Hash + use<'a> {
        // Whoever adds a field has to say what it does to bounds.
        let ImageSetup {
            map: _,
            instruments: compiled,
            layout,
            device,
            board,
            keys,
            chips,
            chip,
            tuning,
            mode_instructions,
            fine_velocity,
            own_texts,
            monitor,
        } = self;
        // What the firmware is told of the first instrument and of its device, here for one key of
        // each core.
        let (first, cores, first_note) = (&compiled[0], board.cores, layout.first_note);
        let is_of_key = first.model.is_of_key();
        let few = if is_of_key { cores } else { 1 };
        let told: Result<Setup, String> =
            image::setup_to_bound(first, device, few, cores, first_note);
        let of_instrument = |own: &'a ImageInstrument| {
            let ImageInstrument {
                modes,
                places: _,
                midi,
                parts,
            } = own;
            InstrumentOrigin {
                kernel: modes.kernel.for_any_values(),
                midi,
                is_in_parts: parts.is_some(),
            }
        };
        let instruments: Vec<InstrumentOrigin> = instruments.iter().map(of_instrument).collect();
        (
            (instruments, *mode_instructions, is_of_key, told),
            (layout, board, *keys, *chips, *chip),
            (tuning, *fine_velocity, own_texts, monitor),
        )
    }
}
