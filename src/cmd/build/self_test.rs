//! `--self-test`: an image that counts the cycles of its own core.

use whippen_compiler::image::{executable, uf2};
use whippen_runtime::self_test::{self_test_image, timing_of};

use super::Args;
use super::files::{Files, put};
use crate::cmd::progress;
use crate::exit::{Failure, Outcome};
use crate::say::say;

impl Files<'_> {
    pub(super) fn write_self_test(&self, args: &Args) -> Outcome {
        let setup = self.setup;
        let ([compiled], true) = (&setup.instruments[..], args.output.is_image()) else {
            let why = "--self-test makes an image, .elf or .uf2, with the key of one instrument";
            return Err(Failure::Usage(why.to_string()));
        };
        setup.check_asks_for_no_firmware()?;
        setup.check_supported()?;
        let family = args.output.family(&setup.board)?;
        let instruments = setup.image_instruments()?;
        let (board, name) = (&setup.board, &compiled.model.name);
        let image = progress::during("the cycles of a key's ticks", || {
            self_test_image(board, &timing_of(board), name, &instruments[0])
        });
        let image = image.map_err(Failure::Usage)?;
        self.listings(args, &image, board)?;
        let path = &args.output.path;
        let file = match family {
            Some(family) => uf2(&image, family, None),
            None => executable(&image, &[], None),
        };
        put(path, &file)?;
        say!(
            "{}: a self-test of {} with a key of {name}; it tells what it finds on the serial port, at 115200 baud",
            path.display(),
            board.name
        );
        Ok(())
    }
}
