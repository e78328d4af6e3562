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
    let (info, features) = (adapter.get_info(), adapter.features());
    let passthrough = wgpu::Features::PASSTHROUGH_SHADERS;
    let lacks = match flavour {
        Flavour::Fast => None,
        Flavour::Exact if info.backend != wgpu::Backend::Vulkan => Some("Vulkan"),
        Flavour::Exact => (!features.contains(passthrough)).then_some("the feature PASSTHROUGH_SHADERS"),
    };
    if let Some(what) = lacks {
        return Err(AdapterError::Lacks { adapter: info.name, what }.into());
    }
    let useful =
        wgpu::Features::PIPELINE_CACHE | if flavour == Flavour::Exact { passthrough } else { wgpu::Features::empty() };
    Ok(wgpu::DeviceDescriptor {
        label: Some("restir"),
        required_features: features & useful,
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    })
}

pub(crate) fn open(name: Option<&str>) -> Result<(wgpu::Device, wgpu::Queue), Error> {
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
    let descriptor = requirements(adapter, Flavour::Exact).or_else(|_| requirements(adapter, Flavour::Fast))?;
    let opened = pollster::block_on(adapter.request_device(&descriptor));
    opened.map_err(|e| AdapterError::Closed { adapter: names[index].clone(), reason: e.to_string() }.into())
}
