//! Compaction and counting sort against the standard library, natively and on every adapter.

use libtest_mimic::Failed;
use restir_host::compact::{Buckets, Compaction, MAX_ITEMS, compact};
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{Buffer, FramePlan};
use restir_shared::layout::NONE;
use restir_tests::checks;
use restir_tests::device;
use restir_tests::random::SplitMix;
use restir_tests::suite::{Trial, ensure};

pub(crate) fn trials() -> Vec<Trial> {
    let mut all = checks! {
        later {
            flags_of_every_kind_and_size keys_are_sorted_stably digits_make_a_radix_sort a_wrong_order_is_seen
        }
    };
    all.extend(device::trials(|adapter| {
        vec![adapter.trial("compaction gives the host's words", |executor| on_device(executor))]
    }));
    all
}

/// Sizes around the borders of blocks and of blocks of blocks.
const SIZES: [u32; 14] = [1, 2, 63, 64, 65, 127, 4095, 4096, 4097, 4160, 12_345, 65_536, 70_000, 266_305];

/// Indices and offsets.
fn run(executor: &mut dyn Executor, words: &[u32], buckets: Buckets) -> Result<(Vec<u32>, Vec<u32>, u32), Failed> {
    let mut buffers = vec![Buffer { name: "words", words: words.len(), contents: Some(words.into()) }];
    let Compaction { passes, indices, offsets, blocks } = compact(&mut buffers, 0, words.len() as u32, buckets)?;
    let plan = FramePlan {
        buffers,
        pass_count: passes.len() as u64,
        passes: Box::new(passes.into_iter().map(Ok)),
        outputs: vec![indices, offsets],
        counts: [""; 4],
        scene: None,
    };
    let results = executor.run(plan)?;
    let [indices, offsets] = results.try_into().map_err(|_| "not two outputs")?;
    Ok((indices, offsets, blocks))
}

fn bucket(word: u32, buckets: Buckets) -> u32 {
    (word >> buckets.shift & buckets.mask).wrapping_sub(buckets.first)
}

/// What the standard library says: the items that have a bucket, sorted by it.
fn expected(words: &[u32], buckets: Buckets) -> Vec<u32> {
    let bucket = |item: &u32| bucket(words[*item as usize], buckets);
    let mut items: Vec<u32> = (0..words.len() as u32).filter(|item| bucket(item) < buckets.count).collect();
    items.sort_by_key(bucket);
    items
}

/// Compares everything that is promised: the indices, what is behind them, the total, where buckets begin.
fn compare(executor: &mut dyn Executor, words: &[u32], buckets: Buckets) -> Result<(), Failed> {
    let (indices, offsets, blocks) = run(executor, words, buckets)?;
    let expected = expected(words, buckets);
    let what = || format!("{} items, {buckets:?}", words.len());
    let kept = expected.len();
    ensure(indices[..kept] == expected, || format!("{}: another order", what()))?;
    ensure(indices[kept..words.len()].iter().all(|&i| i == NONE), || format!("{}: more than {kept} outputs", what()))?;
    let total = offsets[(buckets.count * blocks) as usize];
    ensure(total as usize == kept, || format!("{}: {total} outputs counted, {kept} expected", what()))?;
    for at in 0..buckets.count {
        let begin = expected.partition_point(|&item| bucket(words[item as usize], buckets) < at);
        let found = offsets[(at * blocks) as usize] as usize;
        ensure(found == begin, || format!("{}: bucket {at} begins at {found}, not {begin}", what()))?;
    }
    Ok(())
}

fn cpu() -> Result<CpuExecutor, Failed> {
    Ok(CpuExecutor::new()?)
}

/// Flags that are set with the given probability.
fn flags(n: u32, probability: f64, stream: u64) -> Vec<u32> {
    let mut random = SplitMix::new(stream);
    (0..n).map(|_| u32::from(random.unit() < probability)).collect()
}

/// Words below a limit.
fn keys(n: u32, limit: usize, stream: u64) -> Vec<u32> {
    let mut random = SplitMix::new(stream);
    (0..n).map(|_| random.below(limit) as u32).collect()
}

fn flags_of_every_kind_and_size() -> Result<(), Failed> {
    let mut cpu = cpu()?;
    for n in (1..200).chain(SIZES) {
        for probability in [0.0, 1.0e-3, 0.5, 1.0] {
            compare(&mut cpu, &flags(n, probability, n.into()), Buckets::FLAGS)?;
        }
        let ends: Vec<u32> = (0..n).map(|i| u32::from(i == 0 || i + 1 == n)).collect();
        compare(&mut cpu, &ends, Buckets::FLAGS)?;
    }
    compare(&mut cpu, &flags(MAX_ITEMS, 0.01, 1), Buckets::FLAGS)
}

fn keys_are_sorted_stably() -> Result<(), Failed> {
    let mut cpu = cpu()?;
    for n in SIZES {
        // some keys are beyond the buckets and dropped
        compare(&mut cpu, &keys(n, 20, n.into()), Buckets::keys(17))?;
        compare(&mut cpu, &keys(n, 1 << 16, n.into()), Buckets::digit(5, 4))?;
        compare(&mut cpu, &keys(n, 7, n.into()), Buckets { count: 3, first: 2, shift: 0, mask: u32::MAX })?;
    }
    compare(&mut cpu, &vec![3; 5000], Buckets::keys(5))
}

/// Three digits, the least significant first: the indices of each pass permute the words of the next.
fn digits_make_a_radix_sort() -> Result<(), Failed> {
    let mut cpu = cpu()?;
    let words = keys(50_000, 1 << 12, 1);
    let mut order: Vec<u32> = (0..words.len() as u32).collect();
    for digit in 0..3 {
        let permuted: Vec<u32> = order.iter().map(|&item| words[item as usize]).collect();
        let (indices, _, _) = run(&mut cpu, &permuted, Buckets::digit(4 * digit, 4))?;
        order = indices[..words.len()].iter().map(|&at| order[at as usize]).collect();
    }
    let mut expected: Vec<u32> = (0..words.len() as u32).collect();
    expected.sort_by_key(|&item| words[item as usize]);
    ensure(order == expected, || "digit by digit is another order".to_owned())
}

/// The comparison itself can fail: with a flag that was turned, in a list of another length or not.
fn a_wrong_order_is_seen() -> Result<(), Failed> {
    let words = flags(1000, 0.5, 1);
    let (indices, _, _) = run(&mut cpu()?, &words, Buckets::FLAGS)?;
    let mut other = words;
    other[0] ^= 1;
    let kept = expected(&other, Buckets::FLAGS);
    ensure(indices[..kept.len()] != kept, || "another list of flags gives the same indices".to_owned())
}

fn on_device(executor: &mut dyn Executor) -> Result<(), Failed> {
    for n in [1, 64, 65, 4096, 4097, 70_000] {
        for probability in [0.0, 0.3, 1.0] {
            compare(executor, &flags(n, probability, n.into()), Buckets::FLAGS)?;
        }
    }
    let words = keys(70_000, 20, 3);
    compare(executor, &words, Buckets::keys(17))?;
    let (host, device) = (run(&mut cpu()?, &words, Buckets::keys(17))?, run(executor, &words, Buckets::keys(17))?);
    ensure(host == device, || "the device's words differ from the host's".to_owned())
}
