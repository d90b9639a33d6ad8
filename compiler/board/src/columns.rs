//! Columns of eight keys on a board: which GPIO leads to the converters of each column, what these
//! are, and when they are sampled.
//!
//! ```text
//!   frame k of eight   select falls --sample of channel k, of every column--> word in memory
//!                      '------------word of two ticks before---------------> DAC's channel k
//!   behind frame 7     tick: words --> keys --> words of the DACs, sent from the next tick on
//! ```
//!
//! A key's sample is as old as any other's when its force begins.

use crate::bench::{Bench, CONVERSIONS, DmaTraffic};
use crate::knob::{Wire, pico_pin};
use crate::{Board, Contradiction};

/// Keys of a column: channels of each converter.
pub const COLUMN_KEYS: u32 = 8;
/// Columns that a chip can have: the DMA has 16 channels, one sends commands, and each column takes
/// two.
pub const COLUMNS_MAX: u32 = (DMA_CHANNELS - 1) / 2;
/// Channels of the DMA (RP2350 datasheet 12.6.1).
const DMA_CHANNELS: u32 = 16;
/// Pins that every state machine reaches where its window begins at GPIO 0, and both packages have.
const GPIO: u32 = 30;
/// Cycles from the wrap that asks for a frame to its select's fall, and from there to the DAC's
/// last edge.
const SELECT_CYCLES: u32 = 5;
/// See [`SELECT_CYCLES`].
const UPDATE_CYCLES: u32 = 289;
/// Cycles from the end of a frame until the first column's word lies in memory, and then from
/// column to column: the end of the program, and what channels of the DMA wait for each other. As
/// the emulated chip takes them (a test compares).
const WORD_CYCLES: [u32; 2] = [6, 2];
/// Cycles between two ticks: frames of 425 cycles and more, and counters of 16 bits.
const PERIODS: [u32; 2] = [3400, 65_528];
/// What of the loop's delay lies in the parts (ns): the low-pass before the ADC (15 kHz), and the
/// settling of the DAC. General knowledge, not checked against the parts' documents.
const PARTS_NS: u32 = 15_000 + 5_000;

/// The range of the ADC, all of which is a sensor's word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ConverterRange {
    /// How the board's file calls it.
    pub name: &'static str,
    /// What the ADC's register for it is.
    pub code: u8,
    /// The voltages at both ends (mV).
    pub ends_mv: [i32; 2],
}

/// Ranges of an ADS8688, by the codes of its registers (the document of the ADS8688W).
pub const CONVERTER_RANGES: [ConverterRange; 5] = [
    range("+-10.24 V", 0, [-10_240, 10_240]),
    range("+-5.12 V", 1, [-5_120, 5_120]),
    range("+-2.56 V", 2, [-2_560, 2_560]),
    range("0 to 10.24 V", 5, [0, 10_240]),
    range("0 to 5.12 V", 6, [0, 5_120]),
];

const fn range(name: &'static str, code: u8, ends_mv: [i32; 2]) -> ConverterRange {
    ConverterRange {
        name,
        code,
        ends_mv,
    }
}

/// The two wires that a column has for itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ColumnWires {
    /// To the DAC's data (DIN).
    pub to_dac: u32,
    /// From the ADC's data (SDO).
    pub from_adc: u32,
}

/// Columns.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Columns {
    /// To the clock of all converters (SCLK).
    pub clock: u32,
    /// To the select of all (/CS, /SYNC).
    pub select: u32,
    /// To the commands of all ADCs (SDI).
    pub command: u32,
    /// To all amplifiers: low where they give no current.
    pub enable: u32,
    /// From all amplifiers, if it is wired: low where one tells of a fault.
    pub fault: Option<u32>,
    /// Each column's own.
    pub columns: Vec<ColumnWires>,
    /// What all ADCs take for the whole of a word.
    pub range: ConverterRange,
    /// Whether a higher code of the DAC pulls keys down, against what a positive force is.
    pub pulls_down: bool,
    /// Cycles from tick to tick.
    pub period_cycles: u32,
}

impl Columns {
    /// How many keys it has room for.
    pub fn keys(&self) -> u32 {
        COLUMN_KEYS * self.columns.len() as u32
    }

    /// Cycles from one frame to the next.
    pub fn frame_cycles(&self) -> u32 {
        self.period_cycles / CONVERSIONS
    }

    /// Cycles from the wrap that asks for a frame until it is over. The last one's end is where a
    /// tick begins.
    pub fn whole_frame_cycles() -> u32 {
        SELECT_CYCLES + UPDATE_CYCLES
    }

    /// Cycles from there until words of all columns lie in memory.
    pub fn words_cycles(&self) -> u32 {
        let [first, each] = WORD_CYCLES;
        first + each * (self.columns.len() as u32).saturating_sub(1)
    }

    /// Cycles from the sample of any key to the DAC's update by the tick that has it: from the
    /// select to the last edge, two ticks later.
    pub fn latency_cycles(&self) -> u32 {
        2 * self.period_cycles + UPDATE_CYCLES
    }

