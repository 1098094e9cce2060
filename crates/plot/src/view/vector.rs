//! Vectors of three numbers.

pub(super) type Vector = [f32; 3];

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(super) fn scale(a: Vector, factor: f32) -> Vector {
    a.map(|x| x * factor)
}

pub(super) fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The sum of three vectors with these factors.
pub(super) fn combine(axes: &[Vector; 3], factors: Vector) -> Vector {
    add(add(scale(axes[0], factors[0]), scale(axes[1], factors[1])), scale(axes[2], factors[2]))
}

pub(super) fn length(a: Vector) -> f32 {
    dot(a, a).sqrt()
}

/// The unit vector along `a`; a vector of zeros stays one.
pub(super) fn unit(a: Vector) -> Vector {
    let length = length(a);
    if length > 0.0 { scale(a, 1.0 / length) } else { a }
}

/// Unit vectors to the right and upwards for one who looks against the unit vector `back`; `up` is not parallel to it.
pub(super) fn screen(back: Vector, up: Vector) -> (Vector, Vector) {
    let right = unit(cross(up, back));
    (right, cross(back, right))
}
