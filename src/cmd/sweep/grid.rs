//! Where a sweep looks: `NAME=LOW..HIGH:COUNT`, as a grid or as Sobol points.

use std::str::FromStr;

use whippen_compiler::units::{Dim, Quantity, parse_quantity, unit_suffix};

/// So many points are computed at the most.
pub const POINTS_MAX: usize = 65_536;

/// One parameter that is swept.
#[derive(Debug, Clone, PartialEq)]
pub struct Over {
    /// The parameter, or `instrument.parameter`.
    pub name: String,
    /// What its values are.
    pub dim: Dim,
    /// The lowest and the highest value (SI).
    pub ends: (f64, f64),
    /// How many values of a grid.
    pub count: Option<usize>,
}

impl FromStr for Over {
    type Err = String;

    fn from_str(text: &str) -> Result<Over, String> {
        let wanted = "wanted is NAME=LOW..HIGH:COUNT, such as k=60N/m..120N/m:7";
        let (name, range) = text.split_once('=').ok_or(wanted)?;
        let (low, rest) = range.split_once("..").ok_or(wanted)?;
        let (high, count) = match rest.split_once(':') {
            Some((high, count)) => (high, Some(count)),
            None => (rest, None),
        };
        let end = |text: &str| match parse_quantity(text) {
            Ok(Quantity::Real { value, dim }) => Ok((value, dim)),
            Ok(Quantity::Bool(_)) => Err(format!("`{text}` is no number; {wanted}")),
            Err(error) => Err(format!("{error}; {wanted}")),
        };
        let ((low_si, dim), (high_si, other)) = (end(low)?, end(high)?);
        if dim != other {
            return Err(format!("`{low}` and `{high}` are not of one kind"));
        }
        if low_si >= high_si {
            return Err(format!("`{low}` is not below `{high}`"));
        }
        let count = count.map(|count| match count.trim().parse::<usize>() {
            Ok(1) => Err(format!(
                "one point is no sweep: give that value with --set {}=..",
                name.trim()
            )),
            Ok(count @ 2..=POINTS_MAX) => Ok(count),
            _ => Err(format!(
                "`{count}` is no number of points from 2 to {POINTS_MAX}; {wanted}"
            )),
        });
        Ok(Over {
            name: name.trim().to_string(),
            dim,
            ends: (low_si, high_si),
            count: count.transpose()?,
        })
    }
}

impl Over {
    /// A value as `--set` takes it.
    pub fn setting(&self, value: f64) -> (String, String) {
        (self.name.clone(), format!("{value}{}", self.dim.unit()))
    }

    /// Its title in a table, with the unit last.
    pub fn title(&self) -> String {
        let name = self.name.replace('.', "_");
        match unit_suffix(&self.dim.unit()) {
            unit if unit.is_empty() => name,
            unit => format!("{name}_{unit}"),
        }
    }

    /// Its name with its unit, as axes have it.
    pub fn axis(&self) -> String {
        match self.dim.unit() {
            unit if unit.is_empty() => self.name.clone(),
            unit => format!("{} ({unit})", self.name),
        }
    }

    /// The value at a part of the way; both ends are exact.
    fn at(&self, part: f64) -> f64 {
        let (low, high) = self.ends;
        low * (1.0 - part) + high * part
    }
}

/// All points of a grid, the last parameter changing fastest.
///
/// # Errors
/// A parameter has no count, one is swept twice, or there are too many points, in words.
pub fn grid(overs: &[Over]) -> Result<Vec<Vec<f64>>, String> {
    each_once(overs)?;
    let mut points = vec![Vec::new()];
    for over in overs {
        let count = over.count.ok_or_else(|| {
            format!(
                "--over {}: how many values? write `..:7`, or --sobol 64",
                over.name
            )
        })?;
        if points.len() * count > POINTS_MAX {
            return Err(format!("the grid has more than {POINTS_MAX} points"));
        }
        let value = |i: usize| over.at(i as f64 / (count - 1) as f64);
        let longer = |point: &Vec<f64>| {
            let all = (0..count).map(value);
            let point = point.clone();
            all.map(move |value| [&point[..], &[value]].concat())
                .collect::<Vec<_>>()
        };
        points = points.iter().flat_map(longer).collect();
    }
    Ok(points)
}