    /// What the parts add to that (ns).
    pub fn parts_delay_ns() -> u32 {
        PARTS_NS
    }

    /// The columns that so many keys are on.
    pub fn columns_of(keys: u32) -> u32 {
        keys.div_ceil(COLUMN_KEYS)
    }

    /// The keys of each of so many cores: core 1 has the last ones. Each has whole columns, as
    /// nobody else shall write to a column's words; core 0, which also sends all words and looks
    /// after all, has no more of them than core 1.
    pub fn divided(keys: u32, cores: u32) -> Vec<u32> {
        if cores < 2 {
            return vec![keys];
        }
        let first = COLUMN_KEYS * (Self::columns_of(keys) / 2);
        vec![first, keys - first]
    }

    /// The state machine of a column: its block of PIO, and which one there. The first is that of
    /// clock and select; block 1 is left to sound.
    pub fn machine(column: u32) -> [u32; 2] {
        let at = column + 1;
        [at / 4 * 2, at % 4]
    }

    /// What leads where, in the order of the chip's pins. All columns of the board are wired, also
    /// those without keys: a DAC whose data hang free would take their level for words.
    pub fn wiring(&self, keys: u32) -> Vec<Wire> {
        let mut all = vec![
            (0, "MIDI out, if it is wanted".to_string()),
            (1, "MIDI in, if it is wanted".to_string()),
            (
                self.clock,
                "all ADCs and DACs, SCLK; 47 Ohm to each column".into(),
            ),
            (
                self.select,
                "all ADCs, /CS, and all DACs, /SYNC; and 10 kOhm to 3.3 V".into(),
            ),
            (self.command, "all ADCs, SDI".into()),
            (
                self.enable,
                "all amplifiers, enable; and 10 kOhm to ground".into(),
            ),
        ];
        all.extend(
            self.fault
                .map(|pin| (pin, "all amplifiers, fault (open drain)".into())),
        );
        for (column, own) in (0..).zip(&self.columns) {
            let first = COLUMN_KEYS * column;
            let keys = match keys.saturating_sub(first) {
                0 => "no keys".to_string(),
                1 => format!("key {first}"),
                more => format!("keys {first} to {}", first + more.min(COLUMN_KEYS) - 1),
            };
            all.push((own.to_dac, format!("DAC of column {column}, DIN: {keys}")));
            all.push((own.from_adc, format!("ADC of column {column}, SDO: {keys}")));
        }
        all.sort_unstable_by_key(|(gpio, _)| *gpio);
        let wire = |(gpio, to): (u32, String)| Wire {
            gpio,
            pico_pin: pico_pin(gpio),
            to: to.into(),
        };
        all.into_iter().map(wire).collect()
    }

    /// Pins with the keys of the file that say them.
    pub(crate) fn wires(&self) -> Vec<(&'static str, u32)> {
        let shared = [
            ("clock", self.clock),
            ("select", self.select),
            ("command", self.command),
            ("enable", self.enable),
        ];
        let fault = self.fault.map(|pin| ("fault", pin));
        let shared = shared.into_iter().chain(fault);
        let to = self.columns.iter().map(|own| ("to_dac", own.to_dac));
        let from = self.columns.iter().map(|own| ("from_adc", own.from_adc));
        shared.chain(to).chain(from).collect()
    }

    fn contradiction(&self) -> Option<(&'static str, String)> {
        let columns = self.columns.len() as u32;
        if !(1..=COLUMNS_MAX).contains(&columns) {
            let what = format!(
                "names {columns} columns, but a chip has 1 to {COLUMNS_MAX}: each takes two of the \
                 DMA's {DMA_CHANNELS} channels, and commands take one"
            );
            return Some(("to_dac", what));
        }
        let wires = self.wires();
        for (at, (key, pin)) in wires.iter().enumerate() {
            if *pin < 2 || *pin >= GPIO {
                let what = format!(
                    "has pin {pin}, but must be of 2 to 29: 0 and 1 are MIDI, and state machines \
                     reach no higher in both packages, where they share a select"
                );
                return Some((key, what));
            }
            if let Some((other, _)) = wires[..at].iter().find(|(_, own)| own == pin) {
                return Some((
                    key,
                    format!("has pin {pin}, which `columns.{other}` has too"),
                ));
            }
        }
        if self.select != self.clock + 1 {
            let what = format!(
                "must be pin {}, the one behind `columns.clock`: both are set together",
                self.clock + 1
            );
            return Some(("select", what));
        }
        let [least, most] = PERIODS;
        let period = self.period_cycles;
        (!(least..=most).contains(&period) || !period.is_multiple_of(CONVERSIONS)).then(|| {
            let what = format!("must be a multiple of {CONVERSIONS} of {least} to {most} cycles");
            ("period", what)
        })
    }

