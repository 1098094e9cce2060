//! The case as a document: the position of every key, and errors with key, position, value and remedy.

use super::FluidSetup;
use super::file::{Case, Duration, Every, OrientationSection};
use crate::document::{Schema, Source};
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use std::fmt::Display;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Times with which steps are counted (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    pub(super) time_step: f64,
    /// Infinite where nothing settles.
    pub(super) stokes_time: f64,
}

impl Clock {
    pub(super) fn of(time_step: f64, fluid: Option<&FluidSetup>) -> Self {
        Self { time_step, stokes_time: fluid.map_or(f64::INFINITY, |fluid| fluid.scales.stokes_time) }
    }
}

/// A parsed case and the positions of its keys, which are paths such as `particles.0.shape`.
pub(super) struct Document<'a> {
    source: &'a Source,
    tree: Spanned<DeTable<'a>>,
    pub(super) case: Case,
    /// The text with the options applied.
    pub(super) text: String,
}

impl<'a> Document<'a> {
    pub(super) fn parse(source: &'a Source) -> Result<Self> {
        let tree = source.tree(&Schema::of::<Case>())?;
        let (table, text) = source.effective(tree.clone())?;
        let case = table.try_into().map_err(|e| source.type_error(&e))?;
        Ok(Self { source, tree, case, text })
    }

    /// The innermost value on the path of a key, and whether it is that of the key itself.
    fn find(&self, key: &str) -> Option<(&Spanned<DeValue<'a>>, bool)> {
        let mut names = key.split('.');
        let mut value = self.tree.get_ref().get(names.next()?)?;
        for name in names {
            let tree = value.get_ref();
            let Some(inner) = tree.get(name).or_else(|| tree.get(name.parse::<usize>().ok()?)) else {
                return Some((value, false));
            };
            value = inner;
        }
        Some((value, true))
    }

    /// Position of the value of a key; that of its section if it has its default, empty without one.
    pub(super) fn span(&self, key: &str) -> Range<usize> {
        self.find(key).map_or(0..0, |(value, _)| value.span())
    }

    /// True if the case gives the key.
    pub(super) fn has(&self, key: &str) -> bool {
        self.find(key).is_some_and(|(_, found)| found)
    }

