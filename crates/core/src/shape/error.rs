//! Errors of points or surfaces that describe no body.

use std::path::PathBuf;

/// Defect of the points or the surface of a body. Points and facets count from 0, in the order of the input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length that must be positive and finite is not.
    #[error("{quantity} must be positive and finite, but is {value}")]
    BadSize {
        /// Name of the quantity, e.g. `"radius"`.
        quantity: &'static str,
        /// Its value (m, or without unit).
        value: f64,
    },
    /// An exponent of a superellipsoid for which there is no convex body, or no precise distance.
    #[error(
        "exponent {value} is outside {low}..={high}: the body would not be convex, or its edges too sharp"
    )]
    BadExponent {
        /// Its value.
        value: f64,
        /// Least value that is allowed.
        low: f64,
        /// Greatest value that is allowed.
        high: f64,
    },
    /// A body needs four corners.
    #[error("a body needs at least 4 different points, but there are {count}")]
    TooFewPoints {
        /// Number of different points.
        count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {index} is ({}, {}, {}): every coordinate must be a finite number", at[0], at[1], at[2])]
    NotFinite {
        /// Number of the point.
        index: usize,
        /// Its coordinates.
        at: [f64; 3],
    },
    /// All points lie in a plane or on a line.
    #[error("the points are flat: {extent} across, but only {height} thick; a body needs a volume")]
    Flat {
        /// Longest edge of the bounding box (m).
        extent: f64,
        /// Largest distance from the plane through three far points (m).
        height: f64,
    },
    /// More faces than contacts can be computed with in a reasonable time.
    #[error(
        "the convex hull has {count} flat faces, but at most {most} are of use: contacts look at all of them; take a coarser \
         mesh or fewer points"
    )]
    TooManyFaces {
        /// Number of faces, where those in one plane are one.
        count: usize,
        /// Most that are allowed.
        most: usize,
    },
    /// A point lies below the surface of the hull.
    #[error(
        "point {index} at ({}, {}, {}) lies {depth} below the convex hull of all points, so the body is concave; \
         bodies must be convex: leave the point out, or set `hull = true` to take the hull",
        at[0], at[1], at[2]
    )]
    Concave {
        /// Number of the point.
        index: usize,
        /// Its coordinates (m).
        at: [f64; 3],
        /// Depth below the surface of the hull (m).
        depth: f64,
    },
    /// More parts than set-up and contacts can look at in a reasonable time.
    #[error(
        "the body has {count} convex parts, those that overlap cut apart, but at most {most} are of use; take fewer or larger ones"
    )]
    TooManyParts {
        /// Number of parts.
        count: usize,
        /// Most that are allowed.
        most: usize,
    },
    /// The surface in a file is not that of a convex body.
    #[error("{}: {problem}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// Facet, numbers and remedy.
        problem: String,
    },
}

/// Refuses a length that is not positive and finite.
///
/// # Errors
/// [`ShapeError::BadSize`], with the quantity and its value.
pub fn check_size(quantity: &'static str, value: f64) -> Result<(), ShapeError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(ShapeError::BadSize { quantity, value }) }
}
