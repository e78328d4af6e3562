//! `cargo xtask shader cost`: registers, spills and waves of every kernel, told by a driver's compiler.
//!
//! Mesa's RADV compiles for an AMD GPU that need not be there. Its figures are exact for that compiler, and they are not times. They are the
//! ceilings of CI: a change that takes more registers is seen where it is made.

mod driver;
mod report;

use std::path::{Path, PathBuf};

use clap::Args;
use restir_kernels::KernelDesc;
use restir_shared::layout::{
    FEATURE_EMISSIVE, FEATURE_ENVIRONMENT, FEATURE_GLOSSY, FEATURE_LIGHT_TABLE, FEATURE_MULTISCATTER, FEATURE_SHADING,
    FEATURE_SPECULAR, FEATURE_TEXTURES, FEATURES_ALL,
};

use super::{Entry, Flavour, workspace::Workspace};
use crate::Error;
use driver::{Cost, Driver};
use report::Row;

/// Where Debian and Fedora have RADV's manifest.
const RADV: [&str; 2] = ["/usr/share/vulkan/icd.d/radeon_icd.x86_64.json", "/usr/share/vulkan/icd.d/radeon_icd.json"];
/// The GPU that RADV compiles for: an RX 6800, of the family RDNA 2.
const FAMILY: &str = "navi21";

/// The features to which kernels are specialised: of `cornell`; of a scene with an environment, textures and glossy surfaces; of anything.
const FEATURE_SETS: [(&str, u32); 3] = [
    ("diffuse", FEATURE_LIGHT_TABLE | FEATURE_EMISSIVE),
    (
        "textured",
        FEATURE_LIGHT_TABLE
            | FEATURE_EMISSIVE
            | FEATURE_ENVIRONMENT
            | FEATURE_TEXTURES
            | FEATURE_SHADING
            | FEATURE_GLOSSY
            | FEATURE_MULTISCATTER
            | FEATURE_SPECULAR,
    ),
    ("all", FEATURES_ALL),
];
/// How many of these sets a check takes.
const CHECKED_SETS: usize = 2;
/// The set of kernels that ask no scene.
const NO_SET: &str = "-";

/// Options of `cargo xtask shader cost`.
#[derive(Debug, Args)]
pub struct Options {
    /// Kernels by name; all if none is given.
    kernels: Vec<String>,
    /// Fail if a kernel takes more than docs/shader-cost.md says: exact modules, without the features `all`.
    #[arg(long, conflicts_with = "write")]
    check: bool,
    /// Write docs/shader-cost.md.
    #[arg(long)]
    write: bool,
    /// Ask the driver of this machine's GPU in place of RADV.
    #[arg(long, conflicts_with_all = ["check", "write"])]
    gpu: bool,
}

/// Runs the subcommand.
pub(super) fn run(workspace: &Workspace, options: &Options) -> Result<(), Error> {
    let kernels = chosen(&options.kernels)?;
    if !options.gpu && !choose_radv() {
        return missing("there is no RADV", "install Mesa's Vulkan drivers (mesa-vulkan-drivers)");
    }
    let Some(driver) = Driver::open()? else {
        return missing("no driver here tells what kernels take", "install the Vulkan loader (libvulkan1)");
    };
    let of_check = |set, flavour| !options.check || (set < CHECKED_SETS && flavour == Flavour::Exact);
    let rows = rows(workspace, &driver, &kernels, of_check)?;
    let report = workspace.root().join("docs/shader-cost.md");
    if options.check {
        return check(&report, &driver.name, &rows);
    }
    let mut text = report::text(!options.gpu, &driver.name, &rows);
    print!("{text}");
    if options.write {
        // what stands below the table was not made by this command
        let committed = std::fs::read_to_string(&report).unwrap_or_default();
        text.extend(committed.find("\n## ").map(|below| &committed[below..]));
        std::fs::write(&report, text).map_err(Error::io("write", &report))?;
    }
    Ok(())
}

