//! The parity suite can fail: builds that break the contract give other words than the host.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Flavour, GpuExecutor, Parity};
use restir_host::render::Render;
use restir_host::scene::builtin;
use restir_host::technique::path::PathSettings;
use restir_host::{Error, Shaders};
use restir_kernels::check::crossing_check;
use restir_kernels::check::self_check::{self, Operands, boundary_operands};
use restir_kernels::path::path;
use restir_kernels::{Case, KernelDesc};
use restir_tests::cases;
use restir_tests::device::{self, Adapter, is_llvmpipe, label};
use restir_tests::liveness::{
    Change, build, forget_shared, fuse, fuse_in_double, poison_shared, reassociate, undecorate,
};
use restir_tests::parity::{compare, run};
use restir_tests::suite::{Trial, ensure};
use std::collections::BTreeMap;

/// The words of a probe's results, in order.
const FIELDS: &str = "fused cancelled split scaled plus_zero product_error sum_error \
                      div recip sqrt rsqrt exp ln sin cos atan2";

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![Trial::test("native: a fused sum differs on the operands", native_fused).first()];
    trials.extend(device::trials(on));
    trials
}

fn on(adapter: &Adapter) -> Vec<Trial> {
    let name = adapter.name().to_owned();
    vec![
        adapter.trial("the check before a render sees what its kernels do wrong", move |_| before_a_render(&name)),
        adapter.trial("exact through naga is seen", through_naga),
        adapter.trial("undecorated modules are seen", undecorated),
        adapter.trial("fused products are seen", fused),
        adapter.trial("reassociated sums are seen", reassociated),
        adapter.trial("unchanged modules from a folder are exact", unchanged),
        adapter.trial("what memory of the workgroup held before does not matter", poisoned),
        adapter.trial("nodes and crossings that are forgotten are seen", forgotten),
    ]
}

#[expect(clippy::disallowed_methods, reason = "the fused form is what is shown to differ")]
fn native_fused() -> Result<(), Failed> {
    let operands = boundary_operands();
    let differs = |o: &&Operands| o.a.mul_add(o.b, o.c).to_bits() != (o.a * o.b + o.c).to_bits();
    let differing = operands.iter().filter(differs).count();
    println!("native: a b + c fused differs on {differing} of {} operands", operands.len());
    ensure(differing > 0, || "no operands discriminate".to_owned())
}

/// Differing words of the probes' fields and of path; `None` for a kernel that the adapter rejects.
struct Findings {
    fields: Option<BTreeMap<&'static str, usize>>,
    path: Option<usize>,
}

impl Findings {
    /// Runs all cases, and prints what is found.
    fn of(executor: &mut GpuExecutor, what: &str) -> Result<Self, Failed> {
        let fields = unless_rejected(differing_fields(executor))?;
        let path = unless_rejected(differing_words(executor, &path::DESC))?;
        println!(
            "{}, {what}: differing words, unless rejected, of path {path:?}, of self_check {fields:?}",
            label(executor)
        );
        Ok(Self { fields, path })
    }

    /// Whether words of the field differ; of a kernel that the adapter rejects there are none.
    fn differs(&self, name: &str) -> bool {
        self.fields.as_ref().is_some_and(|fields| fields[name] > 0)
    }

    fn differs_anywhere(&self) -> bool {
        self.fields.iter().flatten().any(|(_, &words)| words > 0)
    }

    /// Words of both kernels differ, and those of the named fields.
    fn ensure_seen(&self, names: &[&str]) -> Result<(), Failed> {
        for name in names {
            ensure(self.differs(name), || format!("{name} does not discriminate"))?;
        }
        ensure(self.differs_anywhere(), || "no word of self_check differs".to_owned())?;
        ensure(self.path.is_some_and(|words| words > 0), || "no word of path differs".to_owned())
    }

    /// As [`Self::ensure_seen`] on llvmpipe, which contracts and folds what it may; other drivers need not.
    fn ensure_seen_on_llvmpipe(&self, executor: &GpuExecutor) -> Result<(), Failed> {
        let seen = self.ensure_seen(&[]);
        if is_llvmpipe(executor) {
            return seen;
        }
        if let Err(reason) = seen {
            println!("inert here: {}", reason.message().unwrap_or_default());
        }
        Ok(())
    }
}

