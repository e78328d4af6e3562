//! Mutated files and arguments: whatever is in them, the program ends as it should ([`trial`]).
//!
//! Case n is a function of the seed and of n. `cargo xtask mutate` runs more of them than the tests do.

mod arguments;
mod corpus;
mod mutate;
mod trial;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use corpus::Corpus;
use mutate::Dice;
use trial::{Place, Tally};

/// A number that `cargo xtask mutate` sets.
fn asked(name: &str, default: u64) -> u64 {
    let text = std::env::var(format!("RESTIR_MUTATION_{name}")).ok();
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// As many cases as the tests run.
const CASES: u64 = 2000;

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn mutated_files_and_arguments_are_refused_or_rendered() {
    let [cases, seconds] = [asked("CASES", CASES), asked("SECONDS", u64::MAX)];
    let [seed, first, threads] = [asked("SEED", 1), asked("FIRST", 0), asked("THREADS", 2)];
    let corpus = Corpus::new();
    let (next, start) = (AtomicU64::new(first), Instant::now());
    let total = Mutex::new(Tally::default());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let (place, mut tally) = (Place::new(), Tally::default());
                while start.elapsed() < Duration::from_secs(seconds) {
                    let case = next.fetch_add(1, Ordering::Relaxed);
                    if case >= first + cases {
                        break;
                    }
                    tally.add(place.run(case, corpus.case(&mut Dice::new(seed, case))));
                }
                total.lock().unwrap().merge(tally);
            });
        }
    });
    let total = total.into_inner().unwrap();
    println!("{} in {:.0} s", total.summary(), start.elapsed().as_secs_f64());
    assert!(total.faults.is_empty(), "{}", total.faults.join("\n"));
    let [done, refused] = [total.done, total.refused].map(|count| count as f64 / total.cases.max(1) as f64);
    assert!(total.cases < 1000 || done > 0.1 && refused > 0.1, "the cases have become all alike: {}", total.summary());
}
