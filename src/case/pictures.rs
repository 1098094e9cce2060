//! Pictures of a run: names of their files, what they show, and ranges of their colours.

use super::checks::Document;
use super::file::{
    BodyColour, PictureSection, Quantity, SliceSection, VectorSection, ViewSection, ViewSlice, WallSection,
    WallShape,
};
use crate::error::Result;
use crate::math::Vec3;

/// A picture of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePlan {
    /// Beginning of the names of its files, unique in a run.
    pub name: String,
    /// The flow in a plane, by itself or in the view.
    pub slice: Option<SlicePlan>,
    /// The box in perspective.
    pub view: Option<ViewPlan>,
}

/// A slice of the flow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SlicePlan {
    /// The axis across which it lies, and the coordinate along it (m), as far as the case says.
    pub cut: Option<(usize, Option<f64>)>,
    /// Quantity in colour.
    pub quantity: Quantity,
    /// Values at both ends of the colours, if the case says so.
    pub range: Option<[f64; 2]>,
}

/// The box in perspective.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewPlan {
    /// Direction from the box to the eye, if the case says so.
    pub from: Option<Vec3>,
    /// Factor by which all is larger.
    pub zoom: f64,
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Meaning of the colours of the particles.
    pub colour: BodyColour,
    /// Values at both ends of these colours, if the case says so.
    pub range: Option<[f64; 2]>,
    /// True if force chains are drawn.
    pub chains: bool,
    /// Force at the upper end of their colours (N), if the case says so.
    pub force_range: Option<f64>,
}

/// Sine of the angle between a plane and its velocity up to which it slides.
const SLIDING: f64 = 1e-6;

/// The pictures that a case asks for; by default a slice, where there is a fluid, and a view.
pub(super) fn pictures(document: &Document, size: Vec3) -> Result<Vec<PicturePlan>> {
    let dry = document.case.dry.is_some();
    let default = || {
        let slice = PictureSection { slice: Some(SliceSection::default()), ..PictureSection::default() };
        let view = PictureSection { view: Some(ViewSection::default()), ..PictureSection::default() };
        [slice, view].into_iter().filter(|picture| !dry || picture.view.is_some()).collect()
    };
    let sections = document.case.output.pictures.clone().unwrap_or_else(default);
    let mut plans: Vec<PicturePlan> = Vec::new();
    for (i, section) in sections.iter().enumerate() {
        let key = format!("output.pictures.{i}");
        let plan = picture(document, &key, section, size)?;
        if let Some(first) = plans.iter().position(|other| other.name == plan.name) {
            let title = format!("two pictures have the name `{}`, with which their files begin", plan.name);
            let keys = [(&*format!("output.pictures.{first}"), "first"), (&*key, "second")];
            return Err(document.error_at(&keys, &title, "give one of them another, as in name = \"side\""));
        }
        plans.push(plan);
    }
    Ok(plans)
}

fn picture(document: &Document, key: &str, section: &PictureSection, size: Vec3) -> Result<PicturePlan> {
    let default = section.slice.as_ref().and_then(|slice| {
        let quantity = slice.quantity.unwrap_or_else(|| along_sliding_wall(document).0);
        serde_json::to_value(quantity).ok().and_then(|name| Some(name.as_str()?.to_owned()))
    });
    let name = section.name.clone().or(default).unwrap_or_else(|| "view".to_owned());
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 64 || !name.chars().all(is_plain) {
        let wanted = "1 to 64 letters, digits, `-` and `_`";
        return Err(document.out_of_range(&format!("{key}.name"), &name, wanted, "files begin with it"));
    }
    let slice_of =
        |part: &str, section: &SliceSection| slice(document, &format!("{key}.{part}"), section, size);
    let Some(view) = &section.view else {
        let own = section.slice.as_ref().map(|section| slice_of("slice", section));
        return Ok(PicturePlan { name, slice: own.transpose()?, view: None });
    };
    let slice = match &view.slice {
        Some(ViewSlice::Slice(section)) => Some(slice_of("view.slice", section)?),
        Some(ViewSlice::Shown(false)) => None,
        None if document.case.dry.is_some() => None,
        Some(ViewSlice::Shown(true)) | None => Some(slice_of("view.slice", &SliceSection::default())?),
    };
    let range = range(document, &format!("{key}.view.range"), view.range)?;
    let from = |from| document.direction(&format!("{key}.view.from"), from);
    let plain = view.force_chains || slice.is_some();
    let colour = if plain { BodyColour::Plain } else { along_sliding_wall(document).1 };
    let view = ViewPlan {
        from: view.from.map(from).transpose()?,
        zoom: view.zoom,
        size: view.size,
        colour: view.colour.unwrap_or(colour),
        range,
        chains: view.force_chains,
        force_range: view.force_range,
    };
    Ok(PicturePlan { name, slice, view: Some(view) })
}

