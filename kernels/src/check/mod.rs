//! Functions on given operands, by which host and device are compared. They are for tests, and no interface.

#[cfg(feature = "cases")]
mod inputs;
pub mod operands;

kernels! {
    bsdf_check,
    crossing_check,
    diffusion_check,
    num_probe,
    ray_check,
    sampler_check,
    self_check,
    #[cfg(feature = "size-probe")]
    size_probe,
}

/// Parameters of a kernel that evaluates one probe an invocation.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Probes {
    /// Number of probes.
    pub count: u32,
}

restir_shared::fields!(Probes: count);

impl restir_shared::layout::Extent for Probes {
    fn extent(&self) -> [u32; 2] {
        [self.count, 1]
    }
}

/// The parity cases of a kernel of probes, by name.
#[cfg(feature = "cases")]
fn probes<T: bytemuck::Pod>(kernel: &'static crate::KernelDesc, operands: [(&str, Vec<T>); 2]) -> Vec<crate::Case> {
    let case = |(name, operands): (&str, Vec<T>)| {
        let params = Probes { count: operands.len() as u32 };
        crate::Case::new(kernel, name, params.count, 1).with(&[params]).with(&operands).output()
    };
    operands.map(case).into()
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    [bsdf_check::cases(), diffusion_check::cases(), num_probe::cases(), sampler_check::cases(), self_check::cases()]
        .concat()
}
