//! Tuned constants of the back end, in one place.
//!
//! None of them decides what is computed. Each trades cycles of the worst-case path against
//! compile time, and was chosen by measuring the bundled instruments.

/// Candidates beyond each mode's first that the search tries at most.
pub(super) const CANDIDATES_MAX: usize = 9;
/// Modes within so many cycles of the worst are searched like the worst: addresses, which come
/// later, may move them past it.
pub(super) const CLOSE_CYCLES: u64 = 3;
/// The longest modes whose cycles decide how many tick constants are promoted to registers.
pub(super) const PROMOTION_MODES: usize = 8;
/// Tick constants promoted to registers at most: every instruction finds enough of the others.
pub(super) const PROMOTED_MAX: usize = 5;

/// Blocks whose longest path is below this part (numerator, denominator) of the worst are not
/// reordered: an order saves less than the difference.
pub(super) const REORDER_PATH_MIN: (u64, u64) = (4, 5);
/// Places over which the reordering search moves an instruction at once.
pub(super) const REORDER_WINDOW: usize = 14;
/// Orders of a block that are measured at most.
pub(super) const REORDER_TRIES: usize = 4000;
/// How often the outcome is renamed and reordered once more, at most.
pub(super) const RENAMED_AGAIN_MAX: usize = 4;

/// Places before the end of a block at which a hoisted instruction is tried.
pub(super) const HOIST_WINDOW: usize = 8;
/// Instructions hoisted out of a block at most.
pub(super) const HOISTED_MAX: usize = 3;

/// Instructions after which a register counts as unused for long: it is as good as any.
pub(super) const RENAME_HORIZON: usize = 12;
/// What a high register loses against a low one, because only long encodings name it
/// (instructions of distance).
pub(super) const RENAME_HIGH_COST: usize = 6;

/// Instructions over which a loaded word keeps its register where blocks are long.
pub(super) const REMAT_WITHIN: usize = 40;
/// Instructions of a block that is long: a bowed string has 280, keys have less than half of that.
pub(super) const LONG_BLOCK: usize = 160;

/// Distance from a branch to its island on ARMv6-M (bytes): less than the 2 KiB that a branch
/// reaches, because islands move the code behind them.
pub(super) const ISLAND_DISTANCE: i64 = 1500;

/// Bytes behind a branch on ARMv6-M until what it leads to is placed, where all code at once would
/// need too many islands: less than a branch reaches, because some more wait with it.
pub(super) const OFF_PATH_DISTANCE: usize = 800;

/// Islands take at most one part of all code by this: beyond that they push apart what they are to
/// bring together.
pub(super) const ISLANDS_MAX_PART: usize = 2;
