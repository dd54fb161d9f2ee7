//! The status of a photo's pixels: usable for a fit, or the reason why not.

/// Whether a fit may use a pixel, or else the first reason against it, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelStatus {
    /// Shows only the object, with a known value.
    Usable,
    /// The geometry does not cover it.
    Outside,
    /// The mask is 0, or it is below 1 inside the object.
    Masked,
    /// The photo's value is infinite or not a number.
    NotFinite,
    /// Contains the edge of the object.
    Silhouette,
    /// The photo's value is at the limit of the file format.
    Clipped,
}

/// How many pixels have each [`PixelStatus`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PixelCounts {
    /// [`PixelStatus::Usable`]
    pub usable: usize,
    /// [`PixelStatus::Outside`]
    pub outside: usize,
    /// [`PixelStatus::Masked`]
    pub masked: usize,
    /// [`PixelStatus::NotFinite`]
    pub not_finite: usize,
    /// [`PixelStatus::Silhouette`]
    pub silhouette: usize,
    /// [`PixelStatus::Clipped`]
    pub clipped: usize,
}

impl PixelCounts {
    pub(super) fn of(status: &[PixelStatus]) -> Self {
        status.iter().fold(Self::default(), |mut counts, status| {
            *match status {
                PixelStatus::Usable => &mut counts.usable,
                PixelStatus::Outside => &mut counts.outside,
                PixelStatus::Masked => &mut counts.masked,
                PixelStatus::NotFinite => &mut counts.not_finite,
                PixelStatus::Silhouette => &mut counts.silhouette,
                PixelStatus::Clipped => &mut counts.clipped,
            } += 1;
            counts
        })
    }
}

impl std::fmt::Display for PixelCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { usable, outside, masked, not_finite, silhouette, clipped } = self;
        write!(
            f,
            "{usable} usable, {outside} outside the object, {masked} masked, {not_finite} not finite, {silhouette} on \
             the silhouette, {clipped} clipped"
        )
    }
}
