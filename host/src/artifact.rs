//! The compiled kernels: where they are, embedded in restir-kernels or in a folder.

use crate::error::{Cause, Error, explained};
use crate::spirv;
use restir_kernels::KernelDesc;
use restir_kernels::spirv::Flavour;
use std::{borrow::Cow, path::PathBuf};

const MANIFEST: &str = "manifest.json";

/// Where compiled kernels come from.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shaders {
    /// The modules that are embedded in [`restir_kernels`].
    Embedded,
    /// A folder laid out like `kernels/spirv`.
    Folder(PathBuf),
}

impl Shaders {
    /// The SPIR-V words of a kernel, checked against the hash in the manifest.
    ///
    /// # Errors
    /// [`Error::Module`] if it is missing or not the module that the manifest lists.
    #[doc(hidden)]
    pub fn load(&self, kernel: &str, flavour: Flavour) -> Result<Vec<u32>, Error> {
        let broken = |source: Cause| Error::Module { kernel: kernel.to_owned(), source };
        let bytes = self.read(&format!("{flavour}/{kernel}.spv")).map_err(broken)?;
        let manifest = self.read(MANIFEST).map_err(broken)?;
        let manifest: serde_json::Value = serde_json::from_slice(&manifest)
            .map_err(|e| broken(explained(format!("the manifest is no JSON: {e}"), e)))?;
        let listed = manifest["kernels"][kernel][flavour.to_string()]["blake3"].as_str().unwrap_or_default();
        if blake3::hash(&bytes).to_hex().as_str() != listed {
            let problem = "module is not the one that the manifest lists, so it is damaged or out of date";
            return Err(broken(format!("the {flavour} {problem}").into()));
        }
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// [`Self::load`] with the kernel's specialization constants frozen to `constants`, in the order of the descriptor.
    ///
    /// # Errors
    /// As of [`Self::load`].
    #[doc(hidden)]
    pub fn specialised(&self, kernel: &KernelDesc, constants: &[u32], flavour: Flavour) -> Result<Vec<u32>, Error> {
        let words = self.load(kernel.name, flavour)?;
        let values: Vec<(u32, u32)> = kernel.constants.iter().map(|c| c.id).zip(constants.iter().copied()).collect();
        let frozen = spirv::freeze(&words, &values);
        frozen.ok_or_else(|| Error::Module { kernel: kernel.name.to_owned(), source: "it is no SPIR-V".into() })
    }

    fn read(&self, name: &str) -> Result<Cow<'static, [u8]>, Cause> {
        match self {
            Self::Embedded => restir_kernels::spirv::file(name)
                .map(Cow::Borrowed)
                .ok_or_else(|| format!("this library was built without {name}").into()),
            Self::Folder(folder) => {
                let path = folder.join(name);
                let unread = |e| explained(format!("cannot read {}: {e}", path.display()), e);
                std::fs::read(&path).map(Cow::Owned).map_err(unread)
            }
        }
    }
}
