//! Tables from files, which the caller reads.

use super::check_text;
use crate::check::{FileReader, Options};
use crate::model::Node;

/// What stands beside the program.
const BESIDE: FileReader = FileReader(|program, file| match (program, file) {
    ("test.whip", "good.csv") => {
        Ok("x_um,force_gf,actuated\n0,0,0\n2000,40,0\n10000,60,1\n".into())
    }
    ("test.whip", "fallen.csv") => Ok("x_mm,f_N\n0,0\n3,1\n2,2\n".into()),
    ("test.whip", "photo.csv") => Ok("\u{0}\u{1}PNG".into()),
    _ => Err("there is no such file".into()),
});

fn read(file: &str) -> Result<Vec<f64>, Vec<String>> {
    let text = format!(
        "instrument test {{\n    sense x: length in 0 mm .. 10 mm\n    \
         table t: force over length from \"{file}\"\n    force f = t(x)\n}}\n"
    );
    let options = Options {
        read: BESIDE,
        ..Options::default()
    };
    let (_, program, found) = check_text(&text, &options);
    let Some(program) = program else {
        return Err(found.into_iter().map(|d| d.message).collect());
    };
    let dag = &program.instruments[0].dag;
    let curve = dag.nodes().find_map(|(_, node)| match node {
        Node::Curve(curve, _) => curve.table().cloned(),
        _ => None,
    });
    let table = curve.expect("a table");
    Ok([0.0, 1e-3, 2e-3, 10e-3].map(|x| table.value(x)).to_vec())
}

#[test]
fn knots_come_from_the_file_beside_the_program() {
    let found = read("good.csv").expect("a program");
    let gram = 9.80665e-3;
    for (value, grams) in found.iter().zip([0.0, 20.0, 40.0, 60.0]) {
        assert!((value - grams * gram).abs() < 1e-12, "{found:?}");
    }
}

#[test]
fn what_is_wrong_with_a_file_is_told_by_its_name() {
    let wrong = |file| read(file).expect_err("wrong").remove(0);
    assert_eq!(
        wrong("none.csv"),
        "`none.csv` cannot be read: there is no such file"
    );
    assert_eq!(wrong("photo.csv"), "`photo.csv` is no text");
    assert_eq!(
        wrong("fallen.csv"),
        "the knots of `t` must rise: 2 mm (line 4) is not above 3 mm (line 3)"
    );
}
