//! Relocatable files: GNU's linker joins them with C, and what comes out runs.

use whippen_compiler::image::relocatable;
use whippen_isa::Arch;

use crate::program::{places, probe};
use crate::tools::{Folder, WHIPPEN};

const MAIN: &str = "
extern int probe_state[2];
void probe_tick(void);
int sum;
void reset(void) {
    probe_tick();
    probe_tick();
    sum = probe_state[1];
    __asm__ volatile (\"movs r0, #0x18\\n ldr r1, =0x20026\\n bkpt #0xab\" ::: \"r0\", \"r1\");
    for (;;) {}
}
__attribute__((section(\".vectors\"), used)) void *vectors[] = {(void *)0x20040000, (void *)reset};
";

#[test]
fn the_gnu_linker_joins_it_with_c() {
    for (arch, core) in [
        (Arch::V8M, "cortex-m33"),
        (Arch::V7EM, "cortex-m4"),
        (Arch::V6M, "cortex-m0plus"),
    ] {
        let folder = Folder::new();
        folder.write(
            "probe.o",
            relocatable(&probe(arch), arch, &places(), &[]).expect("fits"),
        );
        folder.write("main.c", MAIN);
        let cpu = format!("-mcpu={core}");
        let float = if arch == Arch::V6M {
            "-mfloat-abi=soft"
        } else {
            "-mfloat-abi=hard"
        };
        let flags = [
            &cpu,
            float,
            "-O1",
            "-g",
            "-nostdlib",
            "-Wl,--fatal-warnings,-e,reset",
            "-Wl,-Tdata=0x20000000",
        ];
        let place = [
            "-Wl,--section-start=.vectors=0x10000000",
            "-Wl,-Ttext=0x10001000",
            "-Wl,-Tbss=0x20000100",
        ];
        let mut args: Vec<&str> = flags.iter().map(|flag| &**flag).collect();
        args.extend(place);
        args.extend(["main.c", "probe.o", "-o", "out.elf"]);
        if folder.run("arm-none-eabi-gcc", &args).is_none() {
            return;
        }
        let nm = folder.run("arm-none-eabi-nm", &["out.elf"]).expect("there");
        let at = nm
            .lines()
            .find(|line| line.ends_with(" sum"))
            .expect("is there");
        let read = format!("0x{}:4", &at[..8]);
        let args = [
            "emulate",
            "out.elf",
            "--core",
            core,
            "--max-cycles",
            "10000",
            "--read",
            &read,
            "--json",
        ];
        let told = folder.run(WHIPPEN, &args).expect("is built");
        // (4 + 3 + 3) * 5
        assert!(told.contains("32000000"), "{core}: {told}");
        let lines = folder
            .run("arm-none-eabi-objdump", &["--dwarf=decodedline", "out.elf"])
            .expect("there");
        assert!(lines.contains("probe.whip"), "{lines}");
    }
}

#[test]
fn binutils_read_it_without_a_complaint() {
    let folder = Folder::new();
    folder.write(
        "probe.o",
        relocatable(&probe(Arch::V8M), Arch::V8M, &places(), &[]).expect("fits"),
    );
    let Some(told) = folder.run("arm-none-eabi-readelf", &["-a", "-W", "probe.o"]) else {
        return;
    };
    assert!(!told.to_lowercase().contains("warning"), "{told}");
    for wanted in [
        "REL (Relocatable file)",
        "R_ARM_THM_CALL",
        "R_ARM_ABS32",
        ".rel.debug_line",
        "$t",
        "$d",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
    // The call goes to another section of the same file, and the disassembler finds its name there.
    let code = folder
        .run("arm-none-eabi-objdump", &["-dr", "probe.o"])
        .expect("there");
    assert!(code.contains("probe_scale"), "{code}");
}
