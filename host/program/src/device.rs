//! The choice of the executor.

use clap::ValueEnum;
use restir::Error;
use restir::buffers::SceneBuffers;
use restir::exec::{CpuExecutor, Description, Executor, Flavour};
use restir::render::Render;

use super::parse::{natural, require};
use super::{console, environment, progress::patiently};

/// More are a slip, and each has its own stack.
const MAX_THREADS: usize = 1024;

/// Where to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// A hardware GPU whose self-check is exact, else the CPU.
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU.
    Gpu,
}

/// Which form of the kernels to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FlavourName {
    /// Bit-identical on every exact device.
    Exact,
    /// The device's own division, roots and functions: faster, statistically equal. GPU only.
    Fast,
}

/// Which executor a command runs on.
#[derive(Debug, clap::Args)]
pub struct DeviceArguments {
    /// Where to render.
    #[arg(long, value_enum, default_value_t = Kind::Auto)]
    device: Kind,
    /// Part of the name of the GPU adapter to use; implies --device gpu.
    #[arg(long)]
    adapter: Option<String>,
    /// Form of the kernels. Exact is there on the CPU and on Vulkan.
    #[arg(long, value_enum, default_value_t = FlavourName::Exact)]
    flavour: FlavourName,
    /// Threads of the CPU, 1 to 1024; one a core if not given, or as many as RAYON_NUM_THREADS says.
    #[arg(long, value_parser = natural::<usize>, allow_hyphen_values = true)]
    threads: Option<usize>,
}

/// How the results compare with the CPU's, which has no self-check of its own.
pub fn parity(description: &Description) -> String {
    description.parity.map_or_else(|| "exact".to_owned(), |parity| parity.to_string())
}

/// Refuses what the environment asks for and no machine can give. Rayon's own pool is also as large as these variables say.
pub(super) fn check_environment() -> Result<(), Error> {
    environment::threads().try_for_each(|(name, threads)| {
        let problem = format_args!("{name} is {threads}; give at most {MAX_THREADS}, or unset it");
        require(threads <= MAX_THREADS, problem)
    })
}

/// Opens the executor that the arguments ask for and says on standard error which it is and why. A GPU is compared with the host by all
/// kernels.
///
/// # Errors
/// If there is no such executor, or it cannot have the flavour.
pub fn open(arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
    open_any(arguments, None)
}

/// As [`open`], for one render: a GPU is compared with the host by the kernels that it takes.
///
/// # Errors
/// As of [`open`].
pub(super) fn open_for(
    arguments: &DeviceArguments,
    scene: &SceneBuffers,
    render: &Render,
) -> Result<Box<dyn Executor>, Error> {
    open_any(arguments, Some((scene, render)))
}

/// A scene and a render of it.
type Subject<'a> = Option<(&'a SceneBuffers, &'a Render)>;

fn open_any(arguments: &DeviceArguments, subject: Subject<'_>) -> Result<Box<dyn Executor>, Error> {
    let threads = arguments.threads.unwrap_or(1);
    let problem = format_args!("--threads {threads} is out of range; give 1 to {MAX_THREADS}");
    require((1..=MAX_THREADS).contains(&threads), problem)?;
    patiently("opening the device", || match (arguments.device, &arguments.adapter) {
        (Kind::Cpu, Some(_)) => Err(Error::Setting("--adapter needs a GPU; leave out --device cpu".to_owned())),
        (Kind::Cpu, None) => open_cpu(arguments, "as asked"),
        (Kind::Gpu, _) | (Kind::Auto, Some(_)) => gpu::open(arguments, subject),
        (Kind::Auto, None) => gpu::open_best(arguments, subject),
    })
}

fn open_cpu(arguments: &DeviceArguments, why: &str) -> Result<Box<dyn Executor>, Error> {
    let problem = format_args!(
        "the flavour fast needs a GPU, and the CPU was chosen ({why}); use --flavour exact or --device gpu"
    );
    require(arguments.flavour == FlavourName::Exact, problem)?;
    let asked = || environment::threads().next().map(|(_, threads)| threads).filter(|&threads| threads > 0);
    let threads = arguments.threads.or_else(asked);
    let executor = threads.map_or_else(CpuExecutor::new, CpuExecutor::with_threads)?;
    console::note(&format!("device: CPU ({why})"));
    Ok(Box::new(executor))
}

