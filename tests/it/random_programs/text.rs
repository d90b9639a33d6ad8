//! Texts of random programs: everything that a key can have, in forms that always compile.

use whippen_compiler::kernel::random::Rng;

/// Writes expressions at random.
struct Random(Rng);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0.below(n)
    }

    fn pick<'t>(&mut self, from: &[&'t str]) -> &'t str {
        self.0.pick(from)
    }

    /// A number between about 1e-3 and 1e3, of either sign.
    fn number(&mut self) -> String {
        let magnitude = [0.001, 0.03, 0.5, 1.0, 7.0, 260.0][self.below(6) as usize];
        let factor = 1.0 + self.below(1000) as f64 / 500.0;
        let sign = [1.0, -1.0][self.below(2) as usize];
        format!("{}", sign * magnitude * factor)
    }

    fn expression(&mut self, names: &[&str], depth: u32) -> String {
        if depth == 0 {
            return if self.below(3) == 0 {
                format!("({})", self.number())
            } else {
                self.pick(names).to_string()
            };
        }
        let a = self.expression(names, depth - 1);
        let b = self.expression(names, depth - 1);
        match self.below(22) {
            0..3 => format!("({a} + {b})"),
            3..5 => format!("({a} - {b})"),
            5..7 => format!("clamp({a}, -20, 20) * clamp({b}, -20, 20)"),
            7 => format!("min({a}, {b})"),
            8 => format!("max({a}, {b})"),
            9 => format!("clamp({a}, -2, 3.5)"),
            10 => format!("(if {} then {a} else {b})", self.condition(names)),
            11 => format!("abs({a})"),
            12 => format!("exp(clamp({a}, {}, 4))", self.pick(&["-3", "-40"])),
            13 => format!(
                "log(clamp(abs({a}), {}, 300))",
                self.pick(&["0.001", "120"])
            ),
            14 => format!("(7 * sin({a}))"),
            15 => format!("cos(clamp({a}, -0.5, 2))"),
            16 => format!("(3 * tanh({a}))"),
            17 => format!("sqrt(clamp({a}, {}, 30))", self.pick(&["0", "2"])),
            20 => format!("bent({a})"),
            21 => format!("smooth({a})"),
            18 => format!("(clamp({a}, -50, 50) / clamp(abs({b}), 0.25, 40))"),
            _ => format!(
                "(clamp({a}, 0, 30)^{})",
                self.pick(&["1.5", "2", "2.5", "3"])
            ),
        }
    }

    /// Knots of a table: some to many, near each other and far apart, some of them level.
    fn knots(&mut self) -> String {
        let most = [3, 40][self.below(2) as usize];
        let count = 2 + self.below(most);
        let (mut at, mut value) = (-20.0 + self.below(25) as f64, 0.0);
        let mut knots = Vec::new();
        for _ in 0..count {
            knots.push(format!("{at}: {value}"));
            at += [0.01, 0.3, 1.0, 8.0][self.below(4) as usize] * (1.0 + self.below(4) as f64);
            value += [0.0, 0.1, 4.0][self.below(3) as usize] * (self.below(9) as f64 - 4.0);
        }
        knots.join(", ")
    }

    /// A part between a millionth and all.
    fn part(&mut self) -> f64 {
        let size = [1.0, 0.1, 1e-2, 1e-4, 1e-6][self.below(5) as usize];
        size * (0.1 + self.below(900) as f64 / 1000.0)
    }

    /// A friction and a force of it, in half of all programs.
    fn friction(&mut self) -> Vec<&'static str> {
        const LAWS: &[&str] = &[
            "friction rub(v) against 0.3 * x' = 2 N * coulomb_law(v, width: 5 mm/s)",
            "friction rub(v) against 0 m/s = clamp(abs(two), 0, 9) * 1 N * stribeck_law(v, width: 3 mm/s, fall: 0.1 m/s, rest: 1.5)",
            "friction rub(v) against x' = (0.1 N + clamp(one, 0, 30) * 1 N) * sticky_law(v, top: 50 mm/s)",
            "friction rub(v) against clamp(one, -2, 2) * 1 m/s = if switch then 0.5 N*s/m * v else 3 N * tanh(v / (1 cm/s))",
        ];
        match self.below(8) {
            law @ 0..4 => vec![
                LAWS[law as usize],
                "force rub = rub * (1 + clamp(rub.slip / (1 m/s), -1, 1)^2)",
            ],
            _ => Vec::new(),
        }
    }

    /// A string that is pulled and pushed at places that move, so gently that nothing saturates, in
    /// a quarter of all programs; a quarter of those is rubbed.
    fn string(&mut self) -> String {
        let points = 5 + self.below(9);
        let ends = self.pick(&["pinned", "clamped, pinned", "clamped"]);
        let rubbed = match self.below(4) {
            0 => {
                "friction bow(v) at 100 mm + 5 * x against clamp(one, -1, 1) * 1 m/s = 0.2 N * sticky_law(v, top: 50 mm/s)"
            }
            _ => "",
        };
        let text = format!(
            "string wire along 0 m .. 0.3 m {{
                position w in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s
                density 2e-3 kg/m
                load (20 N + clamp(two, -9, 9) * 1 N) * d2(w) - 1e-4 N*m^2 * d4(w)
                load 1e-4 N*s * d2(w') - (0.02 + clamp(abs(level), 0, 1) * 0.02) * 1 N*s/m^2 * w'
                force clamp(one, -5, 5) * 4 mN at 150 mm + 5 * x
                ends {ends}
                points {points}
                {rubbed}
            }}
            force wire = clamp(d1(w, 130 mm + 4 * x) + w(120 mm) / 1 m, -1, 1) * 1 N - 1e-3 N*s/m * w(170 mm - x)'"
        );
        match self.below(4) {
            0 => text,
            _ => String::new(),
        }
    }

    /// A bank of two with memory of their own, in a quarter of all programs.
    fn bank(&mut self) -> String {
        let next = self.expression(&["one", "kept", "level"], 1);
        match self.below(4) {
            0 => format!(
                "bank twins over i in 0 .. 1 {{
                    state kept: number in -50 .. 50 = each(1, -2)
                    next kept = clamp({next}, -50, 50) / (i + 1)
                    noise hiss
                    let mine = kept * each(0.5, -3) + i * hiss
                }}
                force twins = sum(twins.mine) * 0.1 N + twins[1].mine * 0.2 N"
            ),
            _ => String::new(),
        }
    }

    fn condition(&mut self, names: &[&str]) -> String {
        let op = self.pick(&["<", "<=", ">", ">="]);
        let simple = format!("{} {op} {}", self.pick(names), self.number());
        match self.below(4) {
            0 => format!("({simple} and gate is open)"),
            1 => format!("(not ({simple}) or switch)"),
            2 => "gate is open".to_string(),
            _ => format!("({simple})"),
        }
    }
}

