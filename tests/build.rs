//! Says whether this is a build for development, in which only the first tier of the tests runs.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("PROFILE").is_ok_and(|profile| profile == "debug") {
        println!("cargo::rustc-cfg=first_tier");
    }
}
