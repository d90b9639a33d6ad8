//! Every instruction's cycles on every core, as text: what the tables say of each encoding, and of
//! each kind of operand that they tell apart.

use whippen_isa::timing::{Core, Evidence, Line};
use whippen_isa::{Class, Encoding, Flags, Inst, ItRule, Op, RegSet, ShiftType};

const HEADING: &str = "\
Cycles of every instruction. Made from the tables in isa/src/cores; WHIPPEN_BLESS=1 cargo test -p whippen-isa --test timing

  N          a cycle for each register of the list
  a/b        a branch: taken, not taken; without what its target adds
  a..b       a division, by its operands
  late       whoever needs the result next waits a cycle; `late but sums`: not the accumulator of a multiply-add,
             `late in addresses`: only addresses
  unit a+b   the floating-point unit is taken a cycles, and its result comes b cycles after
  *          estimate; nothing: rule; !: exact, a published count is reproduced

";

/// The whole table.
pub fn table() -> String {
    let cores = [Core::cortex_m33(), Core::cortex_m4(), Core::cortex_m0plus()];
    let mut text = HEADING.to_string();
    text.push_str(&row("", &cores.map(|core| core.name.to_string())));
    for encoding in Encoding::all() {
        for (what, inst) in variants(encoding) {
            let cells = cores.map(|core| cell(&core, &inst));
            text.push_str(&row(&format!("{encoding}{what}"), &cells));
        }
    }
    text
}

fn row(name: &str, cells: &[String; 3]) -> String {
    let line = format!("{name:56}{:28}{:28}{}", cells[0], cells[1], cells[2]);
    format!("{}\n", line.trim_end())
}

/// The encoding plain, and with what the tables tell apart.
fn variants(encoding: Encoding) -> Vec<(&'static str, Inst)> {
    let plain = Inst {
        s: false,
        imm: if is_list(encoding.class()) { 6 } else { 1 },
        t: 1,
        ..Inst::new(encoding)
    };
    let plain = Inst {
        s: Inst::new(encoding).s,
        ..plain
    };
    let sets = |inst: Inst| {
        Inst { s: true, ..inst }
            .flags()
            .writes
            .intersects(Flags::NZCV)
    };
    let shifted = Inst {
        shift: ShiftType::LSR,
        amount: 8,
        ..plain
    };
    let constant = Inst {
        imm: 0x1fc0,
        ..plain
    };
    let takes_shift =
        is_arithmetic(encoding.class()) && encoding.size() == 4 && has_register_operand(encoding);
    let takes_constant = Core::cortex_m33().line(&constant) != Core::cortex_m33().line(&plain);
    let to_pc = Inst {
        d: 15,
        t: 15,
        imm: if is_list(encoding.class()) { 0x8002 } else { 1 },
        ..plain
    };
    let writes_pc = |inst: &Inst| inst.defs().contains(RegSet::core(15));
    let mut all = vec![("", plain)];
    let mut add = |applies: bool, what, inst| {
        if applies {
            all.push((what, inst))
        }
    };
    add(takes_shift && !plain.s, ", shifted", shifted);
    add(
        takes_shift && sets(plain),
        ", shifted, flags",
        Inst { s: true, ..shifted },
    );
    add(takes_constant && !plain.s, ", shifted constant", constant);
    add(
        takes_constant && sets(plain),
        ", shifted constant, flags",
        Inst {
            s: true,
            ..constant
        },
    );
    add(
        !writes_pc(&plain) && encoding.it_rule() == ItRule::LastIfPc,
        ", to PC",
        to_pc,
    );
    all
}

fn is_list(class: Class) -> bool {
    matches!(class, Class::LoadMultiple | Class::StoreMultiple)
}

fn has_register_operand(encoding: Encoding) -> bool {
    encoding.op().identifier().ends_with("_register") && encoding.op() != Op::MOV_register
}

fn is_arithmetic(class: Class) -> bool {
    matches!(class, Class::Alu | Class::Move)
}

fn cell(core: &Core, inst: &Inst) -> String {
    if !inst.encoding.exists_in(core.arch) {
        return "-".to_string();
    }
    let line = core.line(inst);
    let (refill, evidence) = refill(core, inst);
    let sure = match line.evidence.max(evidence) {
        Evidence::Exact => "!",
        Evidence::Rule => "",
        Evidence::Estimate => "*",
    };
    format!(
        "{}{refill}{}{sure}",
        cycles(core, inst, &line),
        about(&line, inst)
    )
}

fn cycles(core: &Core, inst: &Inst, line: &Line) -> String {
    let writes_pc = inst.defs().contains(RegSet::core(15));
    let own = match (line.cycles, line.each) {
        (0, 1) => "N".to_string(),
        (cycles, 0) => cycles.to_string(),
        (cycles, each) => format!(
            "{cycles}+{}N",
            if each == 1 {
                String::new()
            } else {
                each.to_string()
            }
        ),
    };
    match inst.class() {
        Class::Divide => {
            let most =
                line.cycles + core.divide.start.cycles + 31 / core.divide.bits_per_cycle.cycles;
            format!("{own}..{most}")
        }
        _ if writes_pc && own == "0" => String::new(),
        _ if writes_pc => format!("{own}+"),
        _ => own,
    }
}

/// What a branch adds, and how sure that is.
fn refill(core: &Core, inst: &Inst) -> (String, Evidence) {
    if !inst.defs().contains(RegSet::core(15)) {
        return (String::new(), Evidence::Exact);
    }
    let branches = &core.branches;
    let loads = matches!(
        inst.class(),
        Class::Load | Class::LoadMultiple | Class::TableBranch
    );
    let from_load = if loads {
        branches.from_load
    } else {
        branches.taken
    };
    let taken = branches.taken.cycles + if loads { from_load.cycles } else { 0 };
    let may_not = inst.is_conditional()
        || inst.class() == Class::CompareBranch
        || inst.class() == Class::Branch;
    let not_taken = if may_not {
        format!("/{}", branches.not_taken.cycles)
    } else {
        String::new()
    };
    (
        format!("{taken}{not_taken}"),
        branches.taken.evidence.max(from_load.evidence),
    )
}

fn about(line: &Line, inst: &Inst) -> String {
    use whippen_isa::timing::Takers;
    let results = inst.defs().without(RegSet::core(15)).core_bits() != 0;
    let late = match line.late_for {
        late if late.is_empty() || !results => "",
        Takers::ADDRESS => " late in addresses",
        late if late.without(Takers::ACCUMULATOR) == late => " late but sums",
        _ => " late",
    };
    let float = match (line.float_hold, line.float_delay) {
        (0, _) => String::new(),
        (hold, delay) => format!(" unit {hold}+{delay}"),
    };
    format!("{late}{float}")
}
