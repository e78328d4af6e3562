//! Adapters: what is there, and opening one.

use crate::error::{AdapterError, Error};
use crate::exec::Flavour;

/// A GPU adapter, or a driver that emulates one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Name of the device.
    pub name: String,
    /// Vulkan, Metal, Dx12...
    pub backend: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Kind of the device: discrete, integrated, virtual, software, other.
    pub kind: &'static str,
    /// Runs on the CPU.
    pub software: bool,
}

impl AdapterInfo {
    fn of(info: &wgpu::AdapterInfo) -> Self {
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        };
        Self {
            name: info.name.clone(),
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            kind,
            software: info.device_type == wgpu::DeviceType::Cpu,
        }
    }
}

fn enumerate() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    // hardware first; otherwise in the driver's order
    adapters.sort_by_key(|a| a.get_info().device_type == wgpu::DeviceType::Cpu);
    adapters
}

/// All adapters, hardware first.
pub fn adapters() -> Vec<AdapterInfo> {
    enumerate().iter().map(|a| AdapterInfo::of(&a.get_info())).collect()
}

/// What a device of the adapter needs for kernels of the flavour, to be joined with what else the device is for: all of the adapter's
/// limits, so that planes may be as large as it binds, and the feature that loads modules as they are. Without that feature `exact`
/// cannot be had, and `fast` has to be asked for by name.
///
/// # Errors
/// [`Error::Adapter`] if the adapter cannot run the flavour, which names what it lacks.
pub fn requirements(adapter: &wgpu::Adapter, flavour: Flavour) -> Result<wgpu::DeviceDescriptor<'static>, Error> {
    let wgpu::AdapterInfo { name, backend, .. } = adapter.get_info();
    let required_features = useful(&name, backend, adapter.features(), flavour)?;
    Ok(wgpu::DeviceDescriptor {
        label: Some("restir"),
        required_features,
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    })
}

/// What kernels of the flavour use of an adapter's features, if it has what they need.
fn useful(
    name: &str,
    backend: wgpu::Backend,
    features: wgpu::Features,
    flavour: Flavour,
) -> Result<wgpu::Features, Error> {
    let passthrough = wgpu::Features::PASSTHROUGH_SHADERS;
    let (needed, lacks) = match flavour {
        Flavour::Fast => (wgpu::Features::empty(), None),
        Flavour::Exact if backend != wgpu::Backend::Vulkan => (passthrough, Some("Vulkan")),
        Flavour::Exact => (passthrough, (!features.contains(passthrough)).then_some("the feature PASSTHROUGH_SHADERS")),
    };
    let refused = |what| AdapterError::Lacks { adapter: name.to_owned(), what }.into();
    lacks.map_or(Ok(features & (needed | wgpu::Features::PIPELINE_CACHE)), |what| Err(refused(what)))
}

pub(crate) fn open(name: Option<&str>, flavour: Flavour) -> Result<(wgpu::Device, wgpu::Queue), Error> {
    let adapters = enumerate();
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    let wanted = name.unwrap_or_default().to_lowercase();
    let Some(index) = names.iter().position(|n| n.to_lowercase().contains(&wanted)) else {
        return Err(match name {
            Some(name) if !names.is_empty() => AdapterError::Named { asked: name.to_owned(), known: names },
            _ => AdapterError::None,
        }
        .into());
    };
    let adapter = &adapters[index];
    // who asks for `fast` may load `exact` on the same device, where it can be had
    let wanted = requirements(adapter, Flavour::Exact);
    let mut descriptor =
        if flavour == Flavour::Fast { wanted.or_else(|_| requirements(adapter, flavour)) } else { wanted }?;
    // no kernel needs its clock, but whoever measures does
    descriptor.required_features |= adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
    let opened = pollster::block_on(adapter.request_device(&descriptor));
    opened.map_err(|e| AdapterError::Closed { adapter: names[index].clone(), source: e.into() }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::{Backend, Features};

    /// `exact` is refused where it cannot be had, by a sentence that names what is missing and the flavour to ask for; `fast` never is.
    #[test]
    fn exact_is_refused_without_vulkan_and_without_passthrough() {
        let all = Features::PASSTHROUGH_SHADERS | Features::PIPELINE_CACHE | Features::TIMESTAMP_QUERY;
        let known = Features::PASSTHROUGH_SHADERS | Features::PIPELINE_CACHE;
        for (backend, features, lacks) in [
            (Backend::Vulkan, all, None),
            (Backend::Vulkan, Features::PASSTHROUGH_SHADERS, None),
            (Backend::Vulkan, Features::PIPELINE_CACHE, Some("PASSTHROUGH_SHADERS")),
            (Backend::Metal, all, Some("Vulkan")),
            (Backend::Dx12, Features::empty(), Some("Vulkan")),
        ] {
            let exact = useful("a card", backend, features, Flavour::Exact);
            match lacks {
                None => assert_eq!(exact.unwrap(), features & known),
                Some(what) => {
                    let said = exact.unwrap_err().to_string();
                    assert!([what, "a card", "the flavour fast"].iter().all(|word| said.contains(word)), "{said}");
                }
            }
            assert_eq!(
                useful("a card", backend, features, Flavour::Fast).unwrap(),
                features & Features::PIPELINE_CACHE
            );
        }
    }
}
