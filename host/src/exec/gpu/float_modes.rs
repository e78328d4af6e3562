//! Which float-control modes the adapter reports; wgpu does not tell.

use crate::spirv::FloatMode;

/// The modes that a Vulkan device does not report, which the loader has to drop. All of them elsewhere.
pub(super) fn unsupported(device: &wgpu::Device) -> Vec<FloatMode> {
    let reported = reported(device);
    FloatMode::ALL.into_iter().zip(reported).filter(|(_, is_reported)| !is_reported).map(|(mode, _)| mode).collect()
}

/// Whether the device reports each of [`FloatMode::ALL`].
#[cfg(not(target_vendor = "apple"))]
fn reported(device: &wgpu::Device) -> [bool; 2] {
    use ash::vk;
    // SAFETY: the handle is only used for a query and not kept.
    let supported = unsafe { device.as_hal::<wgpu::hal::api::Vulkan>() }.map(|device| {
        let mut controls = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut controls);
        let instance = device.shared_instance().raw_instance();
        // SAFETY: the instance made the physical device and both outlive the call; wgpu requires Vulkan 1.1 or the
        // extension that has this function.
        unsafe { instance.get_physical_device_properties2(device.raw_physical_device(), &mut properties) };
        controls
    });
    let modes = |controls: vk::PhysicalDeviceFloatControlsProperties<'_>| {
        [controls.shader_rounding_mode_rte_float32, controls.shader_signed_zero_inf_nan_preserve_float32]
    };
    supported.map_or([vk::FALSE; 2], modes).map(|is_reported| is_reported != vk::FALSE)
}

/// wgpu has no Vulkan on Apple's systems.
#[cfg(target_vendor = "apple")]
fn reported(_device: &wgpu::Device) -> [bool; 2] {
    [false; 2]
}
