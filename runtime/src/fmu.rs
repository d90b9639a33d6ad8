//! A source FMU: an instrument's C text with the functions of FMI 3.0 for co-simulation around it,
//! for tools that simulate what it plays with.
//!
//! ```text
//!   NAME.fmu = modelDescription.xml, sources/buildDescription.xml, sources/NAME.c, NAME.h, fmi3.c
//! ```
//!
//! | variable | causality | what |
//! | --- | --- | --- |
//! | each sensed axis | input | what is sensed (SI), read as a word of 16 bits before each tick |
//! | each driven axis | output | the force of the last tick (SI) |
//! | each live value | parameter, tunable | (SI; a switch is 0 or 1) |
//!
//! A step makes the ticks that are due by its end. Sensors with fewer bits, curves or pauses are
//! the importing tool's, as motors and keys are.
//!
//! Not here: the kernel's C text (`whippen_c99`), the archive.

use std::fmt::Write as _;

use whippen_compiler::bindings::Interface;
use whippen_compiler::pipeline::Compiled;

use crate::archive::archive;
use crate::device::Device;
use crate::report::escape;

/// The functions, with names in capitals where an instrument's own stand.
const WRAPPER: &str = include_str!("fmu/fmi3.c");

/// A number that a variable has, its name, unit and the value at the start.
struct Variable {
    name: String,
    unit: String,
    start: f64,
    attributes: String,
}

/// The bytes of an FMU of one key (or of what is played once): its C text and header.
///
pub fn fmu(compiled: &Compiled, device: &Device, own: &Interface, texts: [&str; 2]) -> Vec<u8> {
    let name = own.name.as_str();
    let variables = variables(compiled, device);
    let build = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  \
         <BuildConfiguration modelIdentifier=\"{name}\">\n    <SourceFileSet language=\"C99\">\n      \
         <SourceFile name=\"{name}.c\"/>\n      <SourceFile name=\"fmi3.c\"/>\n    </SourceFileSet>\n  \
         </BuildConfiguration>\n</fmiBuildDescription>\n"
    );
    let [source, header] = texts.map(|text| text.as_bytes().to_vec());
    let wrapper = wrapper(compiled, device, own);
    archive(&[
        (
            "modelDescription.xml".to_string(),
            description(name, compiled, &variables).into_bytes(),
        ),
        (
            "sources/buildDescription.xml".to_string(),
            build.into_bytes(),
        ),
        (format!("sources/{name}.c"), source),
        (format!("sources/{name}.h"), header),
        ("sources/fmi3.c".to_string(), wrapper.into_bytes()),
    ])
}

fn variables(compiled: &Compiled, device: &Device) -> Vec<Variable> {
    let model = &compiled.model;
    let ports = device.ports_of(model);
    let input = |(sense, port): (&whippen_compiler::model::Sense, &&crate::device::Port)| {
        let low_high = (port.sensor.low, port.sensor.high);
        Variable {
            name: sense.name.clone(),
            unit: sense.unit.to_string(),
            start: 0.0_f64.clamp(low_high.0, low_high.1),
            attributes: "causality=\"input\"".to_string(),
        }
    };
    let output = |at: usize| {
        let sense = &model.senses[at];
        Variable {
            name: format!("force_{}", sense.name),
            unit: if model.port_turns(at) { "N*m" } else { "N" }.to_string(),
            start: f64::NAN,
            attributes: "causality=\"output\"".to_string(),
        }
    };
    let live = |(live, of): (&whippen_compiler::model::Live, &_)| {
        let whippen_compiler::lower::LoweredLive { lsb, .. } = *of;
        let (low, high) = (live.range.low, live.range.high);
        Variable {
            name: live.name.clone(),
            unit: live.unit.clone(),
            start: (live.value / lsb).round() * lsb,
            attributes: format!(
                "causality=\"parameter\" variability=\"tunable\" min=\"{low:e}\" max=\"{high:e}\""
            ),
        }
    };
    let inputs = model.senses.iter().zip(&ports).map(input);
    let outputs = model.drives().into_iter().map(output);
    let lives = model.lives.iter().zip(&compiled.lowered.lives).map(live);
    inputs.chain(outputs).chain(lives).collect()
}