/// What exact kernels of these names take in a scene as `cornell`, told by the driver of this machine's GPU, as a table below its name;
/// nothing where no driver tells.
///
/// # Errors
/// If there is no such kernel, or the driver cannot compile it.
pub fn of_gpu(names: &[&str]) -> Result<Option<String>, Error> {
    let kernels = chosen(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())?;
    let Some(driver) = Driver::open()? else { return Ok(None) };
    let rows = rows(&Workspace::current(), &driver, &kernels, |set, flavour| set == 0 && flavour == Flavour::Exact)?;
    Ok(Some(format!("Driver: {}.\n\n{}", driver.name, report::table(&rows))))
}

/// A row of each build that is wanted, by the index of its set of features and its flavour.
fn rows(
    workspace: &Workspace,
    driver: &Driver,
    kernels: &[&'static KernelDesc],
    is_wanted: impl Fn(usize, Flavour) -> bool,
) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    for kernel in kernels {
        let has_features = kernel.constants.iter().any(|constant| constant.name == "features");
        let sets = if has_features { FEATURE_SETS.len() } else { 1 };
        let builds = (0..sets).flat_map(|set| [Flavour::Exact, Flavour::Fast].map(|flavour| (set, flavour)));
        for (set, flavour) in builds.filter(|(set, flavour)| is_wanted(*set, *flavour)) {
            let (set, features) = if has_features { FEATURE_SETS[set] } else { (NO_SET, 0) };
            let cost = cost(workspace, driver, kernel, flavour, features)?;
            rows.push(Row { kernel: kernel.name.to_owned(), set: set.to_owned(), flavour, cost });
        }
    }
    Ok(rows)
}

/// The kernels of these names.
fn chosen(names: &[String]) -> Result<Vec<&'static KernelDesc>, Error> {
    let all = restir_kernels::all();
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|kernel| kernel.name != **name)) {
        let known = all.iter().map(|kernel| kernel.name).collect::<Vec<_>>().join(", ");
        return Err(Error::Environment(format!("no kernel `{unknown}`: the kernels are {known}")));
    }
    Ok(all.iter().copied().filter(|kernel| names.is_empty() || names.iter().any(|name| name == kernel.name)).collect())
}

/// Makes the Vulkan loader take RADV, for a GPU that need not be there; false if it is not installed.
fn choose_radv() -> bool {
    let Some(manifest) = RADV.iter().find(|path| Path::new(path).is_file()) else { return false };
    // SAFETY: no other thread runs in this program yet
    unsafe {
        std::env::set_var("VK_DRIVER_FILES", manifest);
        // the loader's older name of it
        std::env::set_var("VK_ICD_FILENAMES", manifest);
        std::env::set_var("RADV_FORCE_FAMILY", FAMILY);
    }
    true
}

/// Says what is left out for want of something, which is no failure.
fn missing(what: &str, remedy: &str) -> Result<(), Error> {
    println!("left out: {what}, so what kernels take of a GPU is not known; {remedy}");
    Ok(())
}

fn cost(
    workspace: &Workspace,
    driver: &Driver,
    kernel: &KernelDesc,
    flavour: Flavour,
    features: u32,
) -> Result<Cost, Error> {
    let path: PathBuf = workspace.spirv().join(Entry::new(flavour, kernel.name).path());
    let bytes = std::fs::read(&path).map_err(Error::io("read", &path))?;
    let words: Vec<u32> =
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    let value = |constant: &restir_kernels::Constant| match constant.name {
        "features" => features,
        // one sample an invocation, as of images of a million pixels
        "block" => 0,
        _ => constant.default,
    };
    let constants: Vec<(u32, u32)> = kernel.constants.iter().map(|constant| (constant.id, value(constant))).collect();
    driver.cost(kernel, &words, &constants)
}

/// Compares with the committed report, which is of one version of a driver.
fn check(path: &Path, driver: &str, rows: &[Row]) -> Result<(), Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    let committed = report::parse(&text);
    if committed.driver != driver {
        let why = format!("{} is of {}, and here is {driver}", path.display(), committed.driver);
        return missing(&why, "`cargo xtask shader cost --write` makes it again");
    }
    let findings: Vec<String> = rows.iter().filter_map(|row| row.finding(&committed)).collect();
    if findings.is_empty() {
        println!("{} builds of kernels take no more than {} says", rows.len(), path.display());
        return Ok(());
    }
    let remedy = "mend them, or `cargo xtask shader cost --write` accepts them";
    Err(Error::Failed(format!("{}\n{remedy}", findings.join("\n"))))
}