/// Quantities that show a flow between sliding walls: the velocity, with its sign, along the fastest of them; without one the speed.
fn along_sliding_wall(document: &Document) -> (Quantity, BodyColour) {
    let fastest = |velocity: &VectorSection| {
        let function = velocity.function();
        function.constant().unwrap_or_else(|| function.largest())
    };
    // In dry runs a face may also move towards the box.
    let faces = document.case.domain.faces.iter().map(|(name, face)| {
        let axis = super::file::FACES.iter().position(|face| face == name).map(|n| n / 2);
        let velocity = fastest(&face.velocity);
        Vec3::from_fn(|i, _| if Some(i) == axis { 0.0 } else { velocity[i] })
    });
    let slides = |wall: &&WallSection| match &wall.shape {
        WallShape::Plane(plane) => {
            Vec3::from(plane.normal).normalize().dot(&fastest(&wall.velocity).normalize()).abs() < SLIDING
        }
        _ => true,
    };
    let walls = document.case.walls.iter().filter(slides).map(|wall| fastest(&wall.velocity));
    let first = faces.chain(walls).max_by(|a, b| a.norm().total_cmp(&b.norm()));
    match first.filter(|velocity| *velocity != Vec3::zeros()).map(|velocity| velocity.iamax()) {
        Some(0) => (Quantity::VelocityX, BodyColour::VelocityX),
        Some(1) => (Quantity::VelocityY, BodyColour::VelocityY),
        Some(_) => (Quantity::VelocityZ, BodyColour::VelocityZ),
        None => (Quantity::Speed, BodyColour::Speed),
    }
}

fn slice(document: &Document, key: &str, section: &SliceSection, size: Vec3) -> Result<SlicePlan> {
    if document.case.dry.is_some() {
        let title = format!("`{key}` has no meaning in a dry run");
        return Err(document.error(key, &title, "there is no flow to slice", "remove it"));
    }
    let cut = match (section.normal, section.position) {
        (Some(normal), position) => Some((normal as usize, position)),
        (None, None) => None,
        (None, Some(_)) => {
            let at = format!("{key}.position");
            let title = format!("`{at}` needs the axis along which it is measured");
            return Err(document.error(&at, &title, "along which axis?", "add normal = \"y\""));
        }
    };
    if let Some((axis, Some(position))) = cut
        && !(0.0..=size[axis]).contains(&position)
    {
        let wanted = format!("from 0 to {}, the length of the box", size[axis]);
        return Err(document.out_of_range(&format!("{key}.position"), position, &wanted, "in metres"));
    }
    let range = range(document, &format!("{key}.range"), section.range)?;
    let quantity = section.quantity.unwrap_or_else(|| along_sliding_wall(document).0);
    Ok(SlicePlan { cut, quantity, range })
}

fn range(document: &Document, key: &str, range: Option<[f64; 2]>) -> Result<Option<[f64; 2]>> {
    match range {
        Some([lo, hi]) if lo >= hi => {
            let remedy = "the smaller value first, as in [-0.1, 0.1]";
            Err(document.out_of_range(key, format!("[{lo}, {hi}]"), "two values in ascending order", remedy))
        }
        range => Ok(range),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::from_text;

    /// Names of the pictures of a box that is closed along z, and the quantity of the slice in the last one.
    fn default(more: &str) -> (Vec<String>, Option<Quantity>) {
        let text = format!(
            "domain = {{ size = [4e-3, 4e-3, 4e-3], periodic = [true, true, false]{more}\n\
             fluid = {{ density = 1000, viscosity = 1e-5 }}\n\
             lattice = {{ cells_per_diameter = 4, relaxation_time = 0.8 }}\n\
             particles = [{{ shape.sphere.diameter = 1e-3, density = 1000, count = 1 }}]\n\
             run.end.steps = 1"
        );
        let plans = from_text(&text, "case", &[]).unwrap().plan.output.pictures;
        let last = plans.last().unwrap().slice.as_ref().map(|slice| slice.quantity);
        (plans.into_iter().map(|plan| plan.name).collect(), last)
    }

    #[test]
    fn without_a_wall_that_slides_pictures_show_the_speed() {
        assert_eq!(default("}"), (vec!["speed".into(), "view".into()], Some(Quantity::Speed)));
        let at_rest = ", faces = { \"z+\" = { velocity = [0, 0, 0] } } }";
        assert_eq!(default(at_rest).1, Some(Quantity::Speed));
    }

    #[test]
    fn between_sliding_walls_pictures_show_the_velocity_along_the_fastest_with_its_sign() {
        let faces =
            ", faces = { \"z-\" = { velocity = [1e-4, 0, 0] }, \"z+\" = { velocity = [0, -2e-4, 0] } } }";
        assert_eq!(default(faces), (vec!["velocity_y".into(), "view".into()], Some(Quantity::VelocityY)));
        let rod = "}\nwalls = [{ name = \"rod\", rod = { point = [2e-3, 2e-3, 0], axis = [0, 1, 0], diameter = 1e-3 }, \
                   velocity = [0, 1e-4, 0] }]";
        assert_eq!(default(rod).1, Some(Quantity::VelocityY));
    }
}
