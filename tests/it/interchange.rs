//! What other programs read and write: numpy's arrays, WAV files of motions, FMUs.

use std::process::Command;

use serde_json::{Value, json};
use whippen_compiler::check::Options;
use whippen_compiler::kernel::Interp;
use whippen_compiler::pipeline;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

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

const SIMULATOR: &str = "
import csv, json, os, sys
os.environ['PATH'] = os.path.dirname(sys.executable) + os.pathsep + os.environ['PATH']
import fmpy
from fmpy.validation import validate_fmu
from fmpy.build import build_platform_binary
problems = validate_fmu('x.fmu')
assert not problems, problems
unzipped = fmpy.extract('x.fmu')
build_platform_binary(unzipped)
described = fmpy.read_model_description(unzipped)
from fmpy.fmi3 import FMU3Slave
fmu = FMU3Slave(guid=described.guid, unzipDirectory=unzipped, modelIdentifier=described.coSimulation.modelIdentifier, instanceName='a')
fmu.instantiate()
reference = {v.name: v.valueReference for v in described.modelVariables}
step = float(described.defaultExperiment.stepSize)
task = json.load(open('task.json'))
fmu.enterInitializationMode(startTime=0.0)
fmu.exitInitializationMode()
inputs = [reference[name] for name in task['inputs']]
outputs = [reference['force_' + name] for name in task['outputs']]
told = []
for n, row in enumerate(task['rows']):
    if n == task['change']:
        fmu.setFloat64([reference[task['live']]], [task['value']])
    fmu.setFloat64(inputs, row)
    fmu.doStep(n * step, step)
    told.append(list(fmu.getFloat64(outputs)))
fmu.terminate()
fmu.freeInstance()
print(json.dumps(told))
";

/// What an FMU must drive: the interpreter's words, in newtons.
fn driven(file: &str, rows: &[Vec<f64>], live: (usize, &str, f64)) -> (Value, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(bundled(file)).expect("a program");
    let mut map = SourceMap::default();
    map.add(file, &text);
    let (program, _) = pipeline::front(&mut map, &Options::default());
    let model = program.expect("is right").instruments.remove(0);
    let device = Device::of(&model);
    let compiled = pipeline::compile(model, device.scales(), false).expect("compiles");
    let ports = device.ports_of(&compiled.model);
    let drives = compiled.model.drives();
    let mut interp = Interp::new(&compiled.lowered.kernel, 1).expect("is verified");
    let at = compiled
        .model
        .lives
        .iter()
        .position(|own| own.name == live.1);
    let at = at.expect("a live value");
    let mut drive = vec![0_i16; drives.len()];
    let mut forces = Vec::new();
    for (tick, row) in rows.iter().enumerate() {
        let words = row.iter().zip(&ports);
        let words: Vec<u16> = words.map(|(x, port)| port.linear_word(*x)).collect();
        if tick == live.0 {
            let word = compiled.lowered.lives[at].quantize(live.2);
            interp.set_live(at, word).expect("in range");
        }
        if tick == 0 {
            interp.init(&words);
        }
        interp.tick(&words, &mut drive);
        let of =
            |(word, at): (&i16, &usize)| f64::from(*word) / 32768.0 * ports[*at].drive().full_scale;
        forces.push(drive.iter().zip(&drives).map(of).collect());
    }
    let name = |at: &usize| compiled.model.senses[*at].name.clone();
    let senses = compiled.model.senses.iter().map(|sense| sense.name.clone());
    let task = json!({
        "inputs": senses.collect::<Vec<_>>(),
        "outputs": drives.iter().map(name).collect::<Vec<_>>(),
        "rows": rows, "change": live.0, "live": live.1, "value": live.2,
    });
    (task, forces)
}

// What is compared differs at tick 14 of the knob, though the FMU's forces are those of the module
// that the same command makes: the device here is probably another than the one of `build`.
#[test]
#[ignore = "the device of the test is not that of the command yet"]
fn an_fmu_drives_what_the_interpreter_drives() {
    let Some(python) = whippen_need::python("fmpy") else {
        return;
    };
    let sway = |n: usize, pace: f64, far: f64| far * (n as f64 * pace).sin();
    let knob: Vec<Vec<f64>> = (0..6000).map(|n| vec![sway(n, 0.002, 1.0)]).collect();
    let keytar = (0..6000).map(|n| {
        vec![
            sway(n, 0.0007, 0.03),
            sway(n, 0.002, 0.035),
            sway(n, 0.0003, 0.01) - 0.008,
        ]
    });
    for (file, rows, live) in [
        ("knob.whip", knob, (3000, "height", 0.02)),
        ("keytar.whip", keytar.collect(), (2500, "volume", 0.25)),
    ] {
        let (task, forces) = driven(file, &rows, live);
        let shell = Shell::new()
            .with("simulate.py", SIMULATOR)
            .with("task.json", &task.to_string());
        shell.ends(0, &["build", &bundled(file), "-o", "x.fmu"]);
        let ran = Command::new(&python)
            .arg("simulate.py")
            .current_dir(shell.path("."))
            .output()
            .expect("python starts");
        let told = String::from_utf8_lossy(&ran.stdout);
        let last = told.lines().last().unwrap_or_default();
        let found: Vec<Vec<f64>> = serde_json::from_str(last)
            .unwrap_or_else(|e| panic!("{e}: {told}{}", String::from_utf8_lossy(&ran.stderr)));
        let differs = (0..rows.len()).find(|tick| found[*tick] != forces[*tick]);
        assert_eq!(differs, None, "{file}: the first tick that is another");
        let moved = forces.iter().flatten().any(|force| force.abs() > 1e-3);
        assert!(moved, "{file} drives something");
    }
}
