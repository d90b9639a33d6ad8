//! Whole figures, of a rough hammer: enough to have forces, flights, strikes and states.

use super::*;
use crate::gesture::default_gesture;
use crate::trace::EventRow;

const RATE_HZ: u32 = 44_100;

/// A hammer on a spring under the key, thrown against a string. Not the instrument, only data that looks like it.
fn hammer_trace(travel_m: Vec<f64>) -> Trace {
    let names = ["f", "contact", "weight", "friction", "escapement", "inertia", "phi", "motion"];
    let units = ["n", "n", "n", "n", "n", "n", "rad", ""];
    let mut values = vec![Vec::with_capacity(travel_m.len()); names.len()];
    let (mut phi, mut rate, mut before, mut smooth, mut events) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, Vec::new());
    for (tick, &x) in travel_m.iter().enumerate() {
        let dt = 1.0 / f64::from(RATE_HZ);
        smooth += 0.02 * ((x - before) / dt - smooth);
        before = x;
        let squeeze = 0.73 * x.min(0.006) - 0.0178 * phi;
        let push = if squeeze >= 0.0 { (8e3 * squeeze + 50.0 * (0.73 * smooth - 0.0178 * rate)).max(0.0) } else { 0.0 };
        rate += dt * (0.0178 * push - 0.01186) / 1.54e-4;
        phi += dt * rate;
        if phi >= 0.365 && rate > 0.0 {
            let args = vec![("speed_m_per_s".to_string(), rate * 0.137)];
            events.push(EventRow { t_s: tick as f64 * dt, key: 0, event: "note".into(), args });
            rate *= -0.5;
        }
        if phi < 0.0 {
            (phi, rate) = (0.0, 0.0);
        }
        let bump = (0.2 * (1.0 - ((x - 0.0072) / 0.0012).abs())).max(0.0);
        let terms = [push * 0.73, -0.13, (30.0 * smooth).clamp(-0.13, 0.13), bump, 0.0];
        let state = f64::from(u8::from(squeeze < -1e-4)) + f64::from(u8::from(squeeze < -1e-4 && rate < 0.0));
        let row = [terms.iter().sum::<f64>()].into_iter().chain(terms).chain([phi, state]);
        values.iter_mut().zip(row).for_each(|(column, v)| column.push(v));
    }
    let mut columns: Vec<Column> = names
        .iter()
        .zip(units)
        .zip(values)
        .map(|((name, unit), values)| Column { name: (*name).into(), unit: unit.into(), labels: vec![], values })
        .collect();
    if let Some(motion) = columns.last_mut() {
        motion.labels = ["touching", "flying up", "falling"].map(String::from).to_vec();
    }
    columns.push(Column { name: "x".into(), unit: "m".into(), labels: vec![], values: travel_m });
    Trace { rate_hz: RATE_HZ, columns, events }
}

fn roles() -> Roles {
    Roles {
        title: "Grand piano: the bundled gesture".into(),
        travel: "x".into(),
        forces: ["contact", "weight", "friction", "escapement", "inertia"].map(String::from).to_vec(),
        total: "f".into(),
        coordinates: vec!["phi".into()],
        mark: "note".into(),
    }
}

#[test]
fn look() {
    let trace = hammer_trace(default_gesture().positions(RATE_HZ));
    let roles = roles();
    let figure = Figure::of(&trace, &roles);
    figure.save(Path::new("/tmp/look.png")).unwrap();
    figure.save(Path::new("/tmp/look.svg")).unwrap();
}