    /// What its DMA does in a tick with so many columns. The registers of state machines and of the
    /// DMA itself are behind one port of the fast bus, where an access takes up to two cycles
    /// (RP2350 datasheet 2.2.5) and priorities are mis-wired (erratum E27).
    fn traffic(&self) -> DmaTraffic {
        let columns = self.columns.len() as u32;
        let words = COLUMN_KEYS * columns;
        DmaTraffic {
            device: "pio0",
            reads: words,
            writes: words + CONVERSIONS,
            cycles: 2,
            in_memory: 2 * words + CONVERSIONS,
        }
    }
}

impl Board {
    /// What no columns can be.
    pub(crate) fn columns_that_cannot_be(&self) -> Option<Contradiction> {
        let columns = self.columns.as_ref()?;
        let (key, what) = match (&self.knob, &self.bench) {
            (None, None) => columns.contradiction()?,
            _ => (
                "clock",
                "is beside a `[knob]` or a `[bench]`: a board has one of the three".into(),
            ),
        };
        Some(Contradiction {
            key: format!("columns.{key}"),
            what,
        })
    }

    /// What its DMA does in a tick, if it has one at work.
    pub fn dma_traffic(&self) -> Option<DmaTraffic> {
        let columns = self.columns.as_ref().map(Columns::traffic);
        columns.or_else(|| self.bench.as_ref().map(Bench::traffic))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right(columns: u32) -> Columns {
        let own = |c: u32| ColumnWires {
            to_dac: 6 + 2 * c,
            from_adc: 7 + 2 * c,
        };
        Columns {
            clock: 2,
            select: 3,
            command: 4,
            enable: 5,
            fault: None,
            columns: (0..columns).map(own).collect(),
            range: CONVERTER_RANGES[3],
            pulls_down: false,
            period_cycles: 3400,
        }
    }

    #[test]
    fn all_columns_are_wired_with_keys_or_without() {
        let wires = right(3).wiring(9);
        let pins: Vec<u32> = wires.iter().map(|wire| wire.gpio).collect();
        assert_eq!(pins, (0..12).collect::<Vec<u32>>());
        let told = |pin: usize| wires[pin].to.to_string();
        assert_eq!(told(7), "ADC of column 0, SDO: keys 0 to 7");
        assert_eq!(told(8), "DAC of column 1, DIN: key 8");
        assert_eq!(told(10), "DAC of column 2, DIN: no keys");
    }

    #[test]
    fn every_column_has_a_machine_and_sound_has_a_block() {
        let all: Vec<[u32; 2]> = (0..COLUMNS_MAX).map(Columns::machine).collect();
        let wanted = [[0, 1], [0, 2], [0, 3], [2, 0], [2, 1], [2, 2], [2, 3]];
        assert_eq!(all, wanted);
        assert_eq!(right(7).latency_cycles(), 7089);
        assert_eq!(Columns::columns_of(9), 2);
        assert_eq!(Columns::divided(24, 1), [24]);
        assert_eq!(Columns::divided(9, 2), [8, 1]);
        assert_eq!(Columns::divided(48, 2), [24, 24]);
        assert_eq!(Columns::divided(56, 2), [24, 32]);
        let traffic = right(7).traffic();
        assert_eq!([traffic.reads, traffic.writes], [56, 64]);
        assert_eq!(traffic.in_memory, 64 + 56);
    }

    #[test]
    fn what_cannot_be_wired_is_told() {
        let told = |columns: u32, change: &dyn Fn(&mut Columns)| {
            let mut all = right(columns);
            change(&mut all);
            let told = all.contradiction();
            told.map_or(String::new(), |(key, what)| format!("{key} {what}"))
        };
        (1..=7).for_each(|columns| assert_eq!(told(columns, &|_| {}), ""));
        assert_eq!(told(7, &|c| c.fault = Some(28)), "");
        assert!(told(8, &|_| {}).starts_with("to_dac names 8 columns"));
        assert!(told(0, &|_| {}).starts_with("to_dac names 0 columns"));
        type Change<'a> = &'a dyn Fn(&mut Columns);
        let mistakes: [(Change, &str); 10] = [
            (&|c| c.clock = 1, "clock has pin 1"),
            (
                &|c| c.fault = Some(7),
                "from_adc has pin 7, which `columns.fault`",
            ),
            (&|c| c.fault = Some(30), "fault has pin 30, but must be"),
            (
                &|c| c.command = 3,
                "command has pin 3, which `columns.select`",
            ),
            (
                &|c| c.columns[1].to_dac = 5,
                "to_dac has pin 5, which `columns.enable`",
            ),
            (
                &|c| c.columns[1].from_adc = 8,
                "from_adc has pin 8, which `columns.to_dac`",
            ),
            (
                &|c| c.columns[0].from_adc = 30,
                "from_adc has pin 30, but must be of 2 to 29",
            ),
            (&|c| c.select = 20, "select must be pin 3"),
            (&|c| c.period_cycles = 3392, "period must"),
            (&|c| c.period_cycles = 3404, "period must"),
        ];
        for (change, wanted) in mistakes {
            let told = told(2, change);
            assert!(told.starts_with(wanted), "{told}, not {wanted}");
        }
    }
}
