//! Pictures of a run: names of their files, what they show, and ranges of their colours.

use super::checks::Document;
use super::file::{BodyColour, PictureSection, Quantity, SliceSection, ViewSection, ViewSlice};
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
    /// What the colours of the particles mean.
    pub colour: BodyColour,
    /// Values at both ends of these colours, if the case says so.
    pub range: Option<[f64; 2]>,
    /// Whether force chains are drawn.
    pub chains: bool,
    /// Force at the upper end of their colours (N), if the case says so.
    pub force_range: Option<f64>,
}

/// The pictures that a case asks for; by default a slice of the speed, where there is a fluid, and a view.
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
    let default = match &section.slice {
        Some(slice) => {
            serde_json::to_value(slice.quantity).ok().and_then(|name| Some(name.as_str()?.to_owned()))
        }
        None => None,
    };
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
        Some(ViewSlice::Shown(true)) => Some(slice_of("view.slice", &SliceSection::default())?),
        None if document.case.dry.is_none() => Some(SlicePlan::default()),
        Some(ViewSlice::Shown(false)) | None => None,
    };
    let range = range(document, &format!("{key}.view.range"), view.range)?;
    let from = |from| document.direction(&format!("{key}.view.from"), from);
    let plain = view.force_chains || slice.is_some();
    let colour = if plain { BodyColour::Plain } else { BodyColour::Speed };
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
    Ok(SlicePlan { cut, quantity: section.quantity, range })
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
