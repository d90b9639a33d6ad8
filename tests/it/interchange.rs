//! What other programs read and write: numpy's arrays, WAV files of motions.

use std::process::Command;

use crate::cli::{Shell, bundled};

const JUDGE: &str = "
import csv, json, zipfile
import numpy as np
assert zipfile.ZipFile('trace.npz').testzip() is None
file = np.load('trace.npz')
trace, meaning = file['trace'], json.loads(str(file['meaning']))
rows = list(csv.reader(open('trace.csv')))
assert list(trace.dtype.names) == rows[0], (trace.dtype.names, rows[0])
assert len(trace) == len(rows) - 1
columns = {column['title']: column for column in meaning['columns']}
for at, name in enumerate(rows[0]):
    labels = columns[name]['labels'] if at > 0 else []
    of = (lambda text: labels.index(text)) if labels else float
    assert np.array_equal(trace[name], [of(row[at]) for row in rows[1:]]), name
print(len(trace), sum(bool(c['labels']) for c in meaning['columns']))
";

#[test]
fn numpy_reads_a_trace() {
    let Some(python) = whippen_need::python("numpy") else {
        return;
    };
    let shell = Shell::new().with("judge.py", JUDGE);
    let program = bundled("grand-piano.whip");
    for file in ["trace.csv", "trace.npz"] {
        let words = [
            "run",
            &program,
            "--seconds",
            "0.5",
            "--exact",
            "--every",
            "7",
        ];
        shell.ends(0, &[&words[..], &["--out", file]].concat());
    }
    let ran = Command::new(python)
        .arg("judge.py")
        .current_dir(shell.path("."))
        .output()
        .expect("python starts");
    let (out, errors) = (
        String::from_utf8_lossy(&ran.stdout),
        String::from_utf8_lossy(&ran.stderr),
    );
    assert!(ran.status.success(), "{errors}");
    let counts: Vec<usize> = (out.split_whitespace())
        .map(|count| count.parse().expect("a count"))
        .collect();
    assert_eq!(counts[0], 3150, "rows");
    assert!(counts[1] > 0, "states are among them");
}

#[test]
fn a_wav_file_is_a_motion() {
    let shell = Shell::new();
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 2000,
        bits_per_sample: 24,
        sample_format: hound::SampleFormat::Int,
    };
    let mut writer = hound::WavWriter::create(shell.path("key.wav"), spec).expect("is created");
    let mut bare = String::new();
    for n in 0..2000 {
        let place = (0.5 - 0.5 * (f64::from(n) * 0.01).cos()) * 0.9;
        let sample = (place * f64::from(1 << 23)).round() as i32;
        writer.write_sample(0).expect("is written");
        writer.write_sample(sample).expect("is written");
        let metres = f64::from(sample) * (0.01 / f64::from(1 << 23));
        bare += &format!("{metres}\n");
    }
    writer.finalize().expect("ends");
    let shell = shell.with("key.txt", &bare);
    let program = bundled("grand-piano.whip");
    let run = |out: &str, more: &[&str]| {
        let words = ["run", &program, "--exact", "--out", out, "--motion"];
        shell.ends(0, &[&words[..], more].concat());
        shell.lines(out)
    };
    let wav = ["key.wav", "--full-scale", "10mm", "--channel", "2"];
    let of_wav = run("wav.csv", &wav);
    assert_eq!(of_wav, run("bare.csv", &["key.txt", "--rate", "2000"]));
    for (more, says) in [
        (&["key.wav"][..], "--full-scale 10mm"),
        (&["key.wav", "--full-scale", "10deg"], "wants a length"),
        (
            &["key.wav", "--full-scale", "10mm", "--channel", "3"],
            "no channel 3",
        ),
        (&["key.txt", "--full-scale", "10mm"], "is for WAV files"),
    ] {
        let words = ["run", &program, "--motion"];
        shell.refuses(2, &[&words[..], more].concat(), &[says]);
    }
}
