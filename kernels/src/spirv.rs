//! The compiled kernels: the files that `cargo xtask shader build` has written, embedded in this crate.
//!
//! A module is there in two flavours: `exact` gives the bits of the native twin on devices that keep the numeric contract, `fast` uses the
//! device's own division, roots and intrinsics.
//!
//! ```
//! use restir_kernels::spirv::file;
//!
//! for kernel in restir_kernels::all() {
//!     for flavour in ["exact", "fast"] {
//!         let module = file(&format!("{flavour}/{}.spv", kernel.name)).expect("a module of every kernel");
//!         // the magic number of SPIR-V
//!         assert_eq!(module[..4], 0x0723_0203_u32.to_le_bytes());
//!     }
//! }
//! assert!(file("manifest.json").is_some());
//! ```

/// All of them, under their paths in the folder `spirv` of this crate: `manifest.json`, and modules such as
/// `exact/path.spv`. What the manifest lists is there, but in a workspace in which somebody has removed it.
pub static FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/spirv.rs"));

/// The file at a path.
pub fn file(path: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_kernel_is_embedded_in_both_flavours() {
        for kernel in crate::all().iter().filter(|kernel| kernel.name != "size_probe") {
            for flavour in ["exact", "fast"] {
                let path = format!("{flavour}/{}.spv", kernel.name);
                assert!(super::file(&path).is_some(), "{path}");
            }
        }
        assert!(super::file("manifest.json").is_some() && super::file("").is_none());
    }
}
