//! Operands of the probes.

/// Of `bsdf_check`: a material, directions and random words.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BsdfOperands {
    /// Linear RGB.
    pub base_color: [f32; 3],
    /// Share of metal.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Strength of the specular reflection of a coat.
    pub specular: f32,
    /// Linear RGB.
    pub specular_color: [f32; 3],
    /// Share of specular transmission.
    pub transmission: f32,
    /// Share of diffuse transmission.
    pub diffuse_transmission: f32,
    /// Linear RGB.
    pub diffuse_transmission_color: [f32; 3],
    /// Not zero for a sheet.
    pub thin: u32,
    /// Not zero if the viewer is outside.
    pub front: u32,
    /// Unit vector to the viewer, with z > 0.
    pub wo: [f32; 3],
    /// Unit vector to evaluate.
    pub wi: [f32; 3],
    /// Random words of the sample.
    pub words: [u32; 4],
    /// Random words of the inverse.
    pub free: [u32; 4],
}

/// Of `diffusion_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DiffusionOperands {
    /// Uniform numbers.
    pub u: [f32; 4],
    /// Of each channel.
    pub albedo: [f32; 3],
    /// A distance in mean free paths.
    pub x: f32,
    /// `d` of each channel.
    pub distance: [f32; 3],
    /// 0 to 2: a remainder and a shape.
    pub fit: u32,
    /// Where light leaves.
    pub centre: [f32; 3],
    /// Whether all techniques count.
    pub published: u32,
    /// The normal there, of any length but zero.
    pub normal: [f32; 3],
    /// Anisotropy.
    pub anisotropy: f32,
    /// Another point, from there.
    pub beside: [f32; 3],
    /// A random number for the inverse.
    pub again: f32,
}

/// Of `num_probe`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct NumOperands {
    /// The operand of the functions of one number.
    pub x: f32,
    /// The exponent of the power, and with `x` and `z` a vector, a colour and the terms of a sum.
    pub y: f32,
    /// The third coordinate.
    pub z: f32,
    /// Factors of moderate magnitude.
    pub factors: [f32; 4],
    /// A packed word.
    pub word: u32,
}

/// Of `sampler_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SamplerOperands {
    /// Uniform numbers.
    pub u: [f32; 2],
    /// Random words, for discrete choices.
    pub words: [u32; 2],
    /// Of a cone, in (0, 2].
    pub versine: f32,
    /// Of an exponential density, not negative.
    pub rate: f32,
    /// Limit of a bounded one, positive.
    pub t_max: f32,
    /// Zero.
    pub reserved: u32,
}
