//! Tuning: limits and thresholds of the specializer, none of which changes what a tick means.
//!
//! Limits on depth and size keep time and stack bounded on any program; no bundled instrument comes
//! near them. Thresholds were chosen by the bundled instruments' cycles and code size.

/// Cycles that a decision must save on its worse side to be made where the next mode does not
/// depend on it.
pub(crate) const BRANCH_THRESHOLD: u32 = 2;

/// Cycles that a condition must be estimated to save on its better side to be tried out.
pub(crate) const TRIAL_THRESHOLD: u32 = 1;

/// Nodes that are visited to find what falls with a decision, behind which what falls under several
/// nested choices counts once.
pub(crate) const FALLEN: u64 = 100;

/// Decisions on one path; what goes down a tree needs stack.
pub(crate) const DECISIONS_DEEP: usize = 100;

/// Comparisons of one value that are weighed against each other; of more, the middle one comes
/// first.
pub(crate) const COMPARISONS_WEIGHED: usize = 8;

/// Parts of a condition that are looked at. Long chains are decided from their start, and go on
/// from there.
pub(crate) const CONDITION_PARTS: usize = 256;

/// Steps back from what was decided to what was compared. Each makes a range smaller, which could
/// go on for long around a knot of equations.
pub(crate) const NARROWING_STEPS: usize = 200;

/// Simplifications that lead to simplifications; behind that an operator stands as it is.
pub(crate) const RULES_DEEP: usize = 64;

/// Rounds in which the cells' ranges on entry of each mode are narrowed; each follows what one tick
/// does to what is known.
pub(crate) const NARROWING_ROUNDS: usize = 3;

/// How often in a round trees are grown again for what the leaves of others leave.
pub(crate) const REGROWTHS: usize = 4;

/// Nodes that the search for modes visits, more where more instructions than usual are allowed;
/// behind that the best modes so far stand. Five times what the bundled instrument that needs most
/// visits.
pub(crate) const WORK: u64 = 30_000_000;

/// The part of that work that is no longer worth a try.
pub(crate) const WORK_REST: u64 = 16;

/// Blocks of one mode; parts of conditions that are shared are decided once for each use, which
/// could go on for long.
pub(crate) const BLOCKS: usize = 20_000;

/// Bools that are made of bools: going down them needs stack.
pub(crate) const BOOLS_DEEP: usize = 200;

/// Values that may be live below a block before any is sunk: fewer than there are registers,
/// because blocks need some for what they compute.
pub(crate) const LIVE_BELOW: usize = 4;

/// Instructions that are copied into the blocks below to free one register.
pub(crate) const CONE_INSTRUCTIONS: usize = 8;

/// Uses of bools that are followed to find the block of a use.
pub(crate) const BOOL_USES: usize = 64;

/// Blocks that are compared one below the other when equal tails are merged; behind that two
/// blocks are the same only if they lead to the same block.
pub(crate) const TAIL_DEEP: usize = 100;

/// Rounds in which what modes are entered with is widened to what others leave; behind that it is
/// all that a cell holds.
pub(crate) const WIDENING_ROUNDS: usize = 8;
