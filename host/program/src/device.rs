//! The choice of the executor.

use clap::ValueEnum;
use restir::Error;
use restir::exec::{CpuExecutor, Description, Executor, Flavour};

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

/// Opens the executor that the arguments ask for and says on standard error which it is and why.
///
/// # Errors
/// If there is no such executor, or it cannot have the flavour.
pub fn open(arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
    let threads = arguments.threads.unwrap_or(1);
    let problem = format_args!("--threads {threads} is out of range; give 1 to {MAX_THREADS}");
    require((1..=MAX_THREADS).contains(&threads), problem)?;
    patiently("opening the device", || match (arguments.device, &arguments.adapter) {
        (Kind::Cpu, Some(_)) => Err(Error::Setting("--adapter needs a GPU; leave out --device cpu".to_owned())),
        (Kind::Cpu, None) => open_cpu(arguments, "as asked"),
        (Kind::Gpu, _) | (Kind::Auto, Some(_)) => gpu::open(arguments),
        (Kind::Auto, None) => gpu::open_best(arguments),
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
    use super::{DeviceArguments, Error, Executor, FlavourName, console, environment, open_cpu, parity};
    use restir::exec::Parity;
    use restir::exec::gpu::{AdapterInfo, GpuExecutor, adapters};
    use std::time::{Duration, Instant};

    /// How long the console is silent while kernels are compiled.
    const A_WHILE: Duration = Duration::from_secs(1);

    pub(super) fn open(arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
        let flavour = arguments.flavour.into();
        let executor = GpuExecutor::builder()
            .adapter(arguments.adapter.as_deref())
            .flavour(flavour)
            .shaders(environment::shaders())
            .open()?;
        Ok(chosen(executor, "as asked"))
    }

    /// The first hardware GPU that is exact (for the flavour fast: the first), else the CPU.
    pub(super) fn open_best(arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
        let adapters = adapters();
        let mut refused = Vec::new();
        for adapter in adapters.iter().filter(|adapter| !adapter.software) {
            match GpuExecutor::builder()
                .adapter(adapter.name.as_str())
                .flavour(arguments.flavour.into())
                .shaders(environment::shaders())
                .open()
            {
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
        let executor = match environment::cache() {
            Some(folder) => executor.keep_pipelines_in(&folder.join("pipelines")),
            None => executor,
        };
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
    use super::{DeviceArguments, Error, Executor, open_cpu};

    const WITHOUT_GPU: &str = "this program was built without GPU support; --device cpu renders without an adapter";

    pub(super) fn open(_arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
        Err(Error::Setting(WITHOUT_GPU.to_owned()))
    }

    pub(super) fn open_best(arguments: &DeviceArguments) -> Result<Box<dyn Executor>, Error> {
        open_cpu(arguments, WITHOUT_GPU)
    }
}
