//! The publications that can be computed again, and the number of their tables' rows and sheets.
#![allow(clippy::print_stdout)]

use apsides_pipeline::Error;
use apsides_publications::{list, parts};

fn main() -> Result<(), Error> {
    let mut rows = 0;
    for (name, title) in list() {
        let parts = parts(name)?;
        println!("{name}: {title} ({parts} parts)");
        rows += parts;
    }
    // Six publications; the tables on lunar landings have seven and five rows, and five sheets stand beside them.
    assert_eq!(list().count(), 6);
    assert!(parts("lunar-landing")? == 17 && rows > 17);
    Ok(())
}