fn description(name: &str, compiled: &Compiled, variables: &[Variable]) -> String {
    let (mut units, mut listed, mut structure) = (Vec::new(), String::new(), String::new());
    for (at, variable) in variables.iter().enumerate() {
        let reference = at + 1;
        let unit = match variable.unit.as_str() {
            "" => "1",
            unit => unit,
        };
        if !units.contains(&unit) {
            units.push(unit);
        }
        let start = match variable.start.is_nan() {
            true => String::new(),
            false => format!(" start=\"{:e}\"", variable.start),
        };
        let _ = writeln!(
            listed,
            "    <Float64 name=\"{}\" valueReference=\"{reference}\" {}{start} unit=\"{}\"/>",
            escape(&variable.name),
            variable.attributes,
            escape(unit)
        );
        if variable.start.is_nan() {
            let _ = writeln!(structure, "    <Output valueReference=\"{reference}\"/>");
        }
    }
    let initial = structure.replace("Output", "InitialUnknown");
    let units: String = (units.iter())
        .map(|unit| format!("    <Unit name=\"{}\"/>\n", escape(unit)))
        .collect();
    let step = 1.0 / f64::from(compiled.model.rate_hz);
    // Importers know by it whether description and code belong together.
    let token = crc32fast::hash(compiled.lowered.kernel.to_string().as_bytes());
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" \
         instantiationToken=\"whippen-{token:08x}\" generationTool=\"Whippen {}\">\n  \
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"true\" fixedInternalStepSize=\"{step:e}\"/>\n  \
         <UnitDefinitions>\n{units}  </UnitDefinitions>\n  \
         <DefaultExperiment startTime=\"0\" stopTime=\"1\" stepSize=\"{step:e}\"/>\n  <ModelVariables>\n    \
         <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"/>\n{listed}  \
         </ModelVariables>\n  <ModelStructure>\n{structure}{initial}  </ModelStructure>\n</fmiModelDescription>\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// The functions, for this instrument.
fn wrapper(compiled: &Compiled, device: &Device, own: &Interface) -> String {
    let model = &compiled.model;
    let ports = device.ports_of(model);
    let list = |values: Vec<String>| match values.is_empty() {
        true => "0".to_string(),
        false => values.join(", "),
    };
    let each = |of: fn(&crate::device::Port) -> f64| {
        let values = ports.iter().map(|port| format!("{:e}", of(port)));
        list(values.collect())
    };
    let drives = model.drives();
    let scales = drives.iter().map(|at| {
        let scale = ports[*at].drive().full_scale;
        format!("{scale:e}")
    });
    let live = |(live, of): (
        &whippen_compiler::bindings::LiveInterface,
        &whippen_compiler::lower::LoweredLive,
    )| {
        let (low, high) = live.range;
        format!(
            "{{{:e}, {low}, {high}, {}, {}}}",
            of.lsb, live.init, live.at
        )
    };
    let lives = own.lives.iter().zip(&compiled.lowered.lives).map(live);
    let lives: Vec<String> = lives.collect();
    let token = crc32fast::hash(compiled.lowered.kernel.to_string().as_bytes());
    WRAPPER
        .replace("@NAME@", &own.name)
        .replace("@TOKEN@", &format!("whippen-{token:08x}"))
        .replace("@RATE@", &format!("{:e}", f64::from(model.rate_hz)))
        .replace("@INPUTS@", &ports.len().to_string())
        .replace("@OUTPUTS@", &drives.len().to_string())
        .replace("@LIVES@", &lives.len().to_string())
        .replace("@LOWS@", &each(|port| port.sensor.low))
        .replace("@HIGHS@", &each(|port| port.sensor.high))
        .replace("@SCALES@", &list(scales.collect()))
        .replace(
            "@LIVE_ROWS@",
            &match lives.is_empty() {
                true => "{1, 0, 0, 0, 0}".to_string(),
                false => lives.join(", "),
            },
        )
}
