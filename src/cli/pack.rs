//! `turbid pack`.

use super::terminal::say;
use super::{PackArguments, load};
use crate::error::{Error, Result};
use crate::output::write_bytes;
use crate::packing::positions;

pub(super) fn pack(arguments: &PackArguments) -> Result<()> {
    let setup = load(&arguments.case.case, &arguments.case.changes)?;
    let out = &arguments.out;
    let mut kinds: Vec<u64> = setup.particles.iter().map(|p| p.template).collect();
    kinds.sort_unstable();
    kinds.dedup();
    if kinds.len() > 1 {
        return Err(Error::Input(format!(
            "{}: the particles are of {} shapes or sizes, but a positions file holds those of one [[particles]] section, all \
             alike; pack them one by one, e.g. with --set particles.1.count=0",
            arguments.case.case.display(),
            kinds.len()
        )));
    }
    write_bytes(out, positions::format(&setup.particles, &setup.frames).as_bytes())?;
    let (count, fraction) = (setup.particles.len(), setup.scales.volume_fraction);
    say(&format!(
        "{count} particles, volume fraction {fraction:.6}, written to {}",
        out.display()
    ));
    Ok(())
}
