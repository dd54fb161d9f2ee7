//! A grid with one value per pixel.

/// `height x width` values, row-major, top left first: coverage ([`super::decode_mask`]) or normals
/// ([`super::decode_normals`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Plane<T> {
    width: usize,
    height: usize,
    values: Vec<T>,
}

impl<T> Plane<T> {
    /// A plane from its values.
    ///
    /// # Panics
    /// If `values.len() != width * height`.
    #[must_use]
    pub fn from_values(width: usize, height: usize, values: Vec<T>) -> Self {
        assert_eq!(values.len(), width * height, "value count of a {width} x {height} plane");
        Self { width, height, values }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row-major, top left first.
    #[must_use]
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, by value.
    #[must_use]
    pub fn into_values(self) -> Vec<T> {
        self.values
    }
}

impl<T: Copy> Plane<T> {
    /// The value in column `column` of row `row`.
    ///
    /// # Panics
    /// If the pixel is outside the plane.
    #[must_use]
    pub fn value(&self, column: usize, row: usize) -> T {
        assert!(column < self.width, "column {column} of a plane {} wide", self.width);
        self.values[row * self.width + column]
    }
}
