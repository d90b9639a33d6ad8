//! What a frame is summed from.

use crate::made::Image;

#[test]
fn a_handler_that_does_nothing_takes_what_the_interrupt_takes() {
    let image = Image::new(&["bx lr"], &[], Vec::new()).prove();
    let image = image.unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(image.why(), "");
    println!("{}", image.certificate);
}