impl From<FlavourName> for Flavour {
    fn from(name: FlavourName) -> Self {
        match name {
            FlavourName::Exact => Flavour::Exact,
            FlavourName::Fast => Flavour::Fast,
        }
    }
}

#[cfg(feature = "gpu")]
mod gpu {
    use super::{DeviceArguments, Error, Executor, FlavourName, Subject, console, environment, open_cpu, parity};
    use restir::exec::Parity;
    use restir::exec::gpu::{AdapterInfo, GpuExecutor, adapters};
    use std::time::{Duration, Instant};

    /// How long the console is silent while kernels are compiled.
    const A_WHILE: Duration = Duration::from_secs(1);

    fn opened(arguments: &DeviceArguments, adapter: Option<&str>, subject: Subject<'_>) -> Result<GpuExecutor, Error> {
        let pipelines = environment::cache().map(|folder| folder.join("pipelines"));
        let builder = GpuExecutor::builder()
            .adapter(adapter)
            .flavour(arguments.flavour.into())
            .shaders(environment::shaders())
            .keep_pipelines_in(pipelines.as_deref());
        match subject {
            Some((scene, render)) => builder.for_render(scene, render).open(),
            None => builder.open(),
        }
    }

    pub(super) fn open(arguments: &DeviceArguments, subject: Subject<'_>) -> Result<Box<dyn Executor>, Error> {
        let executor = opened(arguments, arguments.adapter.as_deref(), subject)?;
        Ok(chosen(executor, "as asked"))
    }

    /// The first hardware GPU that is exact (for the flavour fast: the first), else the CPU.
    pub(super) fn open_best(arguments: &DeviceArguments, subject: Subject<'_>) -> Result<Box<dyn Executor>, Error> {
        let adapters = adapters();
        let mut refused = Vec::new();
        for adapter in adapters.iter().filter(|adapter| !adapter.software) {
            match opened(arguments, Some(&adapter.name), subject) {
                Ok(executor) if is_good(&executor, arguments.flavour) => {
                    return Ok(chosen(executor, "chosen automatically"));
                }
                Ok(executor) => {
                    let parity = parity(&executor.describe());
                    refused.push(format!("the self-check of {} is {parity}", adapter.name));
                }
                Err(error) => refused.push(error.to_string()),
            }
        }
        open_cpu(arguments, &why_not(&adapters, &refused))
    }

    fn is_good(executor: &GpuExecutor, flavour: FlavourName) -> bool {
        flavour == FlavourName::Fast || executor.describe().parity == Some(Parity::Exact)
    }

    fn chosen(executor: GpuExecutor, why: &str) -> Box<dyn Executor> {
        let description = executor.describe();
        let parity = parity(&description);
        let adapter = description.adapter.unwrap_or_else(|| "GPU".to_owned());
        console::note(&format!("device: {adapter}, {}, self-check {parity} ({why})", executor.loading()));
        let mut begun = Instant::now();
        let executor = executor.observe_pipelines(move |done, total| {
            // a line for each would be many where they come from a cache
            if begun.elapsed() >= A_WHILE {
                console::note(&format!("kernels: {done} of {total} are compiled"));
                begun = Instant::now();
            }
        });
        Box::new(executor)
    }

    fn why_not(adapters: &[AdapterInfo], refused: &[String]) -> String {
        if adapters.is_empty() {
            return "no GPU adapter or driver was found".to_owned();
        }
        if refused.is_empty() {
            let names: Vec<&str> = adapters.iter().map(|adapter| adapter.name.as_str()).collect();
            return format!("only software adapters were found: {}", names.join(", "));
        }
        refused.join("; ")
    }
}

#[cfg(not(feature = "gpu"))]
mod gpu {
    use super::{DeviceArguments, Error, Executor, Subject, open_cpu};

    const WITHOUT_GPU: &str = "this program was built without GPU support; --device cpu renders without an adapter";

    pub(super) fn open(_arguments: &DeviceArguments, _subject: Subject<'_>) -> Result<Box<dyn Executor>, Error> {
        Err(Error::Setting(WITHOUT_GPU.to_owned()))
    }

    pub(super) fn open_best(arguments: &DeviceArguments, _subject: Subject<'_>) -> Result<Box<dyn Executor>, Error> {
        open_cpu(arguments, WITHOUT_GPU)
    }
}
