//! Resampling of samples that were drawn under others (Kettunen et al. 2023, "Conditional Resampled Importance Sampling and ReSTIR"): contribution
//! weights whose types say what drew a sample, and what it was drawn under.
//!
//! A contribution weight `W` of a sample `X` given `Z` has `E[f(X) W | Z] = ∫ f(x) dx` for every `f` (definition 4.1). The weight of a prefix of a path
//! times that of a suffix given the prefix is one of the path (theorem 4.1), as long as what drew the suffix had no part in the prefix, nor in its choice. The types
//! refuse what does not hold that:
//!
//! | type | is |
//! |---|---|
//! | [`Weighted`] | a sample and its weight; what drew it, and what it is given |
//! | [`Given`] | a sample under which others are drawn; its own weight stays behind |
//! | [`Choice`] | one of several, by targets that see no more than the sample |
//! | [`Source`], [`Apart`] | random numbers, and that those of two sources are independent |
//!
//! ```
//! use restir_shared::conditional::{Choice, Weighted, balance};
//! restir_shared::sources! { Supporting, Suffixes, Integration, Canonical }
//!
//! // paths from 2 prefixes over 3 suffixes, each drawn with the same probability
//! let f = |x: u32, s: u32| (x + 1) as f32 * (s + x) as f32;
//! let supporting = Weighted::<_, f32, Supporting>::new(0_u32, 2.0);
//! let suffix = supporting.given().draw::<_, Suffixes, _>(2_u32, 3.0);
//!
//! // the suffix moves to another prefix, which is independent of both; there it has the same measure
//! let prefix = Weighted::<_, f32, Integration>::new(1_u32, 2.0);
//! let borrowed = prefix.given().borrow(&suffix, |s| Some((*s, 1.0))).expect("no suffix is impossible there");
//! let canonical = prefix.given().draw::<_, Canonical, _>(1_u32, 3.0);
//! let [of_borrowed, of_canonical] = [2, 1].map(|s| [f(0, s), f(1, s)]);
//! let sum = f(1, 2) * borrowed.weight() * balance(of_borrowed[0], of_borrowed[1])
//!     + f(1, 1) * canonical.weight() * balance(of_canonical[1], of_canonical[0]);
//! assert!(sum * prefix.weight() > 0.0);
//! ```
//!
//! **A target that sees the suffix** makes the choice of the prefix a part of the suffix's law (fault 1). A pair is no prefix for suffixes of the
//! source that it has:
//!
//! ```compile_fail,E0277
//! use restir_shared::conditional::{Choice, Weighted};
//! restir_shared::sources! { Supporting, Suffixes }
//!
//! let prefix = Weighted::<_, f32, Supporting>::new(0_u32, 2.0);
//! let pair = prefix.with(&prefix.given().draw::<_, Suffixes, _>(2_u32, 3.0));
//! let mut choice = Choice::new(|(x, s): &(u32, u32)| (x * s) as f32);
//! choice.offer(&pair, 1.0, |_| true);
//! let chosen = choice.finish().unwrap();
//! chosen.given().draw::<_, Suffixes, _>(1_u32, 3.0);
//! ```
//!
//! **Random numbers that prefix and suffix share** (fault 2):
//!
//! ```compile_fail,E0277
//! use restir_shared::conditional::Weighted;
//! restir_shared::sources! { Supporting, Suffixes }
//!
//! let prefix = Weighted::<_, f32, Supporting>::new(0_u32, 2.0);
//! prefix.given().draw::<_, Supporting, _>(2_u32, 3.0);
//! ```
//!
//! **An integration prefix that is not independent of what it borrows** (fault 3), here a supporting one:
//!
//! ```compile_fail,E0277
//! use restir_shared::conditional::Weighted;
//! restir_shared::sources! { Supporting, Suffixes }
//!
//! let supporting = Weighted::<_, f32, Supporting>::new(0_u32, 2.0);
//! let suffix = supporting.given().draw::<_, Suffixes, _>(2_u32, 3.0);
//! supporting.given().borrow(&suffix, |s| Some((*s, 1.0)));
//! ```
//!
//! **The weight of a suffix under another prefix** without its shift and Jacobian (fault 5):
//!
//! ```compile_fail,E0308
//! use restir_shared::conditional::Weighted;
//! restir_shared::sources! { Supporting, Suffixes, Integration }
//!
//! let supporting = Weighted::<_, f32, Supporting>::new(0_u32, 2.0);
//! let suffix = supporting.given().draw::<_, Suffixes, _>(2_u32, 3.0);
//! let prefix = Weighted::<_, f32, Integration>::new(1_u32, 2.0);
//! prefix.with(&suffix);
//! ```

mod choice;
mod source;
mod weighted;

pub use choice::{Choice, balance};
pub use source::{Apart, Scalar, Source};
pub use weighted::{Given, Weighted};