/// So many Sobol points, scrambled by a seed (Owen, by Burley's hash).
///
/// # Errors
/// A parameter has a count, or one is swept twice, in words.
pub fn sobol(overs: &[Over], count: u32, seed: u32) -> Result<Vec<Vec<f64>>, String> {
    each_once(overs)?;
    if let Some(over) = overs.iter().find(|over| over.count.is_some()) {
        return Err(format!(
            "--over {}: --sobol says how many points there are; leave the count away",
            over.name
        ));
    }
    let value = |point: u32, (axis, over): (usize, &Over)| {
        over.at(f64::from(sobol_burley::sample(point, axis as u32, seed)))
    };
    let point = |point: u32| {
        let axes = overs.iter().enumerate();
        axes.map(|axis| value(point, axis)).collect()
    };
    Ok((0..count).map(point).collect())
}

fn each_once(overs: &[Over]) -> Result<(), String> {
    for (number, over) in overs.iter().enumerate() {
        if overs[..number]
            .iter()
            .any(|earlier| earlier.name == over.name)
        {
            return Err(format!("--over {}: it is swept twice", over.name));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_its_ends_and_changes_the_last_fastest() {
        let overs = ["k=60N/m..0.12kN/m:3", "B=0N*s/m..1N*s/m:2"];
        let overs = overs.map(|text| text.parse::<Over>().expect("right"));
        let points = grid(&overs).expect("a grid");
        assert_eq!(
            points,
            [
                [60.0, 0.0],
                [60.0, 1.0],
                [90.0, 0.0],
                [90.0, 1.0],
                [120.0, 0.0],
                [120.0, 1.0]
            ]
        );
        assert_eq!(overs[0].title(), "k_n_per_m");
        assert_eq!(overs[1].setting(0.5), ("B".into(), "0.5N*s/m".into()));
    }

    #[test]
    fn sobol_points_fill_every_cell_once() {
        let overs = ["a=0..1", "b=0..1"].map(|text| text.parse::<Over>().expect("right"));
        for seed in [0, 7] {
            let points = sobol(&overs, 64, seed).expect("points");
            // A (0, 6, 2)-net in base 2 has one point in each of 8 by 8 cells.
            let mut cells: Vec<usize> = points
                .iter()
                .map(|p| (p[0] * 8.0) as usize * 8 + (p[1] * 8.0) as usize)
                .collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..64).collect::<Vec<_>>(), "seed {seed}");
        }
        assert_ne!(sobol(&overs, 8, 0), sobol(&overs, 8, 1));
    }

    #[test]
    fn mistakes_are_told() {
        for (text, why) in [
            ("k", "such as k="),
            ("k=3N", "such as k="),
            ("k=1N..2m:3", "not of one kind"),
            ("k=2N..1N:3", "not below"),
            ("k=1N..1N:3", "not below"),
            ("k=1N..2N:1", "one point is no sweep"),
            ("k=1N..2N:0", "from 2 to"),
            ("k=1N..2N:x", "from 2 to"),
            ("k=on..off:2", "no number"),
            ("k=1Q..2Q:2", "Q"),
        ] {
            let found = text.parse::<Over>().unwrap_err();
            assert!(found.contains(why), "{text}: {found}");
        }
        let over = |text: &str| text.parse::<Over>().expect("right");
        assert!(grid(&[over("k=1N..2N")]).unwrap_err().contains("--sobol"));
        assert!(grid(&[over("a=0..1:300"), over("b=0..1:300")]).is_err());
        assert!(grid(&[over("a=0..1:2"), over("a=0..1:2")]).is_err());
        assert!(sobol(&[over("a=0..1:2")], 4, 0).is_err());
    }
}