/// A module that the adapter rejects passes for neither exact nor different; it is printed.
fn unless_rejected<T>(result: Result<T, Error>) -> Result<Option<T>, Failed> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error @ Error::Kernel { .. }) => {
            println!("{error}");
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

fn differing_fields(executor: &mut dyn Executor) -> Result<BTreeMap<&'static str, usize>, Error> {
    let mut differing = BTreeMap::new();
    for case in cases::all().iter().filter(|case| case.kernel.name == self_check::DESC.name) {
        let host = run(&mut CpuExecutor::inline(), case)?.concat();
        let device = run(executor, case)?.concat();
        for (name, (host, device)) in FIELDS.split(' ').cycle().zip(host.into_iter().zip(device)) {
            let both_nan = f32::from_bits(host).is_nan() && f32::from_bits(device).is_nan();
            *differing.entry(name).or_default() += usize::from(host != device && !both_nan);
        }
    }
    Ok(differing)
}

/// Of the general variant of a kernel, which is compiled once a change.
fn differing_words(executor: &mut dyn Executor, kernel: &KernelDesc) -> Result<usize, Error> {
    let general = |case: &&Case| case.constants.iter().zip(case.kernel.constants).all(|(&v, c)| v == c.default);
    let cases = cases::all().iter().filter(|case| case.kernel.name == kernel.name).filter(general);
    cases.map(|case| Ok(compare(executor, case)?.differing)).sum()
}

/// What the committed modules give after a change, loaded as the executor loads `exact`. What differs is due to the change:
/// without it nothing may ([`unchanged`]).
fn findings(executor: &GpuExecutor, what: &str, change: Change) -> Result<Findings, Failed> {
    let folder = build(change)?;
    let shaders = Shaders::Folder(folder.path().to_owned());
    Findings::of(&mut executor.reload(Flavour::Exact, shaders), what)
}

fn through_naga(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let mut naga = executor.reload(Flavour::Exact, Shaders::Embedded).without_passthrough();
    let loading = naga.loading();
    Findings::of(&mut naga, &loading)?.ensure_seen_on_llvmpipe(executor)
}

fn undecorated(executor: &mut GpuExecutor) -> Result<(), Failed> {
    findings(executor, "without NoContraction and float controls", undecorate)?.ensure_seen_on_llvmpipe(executor)
}

/// A fused product leaves the error-free transforms right, so `product_error` says nothing here.
fn fused(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let by_fma = findings(executor, "products fused by Fma", fuse)?;
    if by_fma.differs("fused") {
        return by_fma.ensure_seen(&["fused"]);
    }
    println!("{}: Fma is inert: the driver rounds its product", label(executor));
    findings(executor, "products fused in 64 bits", fuse_in_double)?.ensure_seen(&["fused"])
}

fn reassociated(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let names = ["cancelled", "split", "scaled", "plus_zero", "product_error"];
    findings(executor, "sums and products reassociated", reassociate)?.ensure_seen(&names)
}

fn unchanged(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let found = findings(executor, "unchanged", |_| ())?;
    let is_exact = found.path == Some(0) && found.fields.is_some() && !found.differs_anywhere();
    ensure(is_exact, || "words of unchanged modules differ".to_owned())
}

/// Words that differ of a kernel with a ring, and of one with a list as well.
fn of_shared_memory(executor: &GpuExecutor, change: Change) -> Result<[usize; 2], Failed> {
    let folder = build(change)?;
    let mut changed = executor.reload(Flavour::Exact, Shaders::Folder(folder.path().to_owned()));
    let mut words = |kernel| differing_words(&mut changed, kernel);
    Ok([words(&path::DESC)?, words(&crossing_check::DESC)?])
}

fn poisoned(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let words = of_shared_memory(executor, poison_shared)?;
    ensure(words == [0; 2], || format!("{words:?} words of path and crossing_check differ"))
}

fn forgotten(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let words = of_shared_memory(executor, forget_shared)?;
    ensure(words.iter().all(|&words| words > 0), || format!("{words:?} words of path and crossing_check differ"))
}

/// The probes, which trace no rays, are right, so that the frames have to tell.
fn before_a_render(adapter: &str) -> Result<(), Failed> {
    let scene = SceneBuffers::build(&builtin::scene("cornell").ok_or("no built-in scene")?)?;
    let render = Render::new([64, 48], PathSettings::default());
    let checked = |change: Change| -> Result<Option<Parity>, Failed> {
        let folder = build(change)?;
        let builder = GpuExecutor::builder().adapter(adapter).shaders(Shaders::Folder(folder.path().to_owned()));
        Ok(builder.for_render(&scene, &render).open()?.describe().parity)
    };
    ensure(checked(|_| ())? == Some(Parity::Exact), || "unchanged modules are not exact".to_owned())?;
    let found = checked(forget_shared)?;
    ensure(matches!(found, Some(Parity::Approximate { .. })), || format!("{found:?} where nodes are forgotten"))
}
