//! `cargo xtask surface`: how many items the libraries show to who depends on them.
//!
//! Counted is what rustdoc reaches from a crate's root: types, traits, aliases, constants, macros and functions, and the functions and
//! constants of a type's own. Modules are not counted, nor are the fields, the variants and what belongs to a trait.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use clap::Args;
use serde::Deserialize;
use serde_json::Value;

use crate::Error;
use crate::process::finish;

/// The crates whose items are counted.
const CRATES: [&str; 2] = ["restir-host", "restir-shared"];
/// Kinds of items that count, as rustdoc names them.
const COUNTED: [&str; 9] =
    ["struct", "enum", "union", "trait", "type_alias", "constant", "static", "macro", "function"];

/// Options of `cargo xtask surface`.
#[derive(Args)]
pub struct Options {
    /// Fail if there are more items.
    #[arg(long)]
    most: Option<usize>,
    /// Name the items.
    #[arg(long)]
    list: bool,
}

/// What rustdoc writes of a crate.
#[derive(Deserialize)]
struct Documented {
    root: u32,
    index: BTreeMap<String, Item>,
}

#[derive(Deserialize)]
struct Item {
    name: Option<String>,
    inner: BTreeMap<String, Value>,
}

/// Counts the items of both crates.
pub fn run(options: &Options) -> Result<(), Error> {
    let mut all = 0;
    for name in CRATES {
        let items = documented(name)?.items();
        if options.list {
            items.iter().for_each(|item| println!("{item}"));
        }
        println!("{name}: {} public items", items.len());
        all += items.len();
    }
    println!("{all} in all");
    match options.most {
        Some(most) if all > most => Err(Error::Failed(format!("there are {all} public items, more than {most}"))),
        _ => Ok(()),
    }
}

/// Has rustdoc describe a crate; its JSON is not stable, which the variable allows all the same. Build scripts ask for that, so what is built stays
/// apart.
fn documented(name: &str) -> Result<Documented, Error> {
    let target = Path::new("target/surface");
    let mut rustdoc = Command::new("cargo");
    rustdoc.args(["rustdoc", "--quiet", "--lib", "--package", name, "--target-dir"]).arg(target);
    rustdoc.args(["--", "-Z", "unstable-options", "--output-format", "json", "--cap-lints", "allow"]);
    finish(rustdoc.env("RUSTC_BOOTSTRAP", "1"))?;
    let path = target.join("doc").join(name.replace('-', "_")).with_extension("json");
    let text = std::fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    serde_json::from_str(&text).map_err(|error| Error::Environment(format!("{}: {error}", path.display())))
}

impl Documented {
    /// The counted items by their paths, in order.
    fn items(&self) -> Vec<String> {
        let mut found = BTreeMap::new();
        self.add(self.root, "", &mut found);
        found.into_values().flatten().collect()
    }

    /// Adds what an item is or holds, once.
    fn add(&self, id: u32, path: &str, found: &mut BTreeMap<u32, Vec<String>>) {
        let Some(item) = self.index.get(&id.to_string()).filter(|_| !found.contains_key(&id)) else { return };
        let Some((kind, inner)) = item.inner.first_key_value() else { return };
        let path = |name: &Option<String>| format!("{path}::{}", name.as_deref().unwrap_or_default());
        match kind.as_str() {
            "module" => {
                found.insert(id, Vec::new());
                ids(&inner["items"]).for_each(|id| self.add(id, &path(&item.name), found));
            }
            "use" => ids(&Value::from(vec![inner["id"].clone()]))
                .for_each(|id| self.add(id, path(&None).trim_end_matches("::"), found)),
            kind if COUNTED.contains(&kind) => {
                let path = path(&item.name);
                let own = self.own(inner).map(|name| format!("{path}::{name}"));
                found.insert(id, std::iter::once(path.clone()).chain(own).collect());
            }
            _ => {}
        }
    }

    /// The functions and constants of a type's own.
    fn own<'a>(&'a self, item: &'a Value) -> impl Iterator<Item = &'a str> {
        let item_of = |id: u32| self.index.get(&id.to_string());
        let blocks = ids(&item["impls"]).filter_map(move |id| item_of(id)?.inner.get("impl"));
        let inherent = blocks.filter(|block| block["trait"].is_null());
        inherent.flat_map(|block| ids(&block["items"])).filter_map(move |id| item_of(id)?.name.as_deref())
    }
}

/// The numbers in a list.
fn ids(list: &Value) -> impl Iterator<Item = u32> {
    list.as_array().into_iter().flatten().filter_map(Value::as_u64).filter_map(|id| u32::try_from(id).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_and_what_is_their_own_are_counted_once() {
        let described = serde_json::json!({ "root": 0, "index": {
            "0": { "name": "crate", "inner": { "module": { "items": [1, 2, 3] } } },
            "1": { "name": "inner", "inner": { "module": { "items": [4] } } },
            "2": { "name": null, "inner": { "use": { "id": 4 } } },
            "3": { "name": "f", "inner": { "function": {} } },
            "4": { "name": "S", "inner": { "struct": { "impls": [5, 6] } } },
            "5": { "name": null, "inner": { "impl": { "trait": null, "items": [7] } } },
            "6": { "name": null, "inner": { "impl": { "trait": {}, "items": [8] } } },
            "7": { "name": "new", "inner": { "function": {} } },
            "8": { "name": "fmt", "inner": { "function": {} } },
        }});
        let documented: Documented = serde_json::from_value(described).expect("of that form");
        let mut items = documented.items();
        items.sort();
        assert_eq!(items, ["::crate::f", "::crate::inner::S", "::crate::inner::S::new"]);
    }
}
