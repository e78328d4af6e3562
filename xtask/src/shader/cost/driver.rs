//! What a Vulkan driver tells of pipelines: `VK_KHR_pipeline_executable_properties`.

use std::ffi::CStr;

use ash::{khr, vk};
use restir_kernels::KernelDesc;

use crate::Error;

/// What a pipeline takes. What a driver does not tell is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cost {
    /// Vector registers of an invocation.
    pub(super) registers: Option<u64>,
    /// Scalar and vector registers that are kept in memory.
    pub(super) spills: Option<[u64; 2]>,
    /// Bytes of memory of an invocation's own.
    pub(super) local_bytes: Option<u64>,
    /// Waves that a SIMD unit holds at once.
    pub(super) waves: Option<u64>,
    /// Instructions.
    pub(super) instructions: Option<u64>,
    /// Bytes of code.
    pub(super) code_bytes: Option<u64>,
}

/// A device of a driver that tells what pipelines take.
pub(super) struct Driver {
    /// Of the adapter and its driver.
    pub(super) name: String,
    _entry: ash::Entry,
    instance: ash::Instance,
    device: ash::Device,
    executables: khr::pipeline_executable_properties::Device,
}

/// Says what Vulkan could not do.
fn failed(what: &str) -> impl Fn(vk::Result) -> Error {
    move |result| Error::Environment(format!("the Vulkan driver cannot {what}: {result}"))
}

impl Driver {
    /// The first adapter that tells; nothing if there is none.
    pub(super) fn open() -> Result<Option<Self>, Error> {
        // SAFETY: the library is the system's Vulkan loader, whose entry points are what `ash` takes them to be
        let Ok(entry) = (unsafe { ash::Entry::load() }) else { return Ok(None) };
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: what `info` points to lives until the call returns
        let Ok(instance) = (unsafe { entry.create_instance(&info, None) }) else { return Ok(None) };
        // SAFETY: the instance was made above
        let adapters = unsafe { instance.enumerate_physical_devices() }.map_err(failed("list adapters"))?;
        let Some(adapter) = adapters.into_iter().find(|&adapter| tells(&instance, adapter)) else { return Ok(None) };
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&priorities)];
        let extensions = [khr::pipeline_executable_properties::NAME.as_ptr()];
        let mut told =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut told);
        // SAFETY: the adapter has the extension, and what `info` points to lives until the call returns
        let device = unsafe { instance.create_device(adapter, &info, None) }.map_err(failed("open the adapter"))?;
        let executables = khr::pipeline_executable_properties::Device::new(&instance, &device);
        Ok(Some(Self { name: name(&instance, adapter), _entry: entry, instance, device, executables }))
    }

    /// What a kernel's module takes, specialised to these values of the constants of these ids.
    pub(super) fn cost(&self, kernel: &KernelDesc, words: &[u32], constants: &[(u32, u32)]) -> Result<Cost, Error> {
        let slots: Vec<_> = (0..kernel.bindings.len() as u32).map(slot).collect();
        let set = vk::DescriptorSetLayoutCreateInfo::default().bindings(&slots);
        let module = vk::ShaderModuleCreateInfo::default().code(words);
        let entries: Vec<_> = (0..).zip(constants).map(|(n, (id, _))| entry(n, *id)).collect();
        let values: Vec<u8> = constants.iter().flat_map(|(_, value)| value.to_le_bytes()).collect();
        let constants = vk::SpecializationInfo::default().map_entries(&entries).data(&values);
        let name = std::ffi::CString::new(kernel.name).unwrap_or_default();
        // SAFETY: all of these are of this device, what they point to lives until the calls return, modules are valid (`spirv-val`), and what
        // was made is destroyed once
        unsafe {
            let set = self.device.create_descriptor_set_layout(&set, None).map_err(failed("lay out buffers"))?;
            let sets = [set];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = self.device.create_pipeline_layout(&layout, None).map_err(failed("lay out a pipeline"))?;
            let module = self.device.create_shader_module(&module, None).map_err(failed("take a module"))?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(&name)
                .specialization_info(&constants);
            let pipeline = vk::ComputePipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stage(stage)
                .layout(layout);
            let made = self.device.create_compute_pipelines(vk::PipelineCache::null(), &[pipeline], None);
            let pipeline = made.map_err(|(_, result)| failed("compile a kernel")(result))?[0];
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let told = self.executables.get_pipeline_executable_statistics(&executable);
            self.device.destroy_pipeline(pipeline, None);
            self.device.destroy_shader_module(module, None);
            self.device.destroy_pipeline_layout(layout, None);
            self.device.destroy_descriptor_set_layout(set, None);
            Ok(Cost::of(&told.map_err(failed("tell what a kernel takes"))?))
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // SAFETY: nothing is left that was made of them
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A storage buffer at that index.
fn slot(binding: u32) -> vk::DescriptorSetLayoutBinding<'static> {
    vk::DescriptorSetLayoutBinding::default()
        .binding(binding)
        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::COMPUTE)
}

/// The constant of an id, whose value is the n-th word.
fn entry(n: u32, id: u32) -> vk::SpecializationMapEntry {
    vk::SpecializationMapEntry { constant_id: id, offset: 4 * n, size: 4 }
}

/// Whether the adapter has the extension.
fn tells(instance: &ash::Instance, adapter: vk::PhysicalDevice) -> bool {
    // SAFETY: the adapter is one of the instance
    let extensions = unsafe { instance.enumerate_device_extension_properties(adapter) }.unwrap_or_default();
    let name = |extension: &vk::ExtensionProperties| extension.extension_name_as_c_str().ok().map(CStr::to_owned);
    extensions.iter().any(|extension| name(extension).as_deref() == Some(khr::pipeline_executable_properties::NAME))
}

fn name(instance: &ash::Instance, adapter: vk::PhysicalDevice) -> String {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the adapter is one of the instance, of Vulkan 1.2 or later
    unsafe { instance.get_physical_device_properties2(adapter, &mut all) };
    let adapter = all.properties;
    let text = |text: Result<&CStr, _>| text.map_or_else(|_| String::new(), |text| text.to_string_lossy().into_owned());
    format!("{}, {}", text(adapter.device_name_as_c_str()), text(driver.driver_info_as_c_str()))
}

impl Cost {
    fn of(told: &[vk::PipelineExecutableStatisticKHR<'_>]) -> Self {
        // SAFETY: the format says which member of the union is meant; all that is asked for here are counts of 64 bits
        let value = |of: &vk::PipelineExecutableStatisticKHR<'_>| unsafe { of.value.u64 };
        let named = |names: &[&str]| {
            let is_of = |of: &&vk::PipelineExecutableStatisticKHR<'_>| {
                of.format == vk::PipelineExecutableStatisticFormatKHR::UINT64
                    && of.name_as_c_str().is_ok_and(|name| names.contains(&name.to_string_lossy().as_ref()))
            };
            told.iter().find(is_of).map(value)
        };
        // AMD's and NVIDIA's names
        Self {
            registers: named(&["VGPRs", "Register Count"]),
            spills: named(&["Spilled SGPRs"]).zip(named(&["Spilled VGPRs"])).map(|(scalar, vector)| [scalar, vector]),
            // NVIDIA's has something else in the upper half
            local_bytes: named(&["Scratch size", "Local Memory Size"]).map(|bytes| bytes & u64::from(u32::MAX)),
            waves: named(&["Subgroups per SIMD"]),
            instructions: named(&["Instructions", "Instruction Count"]),
            code_bytes: named(&["Code size", "Binary Size"]),
        }
    }
}
