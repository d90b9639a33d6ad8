//! Commands on the text of a Kernel.

use whippen_compiler::kernel::{Kernel, VerifyError, parse, verify as check, without_probes};
use whippen_compiler::modes::{specialize_fully, verify::verify as verify_modes};

/// Reads and prints again.
pub fn print(text: &str, _: &[&str]) -> Result<String, String> {
    Ok(parse(text).map_or_else(
        |error| format!("error at {error}"),
        |kernel| kernel.to_string(),
    ))
}

/// What the verifier says.
pub fn verify(text: &str, _: &[&str]) -> Result<String, String> {
    let kernel = parse(text).map_err(|error| error.to_string())?;
    Ok(match check(&kernel) {
        Ok(_) => "ok".to_string(),
        Err(errors) => list(&errors),
    })
}

/// The kernel without probes.
pub fn strip(text: &str, _: &[&str]) -> Result<String, String> {
    let kernel = without_probes(&verified(text)?);
    check(&kernel).map_err(|errors| list(&errors))?;
    Ok(kernel.to_string())
}

/// The modes of the kernel, told apart by all cells that can tell them apart.
pub fn modes(text: &str, _: &[&str]) -> Result<String, String> {
    let kernel = verified(text)?;
    let modes = specialize_fully(&kernel, 1000).ok_or("more than 1000 instructions")?;
    verify_modes(&modes).map_err(|errors| list(&errors))?;
    Ok(modes.to_string())
}

/// A kernel that verifies.
pub fn verified(text: &str) -> Result<Kernel, String> {
    let kernel = parse(text).map_err(|error| error.to_string())?;
    check(&kernel).map_err(|errors| list(&errors))?;
    Ok(kernel)
}

fn list(errors: &[VerifyError]) -> String {
    let lines: Vec<String> = errors.iter().map(VerifyError::to_string).collect();
    lines.join("\n")
}

#[test]
fn every_operator_has_a_file() {
    use whippen_compiler::kernel::{ROWS, random::count_operators};
    let mut counts = vec![0; ROWS.len()];
    let files = super::DIRECTORIES
        .iter()
        .flat_map(|path| super::entries(&super::root().join(path)));
    let kernels = files.filter(|file| file.extension().is_some_and(|ending| ending == "kernel"));
    for file in kernels {
        let text = std::fs::read_to_string(&file).expect("is readable");
        let body = super::Case::read(&text, "kernel")
            .expect("has commands")
            .body;
        if let Ok(kernel) = verified(body) {
            count_operators(&kernel, &mut counts);
        }
    }
    let missing: Vec<&str> = ROWS
        .iter()
        .zip(counts)
        .filter(|(_, count)| *count == 0)
        .map(|(row, _)| row.name)
        .collect();
    assert!(missing.is_empty(), "no file for {missing:?}");
}
