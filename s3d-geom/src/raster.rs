//! Row-major images of any pixel type.

/// A `width` × `height` image, row-major, with the origin at the top left: pixel (x, y) is
/// `data[y * width + x]`.
///
/// ```
/// use s3d_geom::Raster;
///
/// let depth = Raster::from_vec(3, 2, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
/// assert_eq!((depth.at(2, 0), depth.row(1)), (3.0, &[4.0, 5.0, 6.0][..]));
/// assert_eq!(depth.map(|metres| metres < 2.5).pixels(), [true, true, false, false, false, false]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster<T> {
    width: u32,
    height: u32,
    data: Vec<T>,
}

impl<T> Raster<T> {
    /// Makes an image from its rows, top row first.
    ///
    /// # Panics
    /// If `data.len()` is not `width * height`.
    pub fn from_vec(width: u32, height: u32, data: Vec<T>) -> Self {
        assert_eq!(
            data.len(),
            width as usize * height as usize,
            "{width}×{height} pixels need as many values"
        );
        Self { width, height, data }
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the number of pixels.
    pub fn len(&self) -> usize {
        self.data.len()
    }

    /// Returns true if the image has no pixel.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    /// Returns all pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// Returns all pixels, row by row, for writing.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Returns the pixels of row `y`, left to right.
    ///
    /// # Panics
    /// If `y` is not below the height.
    pub fn row(&self, y: u32) -> &[T] {
        let start = y as usize * self.width as usize;
        &self.data[start..start + self.width as usize]
    }

    /// Iterates over the rows, top to bottom.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[T]> {
        self.data.chunks_exact(self.width.max(1) as usize)
    }

    /// Turns the image into its pixels, row by row.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }
}

impl<T: Copy> Raster<T> {
    /// Makes an image with the same value everywhere.
    pub fn filled(width: u32, height: u32, value: T) -> Self {
        Self { width, height, data: vec![value; width as usize * height as usize] }
    }

    /// Returns the pixel at column `x`, row `y`.
    ///
    /// # Panics
    /// If `y` is not below the height.
    pub fn at(&self, x: u32, y: u32) -> T {
        debug_assert!(x < self.width);
        self.data[y as usize * self.width as usize + x as usize]
    }

    /// Makes an image of the same size by applying `f` to each pixel.
    pub fn map<U>(&self, f: impl FnMut(T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, data: self.data.iter().copied().map(f).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_pixels_agree() {
        let r = Raster::from_vec(3, 2, vec![0, 1, 2, 3, 4, 5]);
        assert_eq!(r.row(1), &[3, 4, 5]);
        assert_eq!(r.at(2, 1), 5);
        assert_eq!(r.rows().map(<[i32]>::len).collect::<Vec<_>>(), [3, 3]);
        assert_eq!(r.map(|v| v * 2).into_vec(), [0, 2, 4, 6, 8, 10]);
    }

    #[test]
    #[should_panic(expected = "3×2 pixels")]
    fn a_wrong_length_is_a_callers_mistake() {
        let _ = Raster::from_vec(3, 2, vec![0; 5]);
    }
}
