//! `cargo lab furnace`: how much light white surfaces return, with and without what single scattering loses.

use clap::Args;
use restir_tests::furnace::{BOUNDS, Cell, glass, opaque, tables, walked, walked_tables};

use crate::{Error, report};

/// Options of `cargo lab furnace`.
#[derive(Args)]
pub struct Options {
    /// Samples a batch; a cell has 16 batches.
    #[arg(long, default_value_t = 16_384)]
    samples: u32,
    /// Replace docs/furnace.md.
    #[arg(long)]
    write: bool,
}

/// Measures, prints the tables and writes them where asked.
///
/// # Errors
/// [`Error::Failed`] if a surface is off, [`Error::Host`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let samples = options.samples;
    let cells = opaque(true, samples);
    let error = cells.iter().map(|cell| cell.returned[1]).fold(0.0, f64::max);
    let [least, most] = range(&cells);
    let (glass, single) = (glass(samples), opaque(false, samples));
    let [least_glass, least_single] = [&glass, &single].map(|cells| range(cells)[0]);
    let text = format!(
        "# White surfaces in a furnace\n\nLight of one comes from everywhere; the tables have the share that comes back to a viewer at \
         the cosine above the column: the mean weight of {} samples of the scattering function, with a standard error of at most \
         {error:.1e}. Opaque surfaces have to return {} to {} of it, within three standard errors; they return {least:.4} to {most:.4}. \
         Single scattering (`multiscatter=off`) returns as little as {least_single:.3}, and rough glass, whose losses do not come back, \
         as little as {least_glass:.3}. Made by `cargo lab furnace --write`.\n\n## Opaque surfaces\n{}\n## Opaque surfaces, single \
         scattering\n{}\n## Glass: what it reflects and lets through\n{}{}",
        16 * samples,
        BOUNDS[0],
        BOUNDS[1],
        tables(&cells),
        tables(&single),
        tables(&glass),
        walked_tables(&walked()),
    );
    report::publish("furnace", &text, options.write)?;
    let name = |cell: &Cell| format!("{:?} at {}: {:?}", cell.material, cell.cos, cell.returned);
    report::judge("white surfaces", cells.iter().filter(|cell| cell.is_off()).map(name))
}

fn range(cells: &[Cell]) -> [f64; 2] {
    let of = |f: fn(f64, f64) -> f64| cells.iter().map(|cell| cell.returned[0]).reduce(f).unwrap_or(f64::NAN);
    [of(f64::min), of(f64::max)]
}
