//! What takes the noise out of the image.

use restir::Error;
use restir::advanced::aov::Shot;
use restir::denoise::Denoise;
use restir::image::Image;

use super::super::parse::require;

/// What `--denoise` means.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Denoiser {
    /// Kernels on the device that renders.
    Svgf,
    /// Open Image Denoise, once the image is done.
    Oidn,
}

impl Denoiser {
    /// Refuses what this program cannot do.
    pub(super) fn check(self, numbered: bool) -> Result<(), Error> {
        let problem =
            format_args!("--denoise=oidn is for a single image; give --denoise alone, or one frame by --time");
        require(self == Self::Svgf || !numbered, problem)?;
        if self == Self::Oidn && !cfg!(feature = "oidn") { Err(without_oidn()) } else { Ok(()) }
    }

    /// Settings of the render.
    pub(super) fn settings(self) -> Option<Denoise> {
        (self == Self::Svgf).then(Denoise::default)
    }
}

/// The image, denoised by Open Image Denoise.
#[cfg(feature = "oidn")]
pub(super) fn by_oidn(image: Image, shot: &Shot<'_>) -> Result<Image, Error> {
    super::super::progress::patiently("denoising", || restir::advanced::oidn::denoise(&image, shot))
}

#[cfg(not(feature = "oidn"))]
pub(super) fn by_oidn(_: Image, _: &Shot<'_>) -> Result<Image, Error> {
    Err(without_oidn())
}

fn without_oidn() -> Error {
    Error::Setting(
        "--denoise=oidn needs Open Image Denoise, without which this program was built; build it with --features oidn, or give --denoise alone"
            .to_owned(),
    )
}