    /// The number at a key.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.find(key)? {
            (value, true) => match value.get_ref() {
                DeValue::Float(number) => number.as_str().parse().ok(),
                DeValue::Integer(number) => number.as_str().parse().ok(),
                _ => None,
            },
            _ => None,
        }
    }

    /// The one key of a table such as `{ sphere = { ... } }`.
    pub(super) fn choice(&self, key: &str) -> &str {
        let table = self.find(key).and_then(|(value, _)| value.get_ref().as_table());
        table.and_then(|table| table.keys().next()).map_or("", |name| name.get_ref())
    }

    /// An error at one key.
    pub(super) fn error(&self, key: &str, title: &str, label: &str, remedy: &str) -> Error {
        self.error_at(&[(key, label)], title, remedy)
    }

    /// An error that several keys make together, each with a label.
    pub(super) fn error_at(&self, keys: &[(&str, &str)], title: &str, remedy: &str) -> Error {
        let spans: Vec<_> = keys.iter().map(|(key, label)| (self.span(key), *label)).collect();
        let marks: Vec<_> = spans.iter().map(|(span, label)| (span, *label)).collect();
        self.source.error_at(&marks, title, remedy)
    }

    /// A warning at one key, rendered.
    pub(super) fn warning(&self, key: &str, title: &str, label: &str, remedy: &str) -> String {
        self.source.warning(&self.span(key), title, label, remedy)
    }

    /// `key` is `value`, but must be `wanted`.
    pub(super) fn out_of_range(&self, key: &str, value: impl Display, wanted: &str, remedy: &str) -> Error {
        self.source.out_of_range(key, &self.span(key), &value.to_string(), wanted, remedy)
    }

    /// A vector of any length but 0 as a unit vector.
    pub(super) fn direction(&self, key: &str, vector: [f64; 3]) -> Result<Vec3> {
        (Vec3::from(vector).try_normalize(0.0)).ok_or_else(|| {
            self.out_of_range(key, "[0, 0, 0]", "a direction of any length but 0", "e.g. [0, 0, 1]")
        })
    }

    /// An orientation from an axis and an angle, or from a quaternion.
    pub(super) fn orientation(&self, key: &str, given: &OrientationSection) -> Result<Quat> {
        let example = "e.g. { axis = [0, 0, 1], angle = 45 }";
        let zero = |name: &str, value: &str, remedy: &str| {
            self.out_of_range(&format!("{key}.{name}"), value, "not all zero", remedy)
        };
        let (axis, angle) = match (given.axis, given.angle, given.quaternion) {
            (_, None, Some([i, j, k, w])) => {
                let norm = (i * i + j * j + k * k + w * w).sqrt();
                if !norm.is_finite() || norm <= 0.0 {
                    return Err(zero("quaternion", "[0, 0, 0, 0]", "[i, j, k, w]"));
                }
                let unit = Quaternion::new(w / norm, i / norm, j / norm, k / norm);
                return Ok(Quat::new_unchecked(unit));
            }
            (_, Some(_), Some(_)) => {
                let title = format!("`{key}.angle` belongs to an axis, but there is a quaternion");
                let key = format!("{key}.angle");
                return Err(self.error(&key, &title, "has no effect here", "remove it"));
            }
            (Some(axis), Some(angle), None) => (axis, angle),
            (_, _, None) => {
                let title = format!("`{key}` has an axis, but no angle");
                return Err(self.error(key, &title, "by how much?", example));
            }
        };
        let Some(axis) = Vec3::from(axis).try_normalize(0.0) else {
            return Err(zero("axis", "[0, 0, 0]", example));
        };
        let half = 0.5 * angle.to_radians();
        let (sine, cosine) = (libm::sin(half), libm::cos(half));
        Ok(Quat::new_normalize(Quaternion::from_parts(cosine, axis * sine)))
    }

    /// A length of time in whole steps, at least one.
    pub(super) fn steps(&self, key: &str, duration: Duration, clock: Clock) -> Result<u64> {
        let seconds = match duration {
            Duration::Steps(0) => {
                return Err(self.out_of_range(key, "0 steps", "at least 1 step", "give more steps"));
            }
            Duration::Steps(steps) => return Ok(steps),
            Duration::Time(seconds) => seconds,
            Duration::StokesTimes(_) if !clock.stokes_time.is_finite() => {
                return Err(self.error(
                    key,
                    &format!("`{key}` is in units of t*, but nothing settles in this case"),
                    "t* is infinite: gravity is zero or the densities are equal",
                    "use { steps = ... } or { time = ... }",
                ));
            }
            Duration::StokesTimes(times) => times * clock.stokes_time,
        };
        let steps = (seconds / clock.time_step).round().max(1.0);
        if steps > 1e15 {
            let remedy = format!("one time step is {:.3e} s", clock.time_step);
            return Err(self.out_of_range(key, format!("{steps:e} steps"), "below 1e15 steps", &remedy));
        }
        Ok(steps as u64)
    }

    /// Steps between outputs, by default `default`; 0 is never.
    pub(super) fn interval(
        &self,
        key: &str,
        every: Option<Every>,
        clock: Clock,
        default: u64,
    ) -> Result<u64> {
        let duration = match every {
            None => return Ok(default.max(1)),
            Some(Every::Never) => return Ok(0),
            Some(Every::Time(x)) => Duration::Time(x),
            Some(Every::Steps(n)) => Duration::Steps(n),
            Some(Every::StokesTimes(x)) => Duration::StokesTimes(x),
        };
        self.steps(key, duration, clock)
    }
}