/// The text of a program, by its number.
pub fn program(seed: u64) -> String {
    let mut r = Random(Rng::new(seed));
    let sensed = ["turns", "level", "memory", "speed"];
    let (first, second) = (
        r.expression(&sensed, 2),
        r.expression(&["one", "turns", "level", "memory"], 3),
    );
    let (next, pull) = (
        r.expression(&["one", "two", "memory"], 1),
        r.expression(&["one", "two", "level"], 2),
    );
    let threshold = 2.0 + r.below(6) as f64;
    let (fast, slow) = (r.part(), r.part());
    let (written, fired) = (
        r.expression(&["one", "memory", "sum"], 1),
        r.expression(&["two", "level"], 1),
    );
    let lowest = [0, -10][r.below(2) as usize];
    let (spring, loss) = (100 * (1 + r.below(20)), r.below(4));
    let (bent, smooth) = (r.knots(), r.knots());
    let (friction, string, bank) = (r.friction(), r.string(), r.bank());
    format!(
        "instrument random_{seed} {{
            sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
            live param level = 0.7 in -3 .. 12.5
            live param switch = on
            table bent: number over number {{ {bent} }}
            table smooth: number over number cubic {{ {smooth} }}
            let turns = x / 1 mm
            let steep = (bent(turns)' + smooth(level * turns)') * 1 ms
            let speed = x' / 10 m/s
            state memory: number in -40 .. 60 = 1
            states gate {{ shut -> open when x > {threshold} mm  open -> shut when x < 1.5 mm }}
            let one = {first}
            let two = {second}
            next memory = {next}
            state lag: number in -200 .. 200
            next lag = lag + (clamp(one, -150, 150) - lag) * {fast}
            state sum: number in -1000 .. 1000 = 5
            next sum = if gate is open then clamp(sum + clamp(two, -9, 9) * {slow}, -900, 999) else sum
            pulse knock: number in {lowest} .. 40 lasting 1 ms
            body weight {{
                position y in -4 mm .. 12 mm, rate in -3 m/s .. 3 m/s
                mass 20 g
                force {spring} N/m * (x - y)
                force {loss} N*s/m * (x' - y')
                {}
            }}
            event hit when x > 5 mm {{
                fire knock at {fired}
                sum := {written}
                y' := -0.5 * y'
            }}
            force knock = knock * 0.1 N
            force pull = clamp({pull}, -1000, 1000) * 1 N
            {}
            {string}
            {bank}
        }}",
        friction.first().copied().unwrap_or_default(),
        friction.get(1).copied().unwrap_or_default(),
    )
}
