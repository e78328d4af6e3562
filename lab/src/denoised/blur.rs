//! What anybody would try first: a Gaussian blur of light over reflectance.

use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::image::Image;
use restir_host::scene::Camera;
use restir_host::technique::{Technique, path::PathSettings};
use restir_shared::denoise::Reflectance;
use restir_shared::glam::Vec3;
use restir_shared::num;

/// Standard deviations that are tried, in pixels.
pub(super) const WIDTHS: [f32; 6] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// What a surface gives back if it is black.
const POLISH: f32 = 0.04;

/// What the surface of each pixel gives back, at its centre, seen by the scene's camera if no other is given.
pub(super) fn reflectances(
    scene: &SceneBuffers,
    camera: Option<&Camera>,
    size: [u32; 2],
) -> Result<Vec<Vec3>, restir_host::Error> {
    let integral = PathSettings { jitter: false, ..PathSettings::default() }.integral();
    let camera = camera.copied().unwrap_or(scene.camera);
    let shot = Shot { scene, frame: 0.0, camera: &|_| camera, size, seed: 0, integral, samples: 1 };
    let channels = shot.channels(&[Aov::Albedo, Aov::Scattering])?;
    let at = |first: usize, i: usize| Vec3::from_array([0, 1, 2].map(|c| channels[first + c].values[i]));
    let pixels = 0..(size[0] * size[1]) as usize;
    let color = |i| if at(3, i) == Vec3::ZERO { at(0, i) } else { at(0, i) * at(3, i) };
    Ok(pixels.map(|i| Reflectance::new(color(i) * (1.0 - POLISH) + Vec3::splat(POLISH)).channels()).collect())
}

/// The image, over the reflectances, blurred, and multiplied by them again.
pub(super) fn blurred(image: &Image, reflectances: &[Vec3], sigma: f32) -> Image {
    let [width, height] = [image.width as i32, image.height as i32];
    let light: Vec<Vec3> = image.pixels.iter().zip(reflectances).map(|(p, r)| Vec3::from_array(*p) / *r).collect();
    let reach = (3.0 * sigma).ceil() as i32;
    let along = |from: &[Vec3], [dx, dy]: [i32; 2]| -> Vec<Vec3> {
        let at = |x: i32, y: i32| {
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for step in -reach..=reach {
                let (x, y) = (x + dx * step, y + dy * step);
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    let away = step as f32 / sigma;
                    let weight = num::exp(-0.5 * away * away);
                    sum += from[(y * width + x) as usize] * weight;
                    weights += weight;
                }
            }
            sum / weights
        };
        (0..width * height).map(|i| at(i % width, i / width)).collect()
    };
    let blurred = along(&along(&light, [1, 0]), [0, 1]);
    let pixels = blurred.iter().zip(reflectances).map(|(l, r)| (*l * *r).to_array()).collect();
    Image { pixels, ..*image }
}
