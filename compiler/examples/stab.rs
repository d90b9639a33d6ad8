use whippen_compiler::{bundled::INSTRUMENTS, check::Options, front::compile_front, source::SourceMap, stability::*};
fn main() {
    for (file, text) in INSTRUMENTS {
        let mut map = SourceMap::default();
        map.add(*file, *text);
        let (p, _) = compile_front(&mut map, &Options::default());
        for model in p.unwrap().instruments {
            let t = std::time::Instant::now();
            let key = if model.turns() {
                Key {
                    mass: 5e-6,
                    damping: 2e-5,
                    friction: 5e-4,
                    delay_ticks: 2.0,
                    bandwidth_hz: Some(1000.0),
                    sensor_lsb: 9.6e-5,
                }
            } else {
                Key {
                    mass: 0.06,
                    damping: 0.2,
                    friction: 0.03,
                    delay_ticks: 2.0,
                    bandwidth_hz: Some(3000.0),
                    sensor_lsb: 0.168e-6,
                }
            };
            let s = analyze(&model, &key).unwrap();
            println!(
                "== {} modes {} coarse {} {:?} passive {} need {:.4} changing {:.3} stable {} factor {:.3} word {:.2e} quiet {}",
                model.name,
                s.modes.len(),
                s.coarse,
                t.elapsed(),
                s.is_passive(),
                s.damping_needed(),
                s.damping_for_changing,
                s.is_stable(),
                s.factor(),
                s.force_per_word,
                s.is_quiet()
            );
            println!("   largest {:?}", s.largest);
            for m in s.modes.iter().take(4) {
                println!(
                    "   {:?} coupled {} settles {} need {:.4} {:?} {}",
                    m.gains, m.coupled, m.settles, m.damping_needed, m.worst, m.name
                );
            }
            let t = std::time::Instant::now();
            println!("   static {:?} {:?}", static_force(&model), t.elapsed());
            for d in warnings(&model, &s) {
                println!("{}", whippen_compiler::diag::render(&map, &d, false));
            }
        }
    }
}
