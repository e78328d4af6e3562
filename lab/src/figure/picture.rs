//! Pictures side by side.

use restir::image::Image;

/// Pixels between pictures.
const GAP: u32 = 4;
const PAPER: [f32; 3] = [1.0; 3];

/// Pictures of one size in rows of so many, on white.
pub(crate) fn grid(pictures: &[Image], columns: usize) -> Image {
    let Some(first) = pictures.first() else { return Image::default() };
    let side = |count: usize, of_one: u32| count as u32 * (of_one + GAP) - GAP;
    let columns = columns.min(pictures.len());
    let (width, height) = (side(columns, first.width), side(pictures.len().div_ceil(columns), first.height));
    let mut grid = Image { width, height, pixels: vec![PAPER; width as usize * height as usize] };
    for (i, picture) in pictures.iter().enumerate() {
        let left = (i % columns) * (first.width + GAP) as usize;
        let top = (i / columns) * (first.height + GAP) as usize;
        for (y, row) in picture.pixels.chunks_exact(picture.width as usize).enumerate() {
            let start = (top + y) * width as usize + left;
            grid.pixels[start..start + row.len()].copy_from_slice(row);
        }
    }
    grid
}

/// Every pixel as a square of `times` x `times`.
pub(crate) fn enlarged(picture: &Image, times: u32) -> Image {
    let (width, height) = (picture.width * times, picture.height * times);
    let at = |i: u32| ((i / width / times) * picture.width + i % width / times) as usize;
    Image { width, height, pixels: (0..width * height).map(|i| picture.pixels[at(i)]).collect() }
}

/// A map of numbers as grey; 1 is white.
pub(crate) fn grey([width, height]: [u32; 2], values: impl Iterator<Item = f64>) -> Image {
    Image { width, height, pixels: values.map(|value| [value as f32; 3]).collect() }
}

/// Red for 1 and more, blue for -1 and less, white between.
pub(crate) fn signed(value: f64) -> [f32; 3] {
    let left = (1.0 - value.abs()).max(0.0) as f32;
    if value > 0.0 { [1.0, left, left] } else { [left, left, 1.0] }
}

/// The upper left of a picture that is as large as that or larger.
pub(crate) fn cropped(picture: &Image, [width, height]: [u32; 2]) -> Image {
    let rows = picture.pixels.chunks_exact(picture.width as usize).take(height as usize);
    Image { width, height, pixels: rows.flat_map(|row| &row[..width as usize]).copied().collect() }
}

/// Every pixel times a number.
pub(crate) fn brightened(picture: &Image, times: f32) -> Image {
    Image { pixels: picture.pixels.iter().map(|rgb| rgb.map(|x| times * x)).collect(), ..*picture }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_lie_in_rows() {
        let picture = |value: f64| grey([2, 1], [value; 2].into_iter());
        let made = grid(&[picture(0.1), picture(0.2), picture(0.3)], 2);
        assert_eq!((made.width, made.height), (2 * 2 + GAP, 2 + GAP));
        let row = |y: u32| made.pixels[(y * made.width) as usize..][..made.width as usize].to_vec();
        assert_eq!((row(0)[1], row(0)[2], row(0)[2 + GAP as usize]), ([0.1; 3], PAPER, [0.2; 3]));
        assert_eq!((row(1)[0], row(1 + GAP)[0], row(1 + GAP)[2 + GAP as usize]), (PAPER, [0.3; 3], PAPER));
        assert_eq!(grid(&[], 2), Image::default());
    }

    #[test]
    fn pixels_become_squares() {
        let made = enlarged(&grey([2, 1], [0.0, 1.0].into_iter()), 2);
        assert_eq!((made.width, made.height), (4, 2));
        assert_eq!(made.pixels[4..], [[0.0; 3], [0.0; 3], [1.0; 3], [1.0; 3]]);
        assert_eq!(cropped(&made, [3, 1]).pixels, [[0.0; 3], [0.0; 3], [1.0; 3]]);
        assert_eq!(brightened(&made, 2.0).pixels[2], [2.0; 3]);
    }

    #[test]
    fn signs_have_colours() {
        assert_eq!([1.5, 0.25, 0.0, -1.0].map(signed), [[1.0, 0.0, 0.0], [1.0, 0.75, 0.75], [1.0; 3], [0.0, 0.0, 1.0]]);
    }
}
