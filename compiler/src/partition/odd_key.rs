//! Which core has the key that is over, where two cores have equal parts of an odd number.

use whippen_board::Board;
use whippen_firmware::{FirmwareImage, Instrument, Setup, build_image};
use whippen_keyboard::Layout;

use super::{BuildError, Partitioned};

/// The image of equal parts, or where it is late that in which core 1 has the key that is over, if
/// that one is in time.
pub(super) fn with_odd_key_in_time(
    equal: FirmwareImage,
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<Partitioned, BuildError> {
    let [first, second] = setup.keys[..] else {
        return Ok(equal.into());
    };
    if first != second + 1 || board.columns.is_some() {
        return Ok(equal.into());
    }
    // What has no bound is judged by whoever wants one.
    let mut equal = Partitioned::from(equal);
    if !equal.is_late(board, setup.rate_hz) {
        return Ok(equal);
    }
    let swapped = Setup {
        keys: vec![second, first],
        ..setup.clone()
    };
    let other = build_image(layout, instruments, &swapped, board).map_err(BuildError::Image)?;
    let mut other = Partitioned::from(other);
    let is_late = other.is_late(board, setup.rate_hz);
    Ok(if is_late { equal } else { other })
}
