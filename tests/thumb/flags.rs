//! Flags that are read far behind what made them: a sum compared with zero sets them itself, and
//! what stands between may take flags on a core that lacks the instruction.

use crate::random::compare;
use crate::target::CORES;
use whippen_compiler::kernel::parse;

/// How many random streams of input words each kernel is run with.
const STREAMS: u64 = 20;

fn on_all_cores(text: &str) {
    let kernel = parse(text).unwrap_or_else(|error| panic!("{error}"));
    for core in CORES {
        (0..STREAMS).for_each(|seed| compare(seed, &kernel, core));
    }
}

/// A saturation, which is two comparisons on ARMv6-M, stands between the sum and its reader.
#[test]
fn of_a_sum_before_a_saturation() {
    on_all_cores(
        "kernel k @44100 {
  in x: u16 [0..65535]
  in y: u16 [0..65535]
  out drive: i16 [-32768..32767]
  probe held: i32
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..65535] = in y
    v2: i32 [-65535..65535] = sub v0 v1
    v3: i32 [-32768..-32768] = const -32768
    v4: i32 [-32768..65535] = max v2 v3
    v5: i32 [32767..32767] = const 32767
    v6: i32 [-32768..32767] = min v4 v5
    probe held v6
    v7: i32 [0..0] = const 0
    v8: i1 [0..1] = lt v2 v7
    v9: i32 [-32768..32767] = select v8 v6 v7
    out drive v9
  }
}
",
    );
}

/// The same comparison is read before and behind a saturation, and made once.
#[test]
fn of_a_comparison_before_a_saturation() {
    on_all_cores(
        "kernel k @44100 {
  in x: u16 [0..65535]
  in y: u16 [0..65535]
  out drive: i16 [-32768..32767]
  probe less: i32
  probe held: i32
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..65535] = in y
    v2: i1 [0..1] = lt v0 v1
    v3: i32 [0..65535] = select v2 v0 v1
    probe less v3
    v4: i32 [0..0] = const 0
    v5: i32 [32767..32767] = const 32767
    v6: i32 [0..32767] = min v0 v5
    probe held v6
    v7: i32 [0..32767] = select v2 v6 v4
    out drive v7
  }
}
",
    );
}

/// A cell becomes 0 where two words are equal: their difference is the 0 that is stored.
#[test]
fn of_a_difference_that_is_stored() {
    on_all_cores(
        "kernel k @44100 {
  in x: u16 [0..65535]
  out drive: i16 [-32768..32767]
  cell c: i32 [0..65535] = 7
  cell last: i32 [0..65535] = 0
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [1..1] = const 1
    v2: i32 [0..32767] = sar v0 1
    v3: i32 [0..16383] = sar v0 2
    v4: i32 [0..16383] = min v2 v3
    v5: i1 [0..1] = eq v2 v4
    v6: i32 [0..0] = const 0
    v7: i32 [0..65535] = get c
    v8: i32 [0..65535] = select v5 v6 v7
    set c v8
    v9: i32 [1..32768] = add v2 v1
    set last v9
    out drive v4
  }
}
",
    );
}
