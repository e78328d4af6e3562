//! What the driver has compiled, kept in a file, on backends where wgpu gives access to it (Vulkan).

use crate::output::{make_folder, making, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Bytes of the hash that the file begins with.
const HASH: usize = blake3::OUT_LEN;

/// A driver's cache and its file: the hash of the data, then the data.
#[derive(Debug)]
pub(super) struct Cache {
    path: PathBuf,
    driver: wgpu::PipelineCache,
}

impl Cache {
    /// The device's cache with what its file in `folder` holds; nothing if it is missing, damaged, or of another
    /// version of the driver. `None` where the device has no such cache.
    pub(super) fn open(device: &wgpu::Device, folder: &Path) -> Option<Self> {
        let has_caches = device.features().contains(wgpu::Features::PIPELINE_CACHE);
        let name = wgpu::util::pipeline_cache_key(&device.adapter_info()).filter(|_| has_caches)?;
        let path = folder.join(name);
        let file = std::fs::read(&path).unwrap_or_default();
        let descriptor = wgpu::PipelineCacheDescriptor { label: Some("restir"), data: sound(&file), fallback: true };
        // SAFETY: the data are whole, so they are what `save` wrote, which came from a cache of this adapter's key;
        // wgpu compares its own header with the driver's version.
        let driver = unsafe { device.create_pipeline_cache(&descriptor) };
        Some(Self { path, driver })
    }

    pub(super) fn driver(&self) -> &wgpu::PipelineCache {
        &self.driver
    }

    /// Writes the file. It saves time and nothing else, so where it cannot be written the work goes on without.
    pub(super) fn save(&self) {
        let Some(data) = self.driver.get_data() else { return };
        let hash = blake3::hash(&data);
        let _making = making();
        let folder = self.path.parent().map_or(Ok(()), make_folder);
        let _ = folder.is_ok().then(|| {
            write_atomically(&self.path, |file| file.write_all(hash.as_bytes()).and_then(|()| file.write_all(&data)))
        });
    }
}

/// The data of a file that is not damaged.
fn sound(file: &[u8]) -> Option<&[u8]> {
    let (hash, data) = file.split_at_checked(HASH)?;
    (blake3::hash(data).as_bytes() == hash).then_some(data)
}
