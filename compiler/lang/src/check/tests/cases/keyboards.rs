//! Keyboards with a mistake.

use super::{Case, case};

/// An instrument and the beginning of a keyboard that plays it.
macro_rules! keyboard {
    ($settings:literal) => {
        concat!(
            "instrument piano { sense x: length in 0 mm .. 10 mm live param weight = 0 N in 0 N .. 1 N\n",
            "    live param pedal = off force f = weight }\n",
            "keyboard board { ",
            $settings,
            " }"
        )
    };
}

/// Two instruments on a keyboard with zones.
macro_rules! zones {
    ($zones:literal) => {
        concat!(
            "instrument a { sense x: length in 0 mm .. 10 mm live param w = 0 N in 0 N .. 2 N force f = w }\n",
            "instrument b { sense x: length in 0 mm .. 10 mm live param w = 0 N in 0 N .. 2 N force f = w }\n",
            "keyboard k { rate 44100 Hz keys A0 .. C8 programs split zones ",
            $zones,
            " }"
        )
    };
}

/// Keyboards.
pub const KEYBOARDS: &[Case] = &[
    case("unknown program", &["WH0220"], keyboard!("rate 44100 Hz keys A0 .. C8 programs piano, pino")),
    case(
        "program of another keyboard",
        &["WH0220"],
        "instrument a { } instrument b { param k = 1 N } keyboard c { rate 1 Hz keys A0 .. C8 programs a b.k = { A0: 1 N } }",
    ),
    case(
        "unknown param",
        &["WH0221"],
        keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.wieght = { A0: 1 N }"),
    ),
    case(
        "name in a keyboard",
        &["WH0201"],
        keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.weight = { A0: heavy }"),
    ),
    case("call in a keyboard", &["WH0308"], keyboard!("rate fast(1) keys A0 .. C8 programs piano")),
    case(
        "value per key of another dimension",
        &["WH0302"],
        keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.weight = { A0: 1 g }"),
    ),
    case("bool per key", &["WH0302"], keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.pedal = { A0: on }")),
    case(
        "value per key outside",
        &["WH0507"],
        keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.weight = { A0: 1 N, C8: 2 N }"),
    ),
    case(
        "unknown notes",
        &["WH0603", "WH0603"],
        keyboard!("rate 44100 Hz keys A0 .. H8 programs piano piano.weight = { X1: 1 N }"),
    ),
    case("swapped keys", &["WH0505"], keyboard!("rate 44100 Hz keys C8 .. A0 programs piano")),
    case("missing settings", &["WH0604", "WH0604"], keyboard!("board rp2350")),
    case("no chips", &["WH0618"], keyboard!("board rp2350 * 0 rate 44100 Hz keys A0 .. C8 programs piano")),
    case("chips with a unit", &["WH0618"], keyboard!("board rp2350 * 2 mm rate 44100 Hz keys A0 .. C8 programs piano")),
    case("half a chip", &["WH0618"], keyboard!("board rp2350 * 1.5 rate 44100 Hz keys A0 .. C8 programs piano")),
    case("missing keys", &["WH0604"], keyboard!("rate 44100 Hz programs piano piano.weight = { A0: 1 N }")),
    case(
        "sense of a speed on keys",
        &["WH0617"],
        "instrument i { sense v: speed in 0 m/s .. 1 m/s } keyboard k { rate 44100 Hz keys A0 .. C8 programs i }",
    ),
    case(
        "second sense on keys",
        &["WH0617"],
        "instrument i { sense x: length in 0 mm .. 10 mm sense y: length in 0 mm .. 10 mm force f = 1 N }
         keyboard k { rate 44100 Hz keys A0 .. C8 programs i }",
    ),
    case("no values", &["WH0604"], keyboard!("rate 44100 Hz keys A0 .. C8 programs piano piano.weight = { }")),
    case(
        "repeated settings",
        &["WH0605", "WH0605", "WH0605"],
        keyboard!(
            "rate 44100 Hz rate 48000 Hz keys A0 .. C8 programs piano, piano piano.weight = { A0: 1 N, A0: 1 N }"
        ),
    ),
    case("rate without unit", &["WH0303"], keyboard!("rate 44100 keys A0 .. C8 programs piano")),
    case("rate of another dimension", &["WH0302"], keyboard!("rate 44100 s keys A0 .. C8 programs piano")),
    case("broken rate", &["WH0606"], keyboard!("rate 0.5 Hz keys A0 .. C8 programs piano")),
    case(
        "different senses",
        &["WH0607"],
        "instrument a { sense x: length in 0 mm .. 10 mm } instrument b { sense y: length in 0 mm .. 9 mm }
         keyboard k { rate 44100 Hz keys A0 .. C8 programs a, b }",
    ),
    case(
        "different number of senses",
        &["WH0607"],
        "instrument a { sense x: length in 0 mm .. 10 mm } instrument b { }
         keyboard k { rate 44100 Hz keys A0 .. C8 programs a, b }",
    ),
    case(
        "instrument of two keyboards",
        &["WH0608"],
        "instrument a { } keyboard k { rate 1 kHz keys A0 .. C8 programs a } keyboard l { rate 2 kHz keys A0 .. C8 programs a }",
    ),
    case("a key in no zone", &["WH0612"], zones!("split = { A0 .. B3: a, D4 .. C8: b }")),
    case("keys before and behind all zones", &["WH0612", "WH0612"], zones!("split = { A1 .. B3: a, C4 .. C7: b }")),
    case("no zones", &["WH0612"], zones!("split = { }")),
    case("keys in two zones", &["WH0613"], zones!("split = { A0 .. E4: a, C4 .. C8: b }")),
    case("a zone in a zone", &["WH0613"], zones!("split = { A0 .. C8: a, C4 .. E4: b }")),
    case("a zone beyond the keys", &["WH0614"], zones!("split = { A0 .. B3: a, C4 .. G9: b }")),
    case("a name that an instrument has", &["WH0220", "WH0615", "WH0616"], zones!("a = { A0 .. B3: a, C4 .. C8: b }")),
    case("zones that are no program", &["WH0616"], zones!("split = { A0 .. C8: a } zones other = { A0 .. C8: b }")),
    case("zones given twice", &["WH0605"], zones!("split = { A0 .. C8: a } zones split = { A0 .. C8: b }")),
    case("an unknown instrument in a zone", &["WH0220"], zones!("split = { A0 .. B3: a, C4 .. C8: c }")),
    case("zones in a zone", &["WH0220"], zones!("split = { A0 .. B3: a, C4 .. C8: split }")),
    case("an unknown note in a zone", &["WH0603"], zones!("split = { A0 .. H3: a, C4 .. C8: b }")),
    case("a swapped zone", &["WH0505"], zones!("split = { B3 .. A0: a, C4 .. C8: b }")),
    case("a value of zones", &["WH0220"], zones!("split = { A0 .. C8: a } split.w = { A0: 1 N }")),
    case("a value of an instrument in no zone", &["WH0220"], zones!("split = { A0 .. C8: a } b.w = { A0: 1 N }")),
    case(
        "zones among wrong keys",
        &["WH0603"],
        "instrument a { sense x: length in 0 mm .. 10 mm } keyboard k {
        rate 44100 Hz keys A0 .. X8 programs split zones split = { A0 .. B3: a } }",
    ),
    case(
        "misspelt zones",
        &["WH0220", "WH0616"],
        "instrument a { sense x: length in 0 mm .. 10 mm } keyboard k {
        rate 44100 Hz keys A0 .. C8 programs splt zones split = { A0 .. C8: a } }",
    ),
    case(
        "zones that sense differently",
        &["WH0607"],
        "instrument a { sense x: length in 0 mm .. 10 mm } instrument b { sense y: length in 0 mm .. 9 mm }
         keyboard k { rate 44100 Hz keys A0 .. C8 programs s zones s = { A0 .. B3: a, C4 .. C8: b } }",
    ),
    case(
        "unknown board",
        &["WH0618"],
        "keyboard board { board rp2530 rate 44100 Hz keys A0 .. C8 programs piano }
         instrument piano { sense x: length in 0 mm .. 10 mm }",
    ),
    case(
        "unknown device",
        &["WH0618"],
        "keyboard board { device piano_of_mine rate 44100 Hz keys A0 .. C8 programs piano }
         instrument piano { sense x: length in 0 mm .. 10 mm }",
    ),
    case(
        "device file of another kind",
        &["WH0618"],
        "keyboard board { device \"own.json\" rate 44100 Hz keys A0 .. C8 programs piano }
         instrument piano { sense x: length in 0 mm .. 10 mm }",
    ),
];
